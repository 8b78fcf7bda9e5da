"""Operator at a link, with a book, a clock and random numbers."""

from dataclasses import dataclass, field

from a7sim.link.client.client import Client
from a7sim.link.clock import Clock
from a7sim.operator.people.observation_book import ObservationBook
from a7sim.operator.people.random_draws import OperatorRandom
from a7sim.operator.people.slips import Slip
from a7sim.operator.people.timesheet import Timesheet
from a7sim.scenario import Observer

MAX_NOTE_LENGTH = 900


class OperatorGaveUp(Exception):
    """The operator gives up because the view contradicts the job sheet. The text is the remark in the book."""


@dataclass
class Person:
    """Operator at a link to the instrument, with an observation book and a clock."""

    client: Client
    clock: Clock
    observer: Observer
    seed: int
    book: ObservationBook = field(default_factory=ObservationBook)
    timesheet: Timesheet = field(default_factory=lambda: Timesheet(1))
    slips: list[Slip] = field(default_factory=list)
    """True record of all slips, unknown to the operator."""

    def __post_init__(self) -> None:
        self.random = OperatorRandom(self.observer, self.seed)

    def remark(self, text: str) -> None:
        """Write a remark into the book and into the journal of the instrument."""
        self.book.remark(self.clock.now, text)
        self.note(text)

    def note(self, text: str) -> None:
        """Write a note into the journal of the instrument."""
        printable = "".join(c if " " <= c <= "~" else "?" for c in text.replace('"', "'"))
        self.client.send(f'NOTE "{printable[:MAX_NOTE_LENGTH]}"')

    def give_up(self, reason: str) -> OperatorGaveUp:
        """Write the contradiction into the book and return it as an error to raise."""
        self.remark(f"does not fit: {reason}")
        return OperatorGaveUp(reason)
