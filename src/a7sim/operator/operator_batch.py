"""The people at a batch of instruments, one a session: what they get wrong, how long they take, what they write."""

from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, add_at, take
from a7sim.geometry import Array
from a7sim.operator.fatigue import MINUTE, acuity_factor, needs_a_break, slip_factor
from a7sim.operator.person import Person
from a7sim.operator.random_draws import OperatorRandom, misreading
from a7sim.operator.slips import OF_READINGS, SlipContext, Slips
from a7sim.operator.timesheet import Act, Timesheet
from a7sim.plotters import POSITIONS_OF
from a7sim.scenario import Observer


class AllGaveUpError(Exception):
    """All of a crew have given up."""


class OperatorBatch:
    """Persons of equal skill at their instruments. Arrays have the sessions, all of them, as their last axis.

    A single person at a line writes a book and gives up by raising DoesNotFit; in a crowd whoever gives up is left
    behind: `still` tells who goes on, `reasons` why others do not.
    """

    def __init__(self, observer: Observer, dice: Sequence[OperatorRandom], person: Person | None = None) -> None:
        self.observer = observer
        self.person = person
        self.seconds = np.zeros(len(dice))
        self.reasons: dict[int, str] = {}
        self.timesheet = person.timesheet if person is not None else Timesheet(len(dice))
        self.slip_log = [person.slips] if person is not None else [[] for _ in dice]
        """The truth about every slip, by session; no procedure looks at it."""
        self._dice = dice
        self._given_up = np.zeros(len(dice), dtype=bool)
        self._slips = Slips(observer, dice, self.slip_log)
        self._rested_at = np.zeros(len(dice))
        self._model, self._form, self._round = "", "", 0

    @classmethod
    def single(cls, person: Person) -> "OperatorBatch":
        """Return the crew that is one person at a line."""
        return cls(person.observer, [person.dice], person)

    @property
    def size(self) -> int:
        """How many they are."""
        return len(self._dice)

    @property
    def active(self) -> Indices:
        """Indices of all sessions that go on."""
        return np.flatnonzero(~self._given_up)

    def is_active(self, who: Indices) -> npt.NDArray[np.bool_]:
        """Return which have not given up."""
        return np.asarray(~self._given_up[who])

    def remaining(self, who: Indices) -> Indices:
        """Return those who have not given up."""
        return who[~self._given_up[who]]

    # --- headings -------------------------------------------------------------------------------------

    def begin(self, who: Indices, model: str, form: str) -> None:
        """Begin a form of a model, after a break where one is due."""
        self._rest(who)
        self._slips.recheck_points(who.tolist())
        self._model, self._form, self._round = model, form, 0
        if self.person is not None:
            self.person.book.set_heading(model, form)

    def begin_round(self, who: Indices, number: int) -> None:
        """Begin a round of the form, after a break where one is due."""
        self._rest(who)
        self._slips.recheck_points(who.tolist())
        self._round = number
        if self.person is not None:
            self.person.book.round = number

    def _rest(self, who: Indices) -> None:
        tired = who[needs_a_break(self.observer, self._since_rest(who))]
        if tired.size:
            self._let_go_by(tired, MINUTE * self.observer.break_minutes, "resting")
            self._rested_at[tired] = self.seconds[tired]

    def _since_rest(self, who: Indices) -> Array:
        return np.asarray(take(self.seconds, who) - take(self._rested_at, who))

    # --- chance ---------------------------------------------------------------------------------------

    def draw_setting_errors(self, who: Indices, sigma: float, shape: tuple[int, ...]) -> Array:
        """Return the errors of planned settings ``(*shape, sessions)``, zero for those who do not act."""
        return self._among_all(
            who, self._acuity_factors(who, sigma) * self._drawn(who, shape, OperatorRandom.fill_setting_errors)
        )

    def draw_misreadings(self, who: Indices, shape: tuple[int, ...]) -> Array:
        """Return what is misread at planned readings ``(*shape, sessions)``, in counter units."""
        luck = self._drawn(who, (3, *shape), OperatorRandom.fill_reading_draws)
        return self._among_all(who, misreading(self.observer, luck, self._slip_factors(who)))

    def redraw_setting_errors(self, who: Indices, sigma: float, count: int) -> Array:
        """Return the errors ``(count, sessions)`` of settings made once more."""
        drawn = self._drawn(who, (count,), OperatorRandom.refill_setting_errors)
        return self._among_all(who, self._acuity_factors(who, sigma) * drawn)

    def redraw_misreadings(self, who: Indices, count: int) -> Array:
        """Return what is misread ``(count, sessions)`` at readings made once more."""
        luck = self._drawn(who, (3, count), OperatorRandom.refill_reading_draws)
        return self._among_all(who, misreading(self.observer, luck, self._slip_factors(who)))

    def _drawn(self, who: Indices, shape: tuple[int, ...], draw: Callable[[OperatorRandom, Array], None]) -> Array:
        """Return what the dice of those who act draw ``(*shape, m)``."""
        drawn = np.empty((who.size, *shape))
        for session, into in zip(who.tolist(), drawn, strict=True):
            draw(self._dice[session], into)
        return np.ascontiguousarray(np.moveaxis(drawn, 0, -1))

    def _among_all(self, who: Indices, values: Array) -> Array:
        if who.size == self.size:
            return values
        every = np.zeros((*values.shape[:-1], self.size))
        every[..., who] = values
        return every

    def _acuity_factors(self, who: Indices, sigma: float) -> Array:
        return np.asarray(sigma * acuity_factor(self.observer, take(self.seconds, who), self._since_rest(who)))

    def _slip_factors(self, who: Indices) -> Array:
        return slip_factor(self.observer, self._since_rest(who))

    # --- slips ----------------------------------------------------------------------------------------

    @property
    def may_mistake_points(self) -> bool:
        """Whether anybody may go to another point than the one that is meant."""
        return self._slips.possible("wrong point")

    def select_point(self, who: Indices, point: str, near: Mapping[str, npt.NDArray[np.bool_]]) -> None:
        """Go to a point, or by mistake to one near it; who can find which of these ``(m,)`` on their prints."""
        self.recheck_points(who)
        if not self.may_mistake_points:
            return
        factors = self._slip_factors(who)
        for i, session in enumerate(who):
            candidates = [name for name, found in near.items() if found[i]]
            self._slips.select_point(self._occasion(session, point), candidates, factors[i])

    def recheck_points(self, who: Indices) -> None:
        """Look once more which point it is."""
        self._slips.recheck_points(who.tolist())

    def pointing_groups(self, who: Indices, point: str) -> Iterator[tuple[Indices, str]]:
        """Yield who of those at a point really looks at which, as groups."""
        if self._slips.no_point_mistaken:
            yield who, point
            return
        names = np.array([self._slips.mistaken_point(int(session), point) for session in who], dtype=object)
        for name in dict.fromkeys(names.tolist()):
            yield who[names == name], name

    def view_points(self, who: Indices, point: str, look: Callable[[Indices, str], Array]) -> Array:
        """Return what `look` gives ``(..., m)`` of the points that those at a point really look at."""
        if self._slips.no_point_mistaken:
            return look(who, point)
        groups = [(them, look(them, name)) for them, name in self.pointing_groups(who, point)]
        if len(groups) <= 1:
            return groups[0][1] if groups else look(who, point)
        seen = np.zeros((*groups[0][1].shape[:-1], self.size))
        for them, each in groups:
            seen[..., them] = each
        return np.asarray(seen[..., who])

    def print_position(self, prints: Mapping[str, Array], point: str) -> Array:
        """Return the place ``(2, sessions)`` on the prints of what everybody takes for a point, nan where it is not."""
        nowhere = np.full((2, self.size), np.nan)
        if self._slips.no_point_mistaken:
            return prints.get(point, nowhere)
        taken = [prints.get(self._slips.mistaken_point(session, point), nowhere) for session in range(self.size)]
        return np.stack([each[:, session] for session, each in enumerate(taken)], axis=-1)

    def transcribe(self, who: Indices, point: str, item: str, shown: Array, misread: Array) -> Array:
        """Return what is written ``(m,)`` of what counters show; `misread` ``(sessions,)`` is what chance adds."""
        wrongly = take(misread, who)
        written = np.asarray(shown + wrongly).round(4)
        tempted = np.arange(who.size) if self._slips.possible(*OF_READINGS) else np.flatnonzero(wrongly)
        factors = self._slip_factors(who[tempted])
        for i, factor in zip(tempted.tolist(), factors, strict=True):
            occasion = self._occasion(who[i], point, item)
            written[i] = self._slips.transcribe(occasion, float(shown[i]), float(written[i]), factor)
        return written

    def fitting_positions(self, who: Indices, fitting: str, position: str) -> Iterator[tuple[Indices, str]]:
        """Yield who puts a fitting into which position: the right one, but where it is forgotten the other."""
        if not self._slips.possible("forgotten lever"):
            yield who, position
            return
        (other,) = set(POSITIONS_OF[fitting]) - {position}
        factors = self._slip_factors(who)
        forgotten = [
            self._slips.forgets_fitting(self._occasion(session, fitting, "fitting"), position, other, factor)
            for session, factor in zip(who, factors, strict=True)
        ]
        left = np.array(forgotten, dtype=bool)
        for them, put in ((who[~left], position), (who[left], other)):
            if them.size:
                yield them, put

    def noted_elements(
        self, who: Indices, now: Mapping[str, Array], before: Mapping[str, Array]
    ) -> Mapping[str, Array]:
        """Return the elements ``(sessions,)`` as they are noted: where one is not re-read, what it was before."""
        if not self._slips.possible("element not re-read"):
            return now
        noted = {name: each.copy() for name, each in now.items()}
        factors = self._slip_factors(who)
        for name, old in before.items():
            for session, factor in zip(who, factors, strict=True):
                occasion = self._occasion(session, name, "element")
                if self._slips.uses_stale_reading(occasion, float(old[session]), float(now[name][session]), factor):
                    noted[name][session] = old[session]
        return noted

    def _occasion(self, session: np.intp | int, point: str, item: str = "") -> SlipContext:
        time = float(self.seconds[session])
        return SlipContext(int(session), time, self._model, self._form, self._round, point, item)

    # --- time, book, patience -------------------------------------------------------------------------

    def spend(self, who: Indices, seconds: float, act: Act = "other") -> None:
        """Let the time of an act go by, so many seconds at an ordinary pace."""
        self._let_go_by(who, seconds * self.observer.pace, act)

    def _let_go_by(self, who: Indices, seconds: float, act: Act) -> None:
        add_at(seconds, who, self.seconds)
        self.timesheet.add(who, seconds, self._form, act)
        if self.person is not None:
            self.person.clock.advance(seconds)

    def enter(self, who: Indices, point: str, item: str, readings: Array) -> npt.NDArray[np.intp]:
        """Enter readings ``(m,)`` in the book and return the numbers ``(sessions,)`` of the entries."""
        numbers = np.zeros(self.size, dtype=np.intp)
        if self.person is not None:
            for session, reading in zip(who, readings, strict=True):
                numbers[session] = self.person.book.add(self.person.clock.now, point, item, f"{reading:.2f}")
                self._slips.note_entry(int(session), point, item, int(numbers[session]))
        return numbers

    def strike(self, who: Indices, numbers: npt.NDArray[np.intp], why: str) -> None:
        """Strike entries out; they stay, marked."""
        if self.person is not None:
            for session in who:
                self.person.book.strike_out(int(numbers[session]), why)

    def remark(self, who: Indices, text: str) -> None:
        """Write a remark into the book and the journal."""
        if self.person is not None and who.size:
            self.person.remark(text)

    def give_up(self, who: Indices, why: str | Callable[[int], str]) -> None:
        """Give up. Raises DoesNotFit for a person at a line."""
        for session in who:
            self.reasons[int(session)] = why if isinstance(why, str) else why(int(session))
            if self.person is not None:
                raise self.person.give_up(self.reasons[int(session)])
        self._given_up[who] = True
