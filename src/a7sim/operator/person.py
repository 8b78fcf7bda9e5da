"""The person in the chair: acuity, slips, pace and patience."""

from dataclasses import dataclass, field

from a7sim.link.client import Client, InstrumentRefused
from a7sim.link.clock import Clock
from a7sim.operator.book import Book
from a7sim.operator.dice import Dice
from a7sim.scenario import Observer

LONGEST_NOTE = 900


class DoesNotFit(Exception):
    """The operator gives up: what is seen cannot be what was ordered. The text is the remark in the book."""


@dataclass
class Person:
    """An operator at a line to the instrument, with a book and a watch."""

    client: Client
    clock: Clock
    observer: Observer
    seed: int
    book: Book = field(default_factory=Book)

    def __post_init__(self) -> None:
        self.dice = Dice(self.observer, self.seed)

    def look(self) -> None:
        """Let the time of a look go by."""
        self.clock.spend(self.observer.seconds_to_look)

    def turn(self, line: str) -> None:
        """Turn something."""
        self.clock.spend(self.observer.seconds_to_turn)
        self.client.send(line)

    def set(self, *lines: str) -> None:
        """Set elements, levers or gears, and see that the instrument took it."""
        for line in lines:
            self.clock.spend(self.observer.seconds_to_set)
            self.client.send(line)
        self.see_that_it_obeyed("; ".join(lines))

    def see_that_it_obeyed(self, doing: str) -> None:
        """Give up when the instrument has refused anything since the last look."""
        try:
            self.client.check(doing)
        except InstrumentRefused as refused:
            raise self.give_up(f"{doing}: the instrument refuses: {'; '.join(refused.errors[:2])}") from refused

    def read(self, question: str, slip: float = 0.0) -> float:
        """Read a counter, with a slip if there is one."""
        self.clock.spend(self.observer.seconds_to_read)
        return round(self.client.numbers(question)[0] + slip, 4)

    def compute(self) -> None:
        """Let the time at the desk calculator go by."""
        self.clock.spend(self.observer.seconds_to_compute)

    def remark(self, text: str) -> None:
        """Write a remark into the book and into the journal of the instrument."""
        self.book.remark(self.clock.now, text)
        self.note(text)

    def note(self, text: str) -> None:
        """Write a note into the journal of the instrument."""
        printable = "".join(c if " " <= c <= "~" else "?" for c in text.replace('"', "'"))
        self.client.send(f'NOTE "{printable[:LONGEST_NOTE]}"')

    def give_up(self, text: str) -> DoesNotFit:
        """Write what does not fit into the book and return it as an error to raise."""
        self.remark(f"does not fit: {text}")
        return DoesNotFit(text)
