"""Book of the user: registrations in order, struck out or not."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from a7sim.console.state.readouts import values
from a7sim.console.state.selection import element_label
from a7sim.link.client.client import Client
from a7sim.link.client.replies import part_as_text
from a7sim.link.headers import quote_text, registration_word
from a7sim.plotters import VARIANTS

ELEMENTS = tuple(dict.fromkeys(name for variant in VARIANTS.values() for name in variant.elements))

COUNTERS = 5
"""Number of values of a registration before its elements: number, point, X, Y, Z."""


@dataclass(frozen=True)
class RecordedEntry:
    """Registration of the recorder."""

    number: int
    point: str
    counters: tuple[str, ...]
    elements: tuple[tuple[str, str], ...] = ()
    """Element in the notation of the field, such as by', and its reading."""
    struck: bool = False

    @classmethod
    def read(cls, values: Sequence[str]) -> "RecordedEntry":
        """Return the entry of the values of `REC:LAST?`."""
        number, point, *counters = values[:COUNTERS]
        rest = [each for each in values[COUNTERS:] if not each.startswith("struck:")]
        elements = tuple((_title(word), reading) for word, reading in zip(rest[0::2], rest[1::2], strict=True))
        return cls(int(number), point, tuple(counters), elements, len(rest) < len(values) - COUNTERS)

    def as_line(self) -> str:
        """Return the entry as a line; an x marks a struck one."""
        readings = "".join(f"{reading:>8}" for reading in self.counters)
        elements = "".join(f"  {word} {reading}" for word, reading in self.elements)
        return f"{'x' if self.struck else ' '}{self.number:>3} {self.point:<5}{readings}{elements}"

    def struck_out(self) -> "RecordedEntry":
        """Return the entry struck out; it stays."""
        return replace(self, struck=True)


BATCH_SIZE = 40
"""Number of registrations queried in one line."""


def read_book(client: Client, records: int) -> tuple[RecordedEntry, ...]:
    """Return the first `records` registrations of the recorder."""
    entries: list[RecordedEntry] = []
    for first in range(1, records + 1, BATCH_SIZE):
        numbers = range(first, min(first + BATCH_SIZE, records + 1))
        client.send(";".join(f"REC? {number}" for number in numbers))
        entries += [RecordedEntry.read(values(part_as_text(part))) for part in client.reply() or ()]
    return tuple(entries)


def _title(word: str) -> str:
    return next((element_label(element) for element in ELEMENTS if registration_word(element) == word), word)


def record(client: Client, point: str, elements: Sequence[str]) -> RecordedEntry | None:
    """Register the counters and elements under a point; return the entry, None if the instrument rejected it."""
    words = "".join(f",{word}" for word in elements)
    before, after = client.numbers(f"REC:COUN?;:REC {quote_text(point)}{words};:REC:COUN?")
    return RecordedEntry.read(client.fields("REC:LAST?")) if after > before else None
