"""Operators of a batch of sessions, one per session: their errors, their time and their entries."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, add_at, take
from a7sim.geometry import Array
from a7sim.operator.people.fatigue import MINUTE, acuity_factor, needs_a_break, slip_factor
from a7sim.operator.people.person import Person
from a7sim.operator.people.random_draws import OperatorRandom, misreading
from a7sim.operator.people.slips import OF_READINGS, SlipContext, Slips
from a7sim.operator.people.timesheet import Act, Timesheet
from a7sim.plotters import POSITIONS_OF
from a7sim.scenario import Observer


class AllGaveUpError(Exception):
    """All operators of a batch have given up."""


class OperatorBatch:
    """Operators of equal skill at their instruments. The last axis of arrays contains all sessions.

    A single operator at a link keeps a book and gives up by raising OperatorGaveUp; in a batch, sessions that give up
    are no longer active: `remaining` returns the active ones, `reasons` contains the reasons of the others.
    """

    def __init__(self, observer: Observer, dice: Sequence[OperatorRandom], person: Person | None = None) -> None:
        self.observer = observer
        self.person = person
        self.seconds = np.zeros(len(dice))
        self.reasons: dict[int, str] = {}
        self.timesheet = person.timesheet if person is not None else Timesheet(len(dice))
        self.slip_log = [person.slips] if person is not None else [[] for _ in dice]
        """True record of all slips, by session; no procedure reads it."""
        self._dice = dice
        self._given_up = np.zeros(len(dice), dtype=bool)
        self._slips = Slips(observer, dice, self.slip_log)
        self._rested_at = np.zeros(len(dice))
        self._model, self._form, self._round = "", "", 0

    @classmethod
    def single(cls, person: Person) -> "OperatorBatch":
        """Return the batch of one operator at a link."""
        return cls(person.observer, [person.random], person)

    @property
    def size(self) -> int:
        """Number of sessions."""
        return len(self._dice)

    @property
    def active(self) -> Indices:
        """Indices of all active sessions."""
        return np.flatnonzero(~self._given_up)

    def is_active(self, active: Indices) -> npt.NDArray[np.bool_]:
        """Return which sessions have not given up."""
        return np.asarray(~self._given_up[active])

    def remaining(self, active: Indices) -> Indices:
        """Return the sessions that have not given up."""
        return active[~self._given_up[active]]

    # --- headings -------------------------------------------------------------------------------------

    def begin(self, active: Indices, model: str, form: str) -> None:
        """Start a form of a model, after a break if one is due."""
        self._rest(active)
        self._slips.recheck_points(active.tolist())
        self._model, self._form, self._round = model, form, 0
        if self.person is not None:
            self.person.book.set_heading(model, form)

    def begin_round(self, active: Indices, number: int) -> None:
        """Start a round of the form, after a break if one is due."""
        self._rest(active)
        self._slips.recheck_points(active.tolist())
        self._round = number
        if self.person is not None:
            self.person.book.round = number

    def _rest(self, active: Indices) -> None:
        tired = active[needs_a_break(self.observer, self._since_rest(active))]
        if tired.size:
            self._let_go_by(tired, MINUTE * self.observer.break_minutes, "resting")
            self._rested_at[tired] = self.seconds[tired]

    def _since_rest(self, active: Indices) -> Array:
        return np.asarray(take(self.seconds, active) - take(self._rested_at, active))

    # --- chance ---------------------------------------------------------------------------------------

    def draw_setting_errors(self, active: Indices, sigma: float, shape: tuple[int, ...]) -> Array:
        """Return the errors of planned settings ``(*shape, sessions)``, zero for inactive sessions."""
        return self._among_all(
            active, self._acuity_factors(active, sigma) * self._drawn(active, shape, OperatorRandom.fill_setting_errors)
        )

    def draw_misreadings(self, active: Indices, shape: tuple[int, ...]) -> Array:
        """Return the misreadings of planned readings ``(*shape, sessions)``, in counter units."""
        luck = self._drawn(active, (3, *shape), OperatorRandom.fill_reading_draws)
        return self._among_all(active, misreading(self.observer, luck, self._slip_factors(active)))

    def redraw_setting_errors(self, active: Indices, sigma: float, count: int) -> Array:
        """Return the errors ``(count, sessions)`` of repeated settings."""
        drawn = self._drawn(active, (count,), OperatorRandom.refill_setting_errors)
        return self._among_all(active, self._acuity_factors(active, sigma) * drawn)

    def redraw_misreadings(self, active: Indices, count: int) -> Array:
        """Return the misreadings ``(count, sessions)`` of repeated readings."""
        luck = self._drawn(active, (3, count), OperatorRandom.refill_reading_draws)
        return self._among_all(active, misreading(self.observer, luck, self._slip_factors(active)))

    def _drawn(self, active: Indices, shape: tuple[int, ...], draw: Callable[[OperatorRandom, Array], None]) -> Array:
        """Return random draws of the active sessions ``(*shape, m)``."""
        drawn = np.empty((active.size, *shape))
        for session, into in zip(active.tolist(), drawn, strict=True):
            draw(self._dice[session], into)
        return np.ascontiguousarray(np.moveaxis(drawn, 0, -1))

    def _among_all(self, active: Indices, values: Array) -> Array:
        if active.size == self.size:
            return values
        every = np.zeros((*values.shape[:-1], self.size))
        every[..., active] = values
        return every

    def _acuity_factors(self, active: Indices, sigma: float) -> Array:
        return np.asarray(sigma * acuity_factor(self.observer, take(self.seconds, active), self._since_rest(active)))

    def _slip_factors(self, active: Indices) -> Array:
        return slip_factor(self.observer, self._since_rest(active))

    # --- slips ----------------------------------------------------------------------------------------

    @property
    def may_mistake_points(self) -> bool:
        """Whether any operator may select another point than the intended one."""
        return self._slips.possible("wrong point")

    def select_point(self, active: Indices, point: str, near: Mapping[str, npt.NDArray[np.bool_]]) -> None:
        """Select a point, or by mistake a neighbour;

        `near` gives the sessions ``(m,)`` that find each neighbour on their prints.
        """
        self.recheck_points(active)
        if not self.may_mistake_points:
            return
        factors = self._slip_factors(active)
        for i, session in enumerate(active):
            candidates = [name for name, found in near.items() if found[i]]
            self._slips.select_point(self._occasion(session, point), candidates, factors[i])

    def recheck_points(self, active: Indices) -> None:
        """Check again which point is selected."""
        self._slips.recheck_points(active.tolist())

    def pointing_groups(self, active: Indices, point: str) -> Iterator[tuple[Indices, str]]:
        """Yield groups of sessions at a point by the point that they actually measure."""
        if self._slips.no_point_mistaken:
            yield active, point
            return
        names = np.array([self._slips.mistaken_point(int(session), point) for session in active], dtype=object)
        for name in dict.fromkeys(names.tolist()):
            yield active[names == name], name

    def view_points(self, active: Indices, point: str, look: Callable[[Indices, str], Array]) -> Array:
        """Return the values of `look` ``(..., m)`` at the points that the sessions at a point actually measure."""
        if self._slips.no_point_mistaken:
            return look(active, point)
        groups = [(them, look(them, name)) for them, name in self.pointing_groups(active, point)]
        if len(groups) <= 1:
            return groups[0][1] if groups else look(active, point)
        seen = np.zeros((*groups[0][1].shape[:-1], self.size))
        for them, each in groups:
            seen[..., them] = each
        return np.asarray(seen[..., active])

    def print_position(self, prints: Mapping[str, Array], point: str) -> Array:
        """Return the positions ``(2, sessions)`` on the prints of the measured points, nan where not pricked."""
        nowhere = np.full((2, self.size), np.nan)
        if self._slips.no_point_mistaken:
            return prints.get(point, nowhere)
        taken = [prints.get(self._slips.mistaken_point(session, point), nowhere) for session in range(self.size)]
        return np.stack([each[:, session] for session, each in enumerate(taken)], axis=-1)

    def transcribe(self, active: Indices, point: str, item: str, shown: Array, misread: Array) -> Array:
        """Return the written values ``(m,)`` of counter readings.

        `misread` ``(sessions,)`` are the random misreadings.
        """
        wrongly = take(misread, active)
        written = np.asarray(shown + wrongly).round(4)
        tempted = np.arange(active.size) if self._slips.possible(*OF_READINGS) else np.flatnonzero(wrongly)
        factors = self._slip_factors(active[tempted])
        for i, factor in zip(tempted.tolist(), factors, strict=True):
            occasion = self._occasion(active[i], point, item)
            written[i] = self._slips.transcribe(occasion, float(shown[i]), float(written[i]), factor)
        return written

    def fitting_positions(self, active: Indices, fitting: str, position: str) -> Iterator[tuple[Indices, str]]:
        """Yield sessions by the position in which they put a fitting:

        the required one, or the other if it is forgotten.
        """
        if not self._slips.possible("forgotten lever"):
            yield active, position
            return
        (other,) = set(POSITIONS_OF[fitting]) - {position}
        factors = self._slip_factors(active)
        forgotten = [
            self._slips.forgets_fitting(self._occasion(session, fitting, "fitting"), position, other, factor)
            for session, factor in zip(active, factors, strict=True)
        ]
        left = np.array(forgotten, dtype=bool)
        for them, put in ((active[~left], position), (active[left], other)):
            if them.size:
                yield them, put

    def noted_elements(
        self, active: Indices, now: Mapping[str, Array], before: Mapping[str, Array]
    ) -> Mapping[str, Array]:
        """Return the elements ``(sessions,)`` as noted: the previous value of an element that is not read again."""
        if not self._slips.possible("element not re-read"):
            return now
        noted = {name: each.copy() for name, each in now.items()}
        factors = self._slip_factors(active)
        for name, old in before.items():
            for session, factor in zip(active, factors, strict=True):
                occasion = self._occasion(session, name, "element")
                if self._slips.uses_stale_reading(occasion, float(old[session]), float(now[name][session]), factor):
                    noted[name][session] = old[session]
        return noted

    def _occasion(self, session: np.intp | int, point: str, item: str = "") -> SlipContext:
        time = float(self.seconds[session])
        return SlipContext(int(session), time, self._model, self._form, self._round, point, item)

    # --- time, book, patience -------------------------------------------------------------------------

    def spend(self, active: Indices, seconds: float, act: Act = "other") -> None:
        """Add the duration of an act: `seconds` at the usual pace."""
        self._let_go_by(active, seconds * self.observer.pace, act)

    def _let_go_by(self, active: Indices, seconds: float, act: Act) -> None:
        add_at(seconds, active, self.seconds)
        self.timesheet.add(active, seconds, self._form, act)
        if self.person is not None:
            self.person.clock.advance(seconds)

    def enter(self, active: Indices, point: str, item: str, readings: Array) -> npt.NDArray[np.intp]:
        """Add readings ``(m,)`` to the book and return the numbers ``(sessions,)`` of the entries."""
        numbers = np.zeros(self.size, dtype=np.intp)
        if self.person is not None:
            for session, reading in zip(active, readings, strict=True):
                numbers[session] = self.person.book.add(self.person.clock.now, point, item, f"{reading:.2f}")
                self._slips.note_entry(int(session), point, item, int(numbers[session]))
        return numbers

    def strike(self, active: Indices, numbers: npt.NDArray[np.intp], why: str) -> None:
        """Strike entries out; they stay, marked."""
        if self.person is not None:
            for session in active:
                self.person.book.strike_out(int(numbers[session]), why)

    def remark(self, active: Indices, text: str) -> None:
        """Write a remark into the book and the journal."""
        if self.person is not None and active.size:
            self.person.remark(text)

    def give_up(self, active: Indices, why: str | Callable[[int], str]) -> None:
        """Give up. Raises OperatorGaveUp for a single operator at a link."""
        for session in active:
            self.reasons[int(session)] = why if isinstance(why, str) else why(int(session))
            if self.person is not None:
                raise self.person.give_up(self.reasons[int(session)])
        self._given_up[active] = True
