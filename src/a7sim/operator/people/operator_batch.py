"""Operators of a batch of sessions, one per session: their errors, their time and their entries."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, add_at, take
from a7sim.geometry import Array
from a7sim.operator.people.book_writer import BookWriter, NullBookWriter, PersonBookWriter
from a7sim.operator.people.fatigue import MINUTE, acuity_factor, needs_a_break, slip_factor
from a7sim.operator.people.person import Person
from a7sim.operator.people.random_draws import OperatorRandom, misreading
from a7sim.operator.people.slips import READING_SLIPS, SlipContext, Slips
from a7sim.operator.people.timesheet import Act
from a7sim.plotters import POSITIONS_OF
from a7sim.scenario import Observer


class AllGaveUpError(Exception):
    """All operators of a batch have given up."""


class OperatorBatch:
    """Operators of equal skill at their instruments. The last axis of arrays contains all sessions.

    The book writer of a single operator raises OperatorGaveUp if the operator gives up. The default writer keeps no
    book and does not raise: sessions that give up are no longer active, `remaining` returns the active ones, and
    `reasons` contains the reasons of the others.
    """

    def __init__(
        self, observer: Observer, generators: Sequence[OperatorRandom], book_writer: BookWriter | None = None
    ) -> None:
        self._book_writer = book_writer or NullBookWriter(len(generators))
        self.observer = observer
        self.seconds = np.zeros(len(generators))
        self.reasons: dict[int, str] = {}
        self.timesheet = self._book_writer.timesheet
        self.slip_log = self._book_writer.slip_log
        """True record of all slips, by session; no procedure reads it."""
        self._generators = generators
        self._given_up = np.zeros(len(generators), dtype=bool)
        self._slips = Slips(observer, generators, self.slip_log)
        self._rested_at = np.zeros(len(generators))
        self._model, self._form, self._round = "", "", 0

    @classmethod
    def single(cls, person: Person) -> "OperatorBatch":
        """Return the batch of one operator at a link."""
        return cls(person.observer, [person.random], PersonBookWriter(person))

    @property
    def size(self) -> int:
        """Number of sessions."""
        return len(self._generators)

    @property
    def form(self) -> str:
        """Name of the form in the current heading, empty before the first form."""
        return self._form

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
        self._book_writer.set_heading(model, form)

    def begin_round(self, active: Indices, number: int) -> None:
        """Start a round of the form, after a break if one is due."""
        self._rest(active)
        self._slips.recheck_points(active.tolist())
        self._round = number
        self._book_writer.begin_round(number)

    def _rest(self, active: Indices) -> None:
        tired = active[needs_a_break(self.observer, self._since_rest(active))]
        if tired.size:
            self._add_time(tired, MINUTE * self.observer.break_minutes, "resting")
            self._rested_at[tired] = self.seconds[tired]

    def _since_rest(self, active: Indices) -> Array:
        return np.asarray(take(self.seconds, active) - take(self._rested_at, active))

    # --- random errors --------------------------------------------------------------------------------

    def draw_setting_errors(self, active: Indices, sigma: float, shape: tuple[int, ...]) -> Array:
        """Return the errors of planned settings ``(*shape, sessions)``, zero for inactive sessions."""
        return self._expand_to_batch(
            active, self._acuity_factors(active, sigma) * self._draw(active, shape, OperatorRandom.fill_setting_errors)
        )

    def draw_misreadings(self, active: Indices, shape: tuple[int, ...]) -> Array:
        """Return the misreadings of planned readings ``(*shape, sessions)``, in counter units."""
        draws = self._draw(active, (3, *shape), OperatorRandom.fill_reading_draws)
        return self._expand_to_batch(active, misreading(self.observer, draws, self._slip_factors(active)))

    def redraw_setting_errors(self, active: Indices, sigma: float, count: int) -> Array:
        """Return the errors ``(count, sessions)`` of repeated settings."""
        draws = self._draw(active, (count,), OperatorRandom.refill_setting_errors)
        return self._expand_to_batch(active, self._acuity_factors(active, sigma) * draws)

    def redraw_misreadings(self, active: Indices, count: int) -> Array:
        """Return the misreadings ``(count, sessions)`` of repeated readings."""
        draws = self._draw(active, (3, count), OperatorRandom.refill_reading_draws)
        return self._expand_to_batch(active, misreading(self.observer, draws, self._slip_factors(active)))

    def _draw(self, active: Indices, shape: tuple[int, ...], fill: Callable[[OperatorRandom, Array], None]) -> Array:
        """Return random draws of the active sessions ``(*shape, m)``."""
        draws = np.empty((active.size, *shape))
        for session, out in zip(active.tolist(), draws, strict=True):
            fill(self._generators[session], out)
        return np.ascontiguousarray(np.moveaxis(draws, 0, -1))

    def _expand_to_batch(self, active: Indices, values: Array) -> Array:
        if active.size == self.size:
            return values
        expanded = np.zeros((*values.shape[:-1], self.size))
        expanded[..., active] = values
        return expanded

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
        """Select a point, or by mistake a neighbour.

        `near` contains, by neighbour, which sessions ``(m,)`` find it on their prints.
        """
        self.recheck_points(active)
        if not self.may_mistake_points:
            return
        factors = self._slip_factors(active)
        for i, session in enumerate(active):
            candidates = [name for name, is_found in near.items() if is_found[i]]
            self._slips.select_point(self._context(session, point), candidates, factors[i])

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
        groups = [(sessions, look(sessions, name)) for sessions, name in self.pointing_groups(active, point)]
        if len(groups) <= 1:
            return groups[0][1] if groups else look(active, point)
        views = np.zeros((*groups[0][1].shape[:-1], self.size))
        for sessions, values in groups:
            views[..., sessions] = values
        return np.asarray(views[..., active])

    def print_position(self, prints: Mapping[str, Array], point: str) -> Array:
        """Return the positions ``(2, sessions)`` on the prints of the measured points, nan where not pricked."""
        missing = np.full((2, self.size), np.nan)
        if self._slips.no_point_mistaken:
            return prints.get(point, missing)
        positions = [prints.get(self._slips.mistaken_point(session, point), missing) for session in range(self.size)]
        return np.stack([position[:, session] for session, position in enumerate(positions)], axis=-1)

    def transcribe(self, active: Indices, point: str, item: str, shown: Array, misreadings: Array) -> Array:
        """Return the written values ``(m,)`` of counter readings.

        `misread` ``(sessions,)`` are the random misreadings.
        """
        errors = take(misreadings, active)
        written = np.asarray(shown + errors).round(4)
        candidates = np.arange(active.size) if self._slips.possible(*READING_SLIPS) else np.flatnonzero(errors)
        factors = self._slip_factors(active[candidates])
        for i, factor in zip(candidates.tolist(), factors, strict=True):
            context = self._context(active[i], point, item)
            written[i] = self._slips.transcribe(context, float(shown[i]), float(written[i]), factor)
        return written

    def fitting_positions(self, active: Indices, fitting: str, position: str) -> Iterator[tuple[Indices, str]]:
        """Yield groups of sessions by the position in which they put a fitting.

        It is the required position, or the other one if the fitting is forgotten.
        """
        if not self._slips.possible("forgotten lever"):
            yield active, position
            return
        (other,) = set(POSITIONS_OF[fitting]) - {position}
        factors = self._slip_factors(active)
        forgotten = [
            self._slips.forgets_fitting(self._context(session, fitting, "fitting"), position, other, factor)
            for session, factor in zip(active, factors, strict=True)
        ]
        is_forgotten = np.array(forgotten, dtype=bool)
        for sessions, actual in ((active[~is_forgotten], position), (active[is_forgotten], other)):
            if sessions.size:
                yield sessions, actual

    def noted_elements(
        self, active: Indices, current: Mapping[str, Array], previous: Mapping[str, Array]
    ) -> Mapping[str, Array]:
        """Return the elements ``(sessions,)`` as noted: the previous value of an element that is not read again."""
        if not self._slips.possible("element not re-read"):
            return current
        noted = {name: values.copy() for name, values in current.items()}
        factors = self._slip_factors(active)
        for name, old in previous.items():
            for session, factor in zip(active, factors, strict=True):
                context = self._context(session, name, "element")
                if self._slips.uses_stale_reading(context, float(old[session]), float(current[name][session]), factor):
                    noted[name][session] = old[session]
        return noted

    def _context(self, session: np.intp | int, point: str, item: str = "") -> SlipContext:
        time = float(self.seconds[session])
        return SlipContext(int(session), time, self._model, self._form, self._round, point, item)

    # --- time and book --------------------------------------------------------------------------------

    def spend(self, active: Indices, seconds: float, act: Act = "other") -> None:
        """Add the duration of an act: `seconds` at the usual pace."""
        self._add_time(active, seconds * self.observer.pace, act)

    def _add_time(self, active: Indices, seconds: float, act: Act) -> None:
        add_at(seconds, active, self.seconds)
        self.timesheet.add(active, seconds, self._form, act)
        self._book_writer.advance_clock(seconds)

    def enter(self, active: Indices, point: str, item: str, readings: Array) -> npt.NDArray[np.intp]:
        """Add readings ``(m,)`` to the book and return the entry numbers ``(sessions,)``, zero without a book."""
        numbers = self._book_writer.enter(active, point, item, readings)
        for session in np.flatnonzero(numbers).tolist():
            self._slips.note_entry(session, point, item, int(numbers[session]))
        return numbers

    def strike(self, active: Indices, numbers: npt.NDArray[np.intp], reason: str) -> None:
        """Strike entries out; they stay, marked."""
        self._book_writer.strike_out(active, numbers, reason)

    def remark(self, active: Indices, text: str) -> None:
        """Write a remark into the book and the journal."""
        self._book_writer.remark(active, text)

    def give_up(self, active: Indices, reason: str | Callable[[int], str]) -> None:
        """Give up. Raises OperatorGaveUp for a single operator at a link."""
        for session in active:
            self.reasons[int(session)] = reason if isinstance(reason, str) else reason(int(session))
            self._book_writer.give_up(self.reasons[int(session)])
        self._given_up[active] = True
