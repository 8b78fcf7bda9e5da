"""The book of whoever sits there: what was recorded, in order, struck out or not."""

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
"""Values of a registration before its elements: number, point, X, Y, Z."""


@dataclass(frozen=True)
class RecordedEntry:
    """A registration as the recorder keeps it."""

    number: int
    point: str
    counters: tuple[str, ...]
    elements: tuple[tuple[str, str], ...] = ()
    """Element as the field writes it, such as by', and its reading."""
    struck: bool = False

    @classmethod
    def read(cls, values: Sequence[str]) -> "RecordedEntry":
        """Return the entry that the values of `REC:LAST?` show."""
        number, point, *counters = values[:COUNTERS]
        rest = [each for each in values[COUNTERS:] if not each.startswith("struck:")]
        elements = tuple((_title(word), reading) for word, reading in zip(rest[0::2], rest[1::2], strict=True))
        return cls(int(number), point, tuple(counters), elements, len(rest) < len(values) - COUNTERS)

    def as_line(self) -> str:
        """Return the entry for people; an x stands before one that is struck out."""
        readings = "".join(f"{reading:>8}" for reading in self.counters)
        elements = "".join(f"  {word} {reading}" for word, reading in self.elements)
        return f"{'x' if self.struck else ' '}{self.number:>3} {self.point:<5}{readings}{elements}"

    def struck_out(self) -> "RecordedEntry":
        """Return the entry struck out; it stays."""
        return replace(self, struck=True)


BATCH_SIZE = 40
"""Registrations that are asked for in a line."""


def read_book(client: Client, records: int) -> tuple[RecordedEntry, ...]:
    """Return so many registrations of the recorder, from the first, as they stand now."""
    entries: list[RecordedEntry] = []
    for first in range(1, records + 1, BATCH_SIZE):
        numbers = range(first, min(first + BATCH_SIZE, records + 1))
        client.send(";".join(f"REC? {number}" for number in numbers))
        entries += [RecordedEntry.read(values(part_as_text(part))) for part in client.reply() or ()]
    return tuple(entries)


def _title(word: str) -> str:
    return next((element_label(element) for element in ELEMENTS if registration_word(element) == word), word)


def record(client: Client, point: str, elements: Sequence[str]) -> RecordedEntry | None:
    """Register the counters and elements under a point; return the entry, None where the instrument refused."""
    words = "".join(f",{word}" for word in elements)
    before, after = client.numbers(f"REC:COUN?;:REC {quote_text(point)}{words};:REC:COUN?")
    return RecordedEntry.read(client.fields("REC:LAST?")) if after > before else None
