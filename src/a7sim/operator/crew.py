"""The people at a batch of instruments, one a session: what they get wrong, how long they take, what they write."""

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array
from a7sim.operator.dice import Dice
from a7sim.operator.person import Person
from a7sim.scenario import Observer

Who = npt.NDArray[np.intp]
"""Indices ``(m,)`` of the sessions that act."""


class Crew:
    """Persons of equal skill at their instruments. Arrays have the sessions, all of them, as their last axis.

    A single person at a line writes a book and gives up by raising DoesNotFit; in a crowd whoever gives up is left
    behind: `still` tells who goes on, `reasons` why others do not.
    """

    def __init__(self, observer: Observer, dice: Sequence[Dice], person: Person | None = None) -> None:
        self.observer = observer
        self.person = person
        self.seconds = np.zeros(len(dice))
        self.reasons: dict[int, str] = {}
        self._dice = dice
        self._given_up = np.zeros(len(dice), dtype=bool)

    @classmethod
    def of_one(cls, person: Person) -> "Crew":
        """Return the crew that is one person at a line."""
        return cls(person.observer, [person.dice], person)

    @property
    def sessions(self) -> int:
        """How many they are."""
        return len(self._dice)

    @property
    def everybody(self) -> Who:
        """Indices of all sessions that go on."""
        return np.flatnonzero(~self._given_up)

    def goes_on(self, who: Who) -> npt.NDArray[np.bool_]:
        """Return which have not given up."""
        return np.asarray(~self._given_up[who])

    def still(self, who: Who) -> Who:
        """Return those who have not given up."""
        return who[~self._given_up[who]]

    # --- chance ---------------------------------------------------------------------------------------

    def errors(self, who: Who, sigma: float, shape: tuple[int, ...]) -> Array:
        """Return the errors of planned settings ``(*shape, sessions)``, zero for those who do not act."""
        return self._drawn(who, shape, lambda dice: dice.errors(sigma, shape))

    def slips(self, who: Who, shape: tuple[int, ...]) -> Array:
        """Return what is misread at planned readings ``(*shape, sessions)``, in counter units."""
        return self._drawn(who, shape, lambda dice: dice.slips(shape))

    def errors_again(self, who: Who, sigma: float, count: int) -> Array:
        """Return the errors ``(count, sessions)`` of settings made once more."""
        return self._drawn(who, (count,), lambda dice: dice.errors_again(sigma, count))

    def slips_again(self, who: Who, count: int) -> Array:
        """Return what is misread ``(count, sessions)`` at readings made once more."""
        return self._drawn(who, (count,), lambda dice: dice.slips_again(count))

    def _drawn(self, who: Who, shape: tuple[int, ...], draw: Callable[[Dice], Array]) -> Array:
        drawn = np.zeros((self.sessions, *shape))
        for session in who:
            drawn[session] = draw(self._dice[session])
        return np.ascontiguousarray(np.moveaxis(drawn, 0, -1))

    # --- time, book, patience -------------------------------------------------------------------------

    def spend(self, who: Who, seconds: float) -> None:
        """Let time go by."""
        self.seconds[who] += seconds
        if self.person is not None:
            self.person.clock.spend(seconds)

    def enter(self, who: Who, point: str, item: str, readings: Array) -> npt.NDArray[np.intp]:
        """Enter readings ``(m,)`` in the book and return the numbers ``(sessions,)`` of the entries."""
        numbers = np.zeros(self.sessions, dtype=np.intp)
        if self.person is not None:
            for session, reading in zip(who, readings, strict=True):
                numbers[session] = self.person.book.enter(self.person.clock.now, point, item, f"{reading:.2f}")
        return numbers

    def strike(self, who: Who, numbers: npt.NDArray[np.intp], why: str) -> None:
        """Strike entries out; they stay, marked."""
        if self.person is not None:
            for session in who:
                self.person.book.strike(int(numbers[session]), why)

    def remark(self, who: Who, text: str) -> None:
        """Write a remark into the book and the journal."""
        if self.person is not None and who.size:
            self.person.remark(text)

    def give_up(self, who: Who, why: str | Callable[[int], str]) -> None:
        """Give up. Raises DoesNotFit for a person at a line."""
        for session in who:
            self.reasons[int(session)] = why if isinstance(why, str) else why(int(session))
            if self.person is not None:
                raise self.person.give_up(self.reasons[int(session)])
        self._given_up[who] = True
