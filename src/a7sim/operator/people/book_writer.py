"""Writers of the observation book: one for an operator at a link, and a null writer for a batch without books."""

from typing import Protocol

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.operator.people.person import Person
from a7sim.operator.people.slips import Slip
from a7sim.operator.people.timesheet import Timesheet


class BookWriter(Protocol):
    """Writer of the entries of an operator batch. The last axis of arrays contains all sessions or the m active."""

    timesheet: Timesheet
    slip_log: list[list[Slip]]
    """True record of all slips, by session; it is not part of the book."""

    def set_heading(self, model: str, form: str) -> None:
        """Start a form of a model; the next entries belong to it."""

    def begin_round(self, number: int) -> None:
        """Start a round of the form."""

    def advance_clock(self, seconds: float) -> None:
        """Advance the clock that dates the entries."""

    def enter(self, active: Indices, point: str, item: str, readings: Array) -> npt.NDArray[np.intp]:
        """Add readings ``(m,)`` and return the entry numbers ``(sessions,)``, zero where there is no entry."""

    def strike_out(self, active: Indices, numbers: npt.NDArray[np.intp], reason: str) -> None:
        """Strike out the entries of the active sessions by their numbers ``(sessions,)``; they stay, marked."""

    def remark(self, active: Indices, text: str) -> None:
        """Add a remark to the book and the journal."""

    def give_up(self, reason: str) -> None:
        """Write the reason into the book. Raises OperatorGaveUp for a single operator."""


class PersonBookWriter:
    """`BookWriter` of one operator at a link: writes into the operator's book and advances the operator's clock."""

    def __init__(self, person: Person) -> None:
        self._person = person
        self.timesheet = person.timesheet
        self.slip_log = [person.slips]

    def set_heading(self, model: str, form: str) -> None:
        """Start a form of a model in the book."""
        self._person.book.set_heading(model, form)

    def begin_round(self, number: int) -> None:
        """Set the round of the next entries."""
        self._person.book.round = number

    def advance_clock(self, seconds: float) -> None:
        """Advance the operator's clock."""
        self._person.clock.advance(seconds)

    def enter(self, active: Indices, point: str, item: str, readings: Array) -> npt.NDArray[np.intp]:
        """Add the reading, with the time of the clock, and return its entry number ``(1,)``."""
        numbers = np.zeros(1, dtype=np.intp)
        for session, reading in zip(active, readings, strict=True):
            numbers[session] = self._person.book.add(self._person.clock.now, point, item, f"{reading:.2f}")
        return numbers

    def strike_out(self, active: Indices, numbers: npt.NDArray[np.intp], reason: str) -> None:
        """Strike out the entry; it stays, marked."""
        for session in active:
            self._person.book.strike_out(int(numbers[session]), reason)

    def remark(self, active: Indices, text: str) -> None:
        """Add a remark to the book and the journal, unless no session is active."""
        if active.size:
            self._person.remark(text)

    def give_up(self, reason: str) -> None:
        """Raise OperatorGaveUp after writing the reason into the book and the journal."""
        raise self._person.give_up(reason)


class NullBookWriter:
    """`BookWriter` of a batch without books: it has a timesheet and a slip log, and its methods do nothing."""

    def __init__(self, sessions: int) -> None:
        self._sessions = sessions
        self.timesheet = Timesheet(sessions)
        self.slip_log: list[list[Slip]] = [[] for _ in range(sessions)]

    def set_heading(self, model: str, form: str) -> None:
        """Do nothing."""

    def begin_round(self, number: int) -> None:
        """Do nothing."""

    def advance_clock(self, seconds: float) -> None:
        """Do nothing: the batch counts its own seconds."""

    def enter(self, active: Indices, point: str, item: str, readings: Array) -> npt.NDArray[np.intp]:
        """Return zeros: there are no entries."""
        return np.zeros(self._sessions, dtype=np.intp)

    def strike_out(self, active: Indices, numbers: npt.NDArray[np.intp], reason: str) -> None:
        """Do nothing."""

    def remark(self, active: Indices, text: str) -> None:
        """Do nothing."""

    def give_up(self, reason: str) -> None:
        """Do nothing: the batch keeps the reason."""
