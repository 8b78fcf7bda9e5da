"""The book of whoever sits there: what was recorded, in order, struck out or not."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from a7sim.link.client import Client
from a7sim.link.headers import quoted

COUNTERS = 5
"""Values of a registration before its elements: number, point, X, Y, Z."""


@dataclass(frozen=True)
class Entry:
    """A registration as the recorder keeps it."""

    number: int
    point: str
    counters: tuple[str, ...]
    elements: tuple[tuple[str, str], ...] = ()
    """Word of the language, such as BY1, and reading."""
    struck: bool = False

    @classmethod
    def read(cls, values: Sequence[str]) -> "Entry":
        """Return the entry that the values of `REC:LAST?` show."""
        number, point, *counters = values[:COUNTERS]
        rest = [each for each in values[COUNTERS:] if not each.startswith("struck:")]
        elements = tuple(zip(rest[0::2], rest[1::2], strict=True))
        return cls(int(number), point, tuple(counters), elements, len(rest) < len(values) - COUNTERS)

    def as_line(self) -> str:
        """Return the entry for people."""
        readings = " ".join(f"{reading:>9}" for reading in self.counters)
        elements = "".join(f"  {word} {reading}" for word, reading in self.elements)
        return f"{self.number:>3}  {self.point:<6}{readings}{elements}{'  struck out' if self.struck else ''}"

    def struck_out(self) -> "Entry":
        """Return the entry struck out; it stays."""
        return replace(self, struck=True)


def record(client: Client, point: str, elements: Sequence[str]) -> Entry | None:
    """Register the counters and elements under a point; return the entry, None where the instrument refused."""
    words = "".join(f",{word}" for word in elements)
    before, after = client.numbers(f"REC:COUN?;:REC {quoted(point)}{words};:REC:COUN?")
    return Entry.read(client.fields("REC:LAST?")) if after > before else None
