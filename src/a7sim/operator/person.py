"""The person in the chair: acuity, slips, pace and patience."""

from dataclasses import dataclass, field

import numpy as np

from a7sim.geometry import Array
from a7sim.link.client import Client, InstrumentRefused
from a7sim.link.clock import Clock
from a7sim.operator.book import Book
from a7sim.scenario import Observer

OPERATOR_STREAM = 4
"""Spawn key of the operator's random numbers."""

LONGEST_NOTE = 900

_GROSS_SLIPS = (-1.0, -0.5, -0.1, 0.1, 0.5, 1.0)
"""A digit read wrong further up, in counter units."""


class DoesNotFit(Exception):
    """The operator gives up: what is seen cannot be what was ordered. The text is the remark in the book."""


@dataclass
class Person:
    """An operator at a line to the instrument, with a book and a watch.

    Errors come in blocks, one draw for each setting that a step of the procedure makes, so that the same
    seed gives the same errors however long the closed loop of turning and looking takes.
    """

    client: Client
    clock: Clock
    observer: Observer
    seed: int
    book: Book = field(default_factory=Book)

    def __post_init__(self) -> None:
        planned, again = np.random.SeedSequence(self.seed, spawn_key=(OPERATOR_STREAM,)).spawn(2)
        self._planned = np.random.default_rng(planned)
        self._again = np.random.default_rng(again)

    def errors(self, sigma: float, shape: tuple[int, ...]) -> Array:
        """Return the errors of planned settings, in the unit of sigma."""
        return sigma * self._planned.standard_normal(shape)

    def error_again(self, sigma: float) -> float:
        """Return the error of one setting that has to be made once more."""
        return sigma * float(self._again.standard_normal())

    def slips(self, shape: tuple[int, ...]) -> Array:
        """Return what the person misreads at planned readings, in counter units; zero for most."""
        return _slips(self._planned, self.observer, shape)

    def slip_again(self) -> float:
        """Return what the person misreads at a reading made once more."""
        return float(_slips(self._again, self.observer, (1,))[0])

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


def _slips(rng: np.random.Generator, observer: Observer, shape: tuple[int, ...]) -> Array:
    luck = rng.random(shape)
    last_digit = 0.01 * rng.choice((-1.0, 1.0), shape)
    gross = rng.choice(_GROSS_SLIPS, shape)
    slipped = np.where(luck < observer.blunder_rate + observer.last_digit_slip, last_digit, 0.0)
    return np.where(luck < observer.blunder_rate, gross, slipped)
