"""Working the instruments of a crew: what a procedure asks of those who sit there.

The same code works one real link (`LineHands`) and a batch of instruments held as arrays. Arrays that go in and out
have all sessions as their last axis; `who` are the indices of those that act, and those who give up act no more.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array
from a7sim.operator.crew import Crew, Who
from a7sim.operator.eyes import Eyes
from a7sim.operator.floating_mark import Clearing, FloatingMark, Judgement
from a7sim.operator.hands import Hands
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.seat import Seat, side

MOST_POINTINGS = 12
AGREEMENT_MM = 0.01
"""Two pointings of a model point agree within this (thesis 3.5)."""

FAINTEST_SLIP_MM = 0.03
"""A reading of by that differs less than this from its fellows is not taken for a blunder."""

Numbers = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Parallaxes:
    """Y-parallaxes ``(n, sessions)`` in mm, left-hand minus right-hand, and the places ``(3, n, sessions)``.

    x is counted from the left-hand centre, y from the base line, z below the centres, all in mm. `apart` names the
    point whose images could not be brought together, where there was one; nothing else holds there.
    """

    p: Array
    places: Array
    apart: npt.NDArray[np.object_]


class Bench:
    """A crew at work."""

    def __init__(self, crew: Crew, hands: Hands, job: Job, tick: Callable[[], None] = lambda: None) -> None:
        self.crew = crew
        self.job = job
        self.hands = hands
        self.seat = Seat(crew, hands, job)
        self.eyes = Eyes(self.seat)
        self.mark = FloatingMark(self.eyes)
        self._tick = tick
        self._entries: dict[tuple[int, str, float], tuple[Numbers, Numbers]] = {}

    # --- setting up -----------------------------------------------------------------------------------

    def begin(self, who: Who, model: ModelJob, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Take up a model whose pictures are mounted; `prints` by hand (1 left, 2 right), places ``(2, sessions)``."""
        self.eyes.take_prints(prints)
        self._entries.clear()
        self.seat.begin(who, model)

    def preset(self, who: Who, point: str) -> None:
        """Point at a point in the left-hand photograph and make the counters show the plan's numbers there."""
        plan = self.job.plan
        self.seat.drive_z_to(who, np.full(who.size, -plan.projection_height))
        errors = self.crew.errors(who, self.crew.observer.monocular_um, (2,))
        self.eyes.bring_into_view(who, 1, point)
        self.eyes.bisect(self.crew.still(who), 1, point, errors)
        self.seat.preset(self.crew.still(who), plan.preset)

    def begin_round(self, who: Who, number: int) -> None:
        """Begin a round of a procedure: what is read now is entered under its number."""
        if self.crew.person is not None:
            book = self.crew.person.book
            book.round = number
            self.hands.note(who, f"{self.seat.model.name}: {book.form}, round {number}")

    def compute(self, who: Who) -> None:
        """Spend the time of one computation."""
        self.crew.spend(who, self.crew.observer.seconds_to_compute)

    # --- monocular pointing ---------------------------------------------------------------------------

    def point_with(self, who: Who, hand: int, points: Sequence[str], level: float) -> Array:
        """Point with the eye of photograph 1 (left-hand) or 2 at a Z reading; X, Y readings ``(2, n, sessions)``."""
        crew = self.crew
        errors = crew.errors(who, crew.observer.monocular_um, (2, len(points)))
        slips = crew.slips(who, (2, len(points)))
        self._drive_to_level(who, level)
        readings = np.zeros((2, len(points), crew.sessions))
        for i, point in enumerate(points):
            who = crew.still(who)
            self._point_once(who, hand, point, level, errors[:, i], slips[:, i], readings[:, i])
        return readings

    def point_again(self, who: Who, hand: int, point: str, level: float, why: str) -> Array:
        """Strike out a pointing and make it once more; X, Y ``(2, sessions)``."""
        crew = self.crew
        for numbers in self._entries[hand, point, level]:
            crew.strike(who, numbers, why)
        self._drive_to_level(who, level)
        errors = crew.errors_again(who, crew.observer.monocular_um, 2)
        slips = crew.slips_again(who, 2)
        readings = np.zeros((2, crew.sessions))
        self._point_once(who, hand, point, level, errors, slips, readings)
        return readings

    def _drive_to_level(self, who: Who, level: float) -> None:
        self.seat.drive(who, {"Z": np.full(who.size, level)})
        self.seat.see_that_it_obeyed(who, f"driving Z to {level:.2f}")

    def _point_once(
        self, who: Who, hand: int, point: str, level: float, errors: Array, slips: Array, readings: Array
    ) -> None:
        crew = self.crew
        self.eyes.bring_into_view(who, hand, point)
        self.eyes.bisect(crew.still(who), hand, point, errors)
        who = crew.still(who)
        numbers = []
        for axis, name in enumerate("XY"):
            readings[axis, who] = self._read(who, name, slips[axis])
        self.eyes.learn_straying(who, hand, point, readings[:, who])
        for axis, name in enumerate("XY"):
            numbers.append(crew.enter(who, point, f"{name} {side(hand)} at Z {level:.2f}", readings[axis, who]))
        self._entries[hand, point, level] = (numbers[0], numbers[1])
        self._tick()

    def _read(self, who: Who, axis: str, slips: Array) -> Array:
        """Read a counter ``(m,)``, with what is misread ``(sessions,)``."""
        self.crew.spend(who, self.crew.observer.seconds_to_read)
        return np.round(self.hands.counter(who, axis) + slips[who], 4)

    # --- y-parallaxes ---------------------------------------------------------------------------------

    def parallaxes(self, who: Who, points: Sequence[str], readings: int) -> Parallaxes:
        """Measure y-parallaxes with by' and by", so many readings of each."""
        crew, observer, n = self.crew, self.crew.observer, len(points)
        plan_errors = crew.errors(who, observer.stereo_um, (2, n))
        height_errors = crew.errors(who, observer.height_um, (n,))
        errors = crew.errors(who, observer.parallax_um, (n, 2, readings))
        slips = crew.slips(who, (n, 2, readings))
        rest = self._at_rest(who)
        p, places = np.zeros((n, crew.sessions)), np.zeros((3, n, crew.sessions))
        apart = np.full(crew.sessions, None, dtype=object)
        measuring = who
        for i, point in enumerate(points):
            judgement = Judgement(plan_errors[:, i], height_errors[i])
            fused = self.mark.fuse(measuring, point, judgement)
            readings_there = self.seat.counters(fused) if fused.size else np.zeros((3, 0))
            places[:, i, fused] = self.seat.place(fused, readings_there)
            self.eyes.learn_straying(fused, 1, point, readings_there) if fused.size else None
            cleared = self._parallax(fused, point, judgement, rest, errors[i], slips[i], p[i])
            lost = np.setdiff1d(crew.still(measuring), cleared)
            apart[lost] = point
            if lost.size:
                self._turn_back(lost, ("by1", "by2"), rest)
            measuring = cleared
            if not measuring.size:
                break
            self._tick()
        if measuring.size:
            self.seat.see_that_it_obeyed(measuring, f"{self.seat.model.name}: measuring y-parallaxes")
        return Parallaxes(p, places, apart)

    def _at_rest(self, who: Who) -> dict[str, Array]:
        rest = {name: np.zeros(self.crew.sessions) for name in ("by1", "by2")}
        for name, counts in self.seat.elements(who, ["by1", "by2"]).items():
            rest[name][who] = counts
        return rest

    def _turn_back(self, who: Who, names: Sequence[str], rest: Mapping[str, Array]) -> None:
        self.crew.spend(who, self.crew.observer.seconds_to_turn)
        for name in names:
            self.hands.set_element(who, name, rest[name][who])

    def _parallax(
        self,
        who: Who,
        point: str,
        judgement: Judgement,
        rest: Mapping[str, Array],
        errors: Array,
        slips: Array,
        into: Array,
    ) -> Who:
        """Clear the parallax of a point with by' and by"; put the mean readings ``(sessions,)`` into place."""
        crew = self.crew
        values = np.zeros((2, errors.shape[1], crew.sessions))
        numbers = np.zeros((2, errors.shape[1], crew.sessions), dtype=np.intp)
        for projector in (1, 2):
            for k in range(errors.shape[1]):
                who = self._clear_with_by(
                    who, projector, point, judgement, errors[projector - 1, k], slips[projector - 1, k], rest,
                    values[projector - 1, k], numbers[projector - 1, k],
                )  # fmt: skip
            if who.size:
                self._turn_back(who, (f"by{projector}",), rest)
        who = self._without_slips(who, point, judgement, rest, values, numbers)
        into[who] = values[:, :, who].mean(axis=1).mean(axis=0)
        return who

    def _clear_with_by(
        self,
        who: Who,
        projector: int,
        point: str,
        judgement: Judgement,
        errors: Array,
        slips: Array,
        rest: Mapping[str, Array],
        values: Array,
        numbers: Numbers,
    ) -> Who:
        if not who.size:
            return who
        by, sense = f"by{projector}", self._sense_of_by(projector)
        who = self.mark.settle(who, point, judgement, Clearing(by, np.full(self.crew.sessions, -sense), errors))
        if who.size:
            self.crew.spend(who, self.crew.observer.seconds_to_read)
            counts = np.round(self.hands.elements(who, [by])[by] + slips[who], 4)
            numbers[who] = self.crew.enter(who, point, by, counts)[who]
            values[who] = sense * (counts - rest[by][who])
        return who

    def _sense_of_by(self, projector: int) -> float:
        return 1.0 if self.seat.model.hand_of(projector) == 1 else -1.0

    def _without_slips(
        self, who: Who, point: str, judgement: Judgement, rest: Mapping[str, Array], values: Array, numbers: Numbers
    ) -> Who:
        """Strike out readings that their fellows contradict and make them again, in place."""
        crew, observer = self.crew, self.crew.observer
        tolerance = FAINTEST_SLIP_MM + 5e-3 * observer.parallax_um * self.seat.z / self.seat.c
        doubtful, lost = who, who[:0]
        for _ in range(MOST_POINTINGS):
            flat = values.reshape(-1, crew.sessions)[:, doubtful]
            deviations = np.abs(flat - np.median(flat, axis=0))
            worst = deviations.argmax(axis=0)
            off = deviations.max(axis=0) > tolerance[doubtful]
            doubtful, worst = doubtful[off], worst[off]
            if not doubtful.size:
                return np.setdiff1d(crew.still(who), lost)
            for place in np.unique(worst):
                again = doubtful[worst == place]
                projector, k = divmod(int(place), values.shape[1])
                by = f"by{projector + 1}"
                why = f"does not agree with the other readings of by' and by\" at {point}"
                crew.strike(again, numbers[projector, k], why)
                errors = crew.errors_again(again, observer.parallax_um, 1)[0]
                slips = crew.slips_again(again, 1)[0]
                found = self._clear_with_by(
                    again, projector + 1, point, judgement, errors, slips, rest,
                    values[projector, k], numbers[projector, k],
                )  # fmt: skip
                lost = np.concatenate([lost, np.setdiff1d(again, found)])
                if found.size:
                    self._turn_back(found, (by,), rest)
            doubtful = np.setdiff1d(doubtful, lost)
        crew.give_up(doubtful, f"{self.seat.model.name}: the readings of by' and by\" at {point} do not agree")
        return np.setdiff1d(crew.still(who), lost)

    # --- model coordinates ----------------------------------------------------------------------------

    def measure(self, who: Who, points: Sequence[str]) -> Array:
        """Measure model points stereoscopically, two pointings that agree; X, Y, Z readings ``(3, n, sessions)``.

        A point whose images cannot be fused is remarked upon and comes out as nan.
        """
        crew, observer, n = self.crew, self.crew.observer, len(points)
        at_point = crew.errors(who, 1.0, (3, n)) * np.sqrt(1.0 - observer.repeat_share**2)
        anew = crew.errors(who, 1.0, (3, n, 2)) * observer.repeat_share
        slips = crew.slips(who, (3, n, 2))
        measured = np.full((3, n, crew.sessions), np.nan)
        for i, point in enumerate(points):
            who = crew.still(who)
            self._measure(who, point, at_point[:, i], anew[:, i], slips[:, i], measured[:, i])
            self._tick()
        self.seat.see_that_it_obeyed(who, f"{self.seat.model.name}: measuring model coordinates")
        return measured

    def _measure(self, who: Who, point: str, at_point: Array, anew: Array, slips: Array, into: Array) -> None:
        """Put the mean of two pointings that agree into place, or else the median of all."""
        crew, observer = self.crew, self.crew.observer
        sigmas = np.array([observer.stereo_um, observer.stereo_um, observer.height_um])[:, None]
        pointings: list[Array] = []
        entries: list[Numbers] = []
        repeating = who
        while len(pointings) < MOST_POINTINGS and repeating.size:
            k = len(pointings)
            if k < 2:
                error, slip = anew[:, k], slips[:, k]
            else:
                self._strike(repeating, entries[-2])
                error = crew.errors_again(repeating, observer.repeat_share, 3)
                slip = crew.slips_again(repeating, 3)
            readings = np.full((3, crew.sessions), np.nan)
            found, numbers = self._pointing(repeating, point, sigmas * (at_point + error), slip, readings)
            apart = np.setdiff1d(crew.still(repeating), found)
            crew.remark(apart, f"point {point}: its two images cannot be fused, not measured")
            pointings.append(readings)
            entries.append(numbers)
            repeating = found
            if k:
                agreed = found[self._agree(pointings[-2][:, found], readings[:, found])]
                into[:, agreed] = (pointings[-2][:, agreed] + readings[:, agreed]) / 2.0
                repeating = np.setdiff1d(found, agreed)
        if repeating.size:
            into[:, repeating] = np.median([each[:, repeating] for each in pointings], axis=0)
        crew.remark(repeating, f"point {point}: no two of {MOST_POINTINGS} pointings agree, median taken")

    def _pointing(self, who: Who, point: str, error: Array, slips: Array, readings: Array) -> tuple[Who, Numbers]:
        crew = self.crew
        who = self.mark.fuse(who, point, Judgement(error[:2], error[2]))
        numbers = np.zeros((3, crew.sessions), dtype=np.intp)
        if who.size:
            for axis, name in enumerate("XYZ"):
                readings[axis, who] = self._read(who, name, slips[axis])
            self.hands.record(who, point)
            for axis, name in enumerate("XYZ"):
                numbers[axis] = crew.enter(who, point, name, readings[axis, who])
        return who, numbers

    def _agree(self, first: Array, second: Array) -> npt.NDArray[np.bool_]:
        difference = np.abs(first - second) / [[1.0], [1.0], [self.seat.units_per_mm]]
        return np.asarray((difference <= AGREEMENT_MM + 1e-9).all(axis=0))

    def _strike(self, who: Who, numbers: Numbers) -> None:
        for each in numbers:
            self.crew.strike(who, each, "two pointings differ by more than 0.01 mm")
