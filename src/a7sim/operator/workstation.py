"""Working the instruments of a crew: what a procedure asks of those who sit there.

The same code works one real link (`LineHands`) and a batch of instruments held as arrays. Arrays that go in and out
have all sessions as their last axis; `who` are the indices of those that act, and those who give up act no more.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, exclude
from a7sim.geometry import Array
from a7sim.operator.controls import Controls, side_name, wrap_gon
from a7sim.operator.driver import BoolArray, InstrumentDriver
from a7sim.operator.floating_mark import Clearing, FloatingMark, SettingErrors
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.operator_batch import OperatorBatch
from a7sim.operator.pointing import Pointing
from a7sim.operator.slips import neighbours

MAX_POINTINGS = 12
AGREEMENT_MM = 0.01
"""Two pointings of a model point agree within this (thesis 3.5)."""

MIN_SLIP_MM = 0.03
"""A reading of by that differs less than this from its fellows is not taken for a blunder."""

Numbers = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Parallaxes:
    """Y-parallaxes ``(n, sessions)`` in mm, left-hand minus right-hand, and the places ``(3, n, sessions)``.

    x is counted from the left-hand centre, y from the base line, z below the centres, all in mm. `apart` names the
    point whose images could not be brought together, where there was one; nothing else holds there.
    """

    parallax_mm: Array
    places: Array
    disagreement: npt.NDArray[np.object_]

    def disagrees(self, who: Indices) -> Indices:
        """Return those for whom the images of a point could not be brought together."""
        parted = np.array([self.disagreement[session] is not None for session in who], dtype=bool)
        return np.asarray(who[parted])


@dataclass(frozen=True)
class ClearedPoint:
    """What clearing a y-parallax with an element came to; arrays ``(sessions,)``, zero for those not in `who`."""

    sessions: Indices
    """Those who found it clear, or cleared it."""
    disagreement: Indices
    """Those to whom the two images did not come together."""
    arrival_parallax_mm: Array
    """The y-parallax in mm as it seemed on arriving."""
    model_position_mm: Array
    """Where ``(3, sessions)``: x from the left-hand centre, y from the base line, z below the centres, mm."""
    element_change: Array
    """The turn that cleared the point, gon or mm, as it is written down."""


class Workstation:
    """A crew at work."""

    def __init__(
        self, crew: OperatorBatch, hands: InstrumentDriver, job: Job, tick: Callable[[], None] = lambda: None
    ) -> None:
        self.crew = crew
        self.job = job
        self.hands = hands
        self.seat = Controls(crew, hands, job)
        self.eyes = Pointing(self.seat)
        self.mark = FloatingMark(self.eyes)
        self._tick = tick
        self._prints: Mapping[int, Mapping[str, Array]] = {}
        self._entries: dict[tuple[int, str, float], tuple[Numbers, Numbers]] = {}

    # --- setting up -----------------------------------------------------------------------------------

    def begin(self, who: Indices, model: ModelJob, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Take up a model whose pictures are mounted; `prints` by hand (1 left, 2 right), places ``(2, sessions)``."""
        self.eyes.set_prints(prints)
        self._prints = prints
        self._entries.clear()
        self.seat.begin(who, model)

    def preset(self, who: Indices, point: str) -> None:
        """Point at a point in the left-hand photograph and make the counters show the plan's numbers there."""
        plan = self.job.plan
        self.seat.drive_z_to(who, np.full(who.size, -plan.projection_height))
        errors = self.crew.draw_setting_errors(who, self.crew.observer.monocular_um, (2,))
        self.eyes.bring_into_view(who, 1, point)
        self.eyes.bisect(self.crew.remaining(who), 1, point, errors)
        self.seat.preset(self.crew.remaining(who), plan.preset)

    def begin_round(self, who: Indices, number: int) -> None:
        """Begin a round of a procedure: what is read now is entered under its number."""
        self.crew.begin_round(who, number)
        if self.crew.person is not None:
            self.hands.note(who, f"{self.seat.model.name}: {self.crew.person.book.form}, round {number}")

    def compute(self, who: Indices) -> None:
        """Spend the time of one computation."""
        self.crew.spend(who, self.crew.observer.seconds_to_compute, "computing")

    def has_point(self, who: Indices, point: str, hands: Sequence[int] = (1, 2)) -> BoolArray:
        """Return which of those who act find a point pricked on both prints, or on that of one photograph."""
        prints = [self._prints[hand].get(point) for hand in hands]
        if any(each is None for each in prints):
            return np.zeros(who.size, dtype=bool)
        return np.asarray(~np.isnan([each[0, who] for each in prints if each is not None]).any(axis=0))

    def group_by_points(
        self, who: Indices, points: Sequence[str], hands: Sequence[int] = (1, 2)
    ) -> Iterator[tuple[Indices, list[str]]]:
        """Yield those who find the same of some points pricked, on the prints of these photographs, and what they find.

        Everybody who acts comes once, the list in the order of `points` and perhaps empty.
        """
        if not points:
            yield who, []
            return
        shown = np.array([self.has_point(who, point, hands) for point in points])
        for pattern in np.unique(shown, axis=1).T:
            them = who[(shown == pattern[:, None]).all(axis=0)]
            yield them, [point for point, there in zip(points, pattern, strict=True) if there]

    def _come_to(self, who: Indices, point: str) -> None:
        """Go to a point, or by mistake to a standard point near it."""
        near = neighbours(self.seat.model.standard_points, point) if self.crew.may_mistake_points else []
        self.crew.select_point(who, point, {name: self.has_point(who, name) for name in near})

    # --- monocular pointing ---------------------------------------------------------------------------

    def point_monocularly(self, who: Indices, hand: int, points: Sequence[str], level: float) -> Array:
        """Point with the eye of photograph 1 (left-hand) or 2 at a Z reading; X, Y readings ``(2, n, sessions)``."""
        crew = self.crew
        errors = crew.draw_setting_errors(who, crew.observer.monocular_um, (2, len(points)))
        slips = crew.draw_misreadings(who, (2, len(points)))
        self._drive_to_level(who, level)
        readings = np.zeros((2, len(points), crew.size))
        for i, point in enumerate(points):
            who = crew.remaining(who)
            self._come_to(who, point)
            self._point_once(who, hand, point, level, errors[:, i], slips[:, i], readings[:, i])
        return readings

    def repeat_pointing(self, who: Indices, hand: int, point: str, level: float, why: str) -> Array:
        """Strike out a pointing and make it once more; X, Y ``(2, sessions)``."""
        crew = self.crew
        for numbers in self._entries[hand, point, level]:
            crew.strike(who, numbers, why)
        crew.recheck_points(who)
        self._drive_to_level(who, level)
        errors = crew.redraw_setting_errors(who, crew.observer.monocular_um, 2)
        slips = crew.redraw_misreadings(who, 2)
        readings = np.zeros((2, crew.size))
        self._point_once(who, hand, point, level, errors, slips, readings)
        return readings

    def _drive_to_level(self, who: Indices, level: float) -> None:
        self.seat.drive(who, {"Z": np.full(who.size, level)})
        self.seat.give_up_on_errors(who, f"driving Z to {level:.2f}")

    def _point_once(
        self, who: Indices, hand: int, point: str, level: float, errors: Array, slips: Array, readings: Array
    ) -> None:
        crew = self.crew
        self.eyes.bring_into_view(who, hand, point)
        self.eyes.bisect(crew.remaining(who), hand, point, errors)
        who = crew.remaining(who)
        items = [f"{name} {side_name(hand)} at Z {level:.2f}" for name in "XY"]
        for axis, item in enumerate(items):
            readings[axis, who] = self._read(who, point, item, slips[axis])
        self.eyes.measure_drift(who, hand, point, readings[:, who])
        numbers = [crew.enter(who, point, item, readings[axis, who]) for axis, item in enumerate(items)]
        self._entries[hand, point, level] = (numbers[0], numbers[1])
        self._tick()

    def _read(self, who: Indices, point: str, item: str, slips: Array) -> Array:
        """Read the counter ``(m,)`` that an item begins with, with what is misread ``(sessions,)``."""
        self.crew.spend(who, self.crew.observer.seconds_to_read, "reading")
        return self.crew.transcribe(who, point, item, self.hands.counter(who, item[0]), slips)

    # --- y-parallaxes ---------------------------------------------------------------------------------

    def parallaxes(
        self, who: Indices, points: Sequence[str], readings: int, projectors: Sequence[int] = (1, 2)
    ) -> Parallaxes:
        """Measure y-parallaxes with by' or by" or both, so many readings of each."""
        crew, observer, n = self.crew, self.crew.observer, len(points)
        plan_errors = crew.draw_setting_errors(who, observer.stereo_um, (2, n))
        height_errors = crew.draw_setting_errors(who, observer.height_um, (n,))
        errors = crew.draw_setting_errors(who, observer.parallax_um, (n, len(projectors), readings))
        slips = crew.draw_misreadings(who, (n, len(projectors), readings))
        rest = self._at_rest(who)
        p, places = np.zeros((n, crew.size)), np.zeros((3, n, crew.size))
        apart = np.full(crew.size, None, dtype=object)
        measuring = who
        for i, point in enumerate(points):
            self._come_to(measuring, point)
            judgement = SettingErrors(plan_errors[:, i], height_errors[i])
            fused = self.mark.fuse(measuring, point, judgement)
            readings_there = self.seat.counters(fused) if fused.size else np.zeros((3, 0))
            places[:, i, fused] = self.seat.model_position(fused, readings_there)
            self.eyes.measure_drift(fused, 1, point, readings_there) if fused.size else None
            cleared = self._parallax(fused, point, judgement, projectors, rest, errors[i], slips[i], p[i])
            lost = exclude(crew.remaining(measuring), cleared)
            apart[lost] = point
            if lost.size:
                self._turn_back(lost, ("by1", "by2"), rest)
            measuring = cleared
            if not measuring.size:
                break
            self._tick()
        if measuring.size:
            self.seat.give_up_on_errors(measuring, f"{self.seat.model.name}: measuring y-parallaxes")
        return Parallaxes(p, places, apart)

    def _at_rest(self, who: Indices) -> dict[str, Array]:
        rest = {name: np.zeros(self.crew.size) for name in ("by1", "by2")}
        for name, counts in self.seat.elements(who, ["by1", "by2"]).items():
            rest[name][who] = counts
        return rest

    def _turn_back(self, who: Indices, names: Sequence[str], rest: Mapping[str, Array]) -> None:
        self.crew.spend(who, self.crew.observer.seconds_to_turn, "turning")
        for name in names:
            self.seat.run_element(who, name, rest[name][who])

    def _parallax(
        self,
        who: Indices,
        point: str,
        judgement: SettingErrors,
        projectors: Sequence[int],
        rest: Mapping[str, Array],
        errors: Array,
        slips: Array,
        into: Array,
    ) -> Indices:
        """Clear the parallax of a point with by of projectors; put the mean readings ``(sessions,)`` into place."""
        values = np.zeros(errors.shape)
        numbers = np.zeros(errors.shape, dtype=np.intp)
        for i, projector in enumerate(projectors):
            for k in range(errors.shape[1]):
                who = self._clear_with_by(
                    who, projector, point, judgement, errors[i, k], slips[i, k], rest, values[i, k], numbers[i, k]
                )
            if who.size:
                self._turn_back(who, (f"by{projector}",), rest)
        who = self._without_slips(who, point, judgement, projectors, rest, values, numbers)
        into[who] = values[:, :, who].mean(axis=1).mean(axis=0)
        return who

    def _clear_with_by(
        self,
        who: Indices,
        projector: int,
        point: str,
        judgement: SettingErrors,
        errors: Array,
        slips: Array,
        rest: Mapping[str, Array],
        values: Array,
        numbers: Numbers,
    ) -> Indices:
        if not who.size:
            return who
        by, sense = f"by{projector}", self._sense_of_by(projector)
        who = self.mark.settle(who, point, judgement, Clearing(by, np.full(self.crew.size, -sense), errors))
        if who.size:
            self.crew.spend(who, self.crew.observer.seconds_to_read, "reading")
            counts = self.crew.transcribe(who, point, by, self.hands.elements(who, [by])[by], slips)
            numbers[who] = self.crew.enter(who, point, by, counts)[who]
            values[who] = sense * (counts - rest[by][who])
        return who

    def _sense_of_by(self, projector: int) -> float:
        return 1.0 if self.seat.model.side_of(projector) == 1 else -1.0

    def _without_slips(
        self,
        who: Indices,
        point: str,
        judgement: SettingErrors,
        projectors: Sequence[int],
        rest: Mapping[str, Array],
        values: Array,
        numbers: Numbers,
    ) -> Indices:
        """Strike out readings that their fellows contradict and make them again, in place.

        Of two that contradict each other nobody knows which is wrong: they are made again in turn.
        """
        crew, observer = self.crew, self.crew.observer
        tolerance = MIN_SLIP_MM + 5e-3 * observer.parallax_um * self.seat.z / self.seat.c
        doubtful, lost = who, who[:0]
        readings = values.shape[1]
        bys = " and ".join("by'" if projector == 1 else 'by"' for projector in projectors)
        for number in range(MAX_POINTINGS):
            flat = values.reshape(-1, crew.size)[:, doubtful]
            deviations = np.abs(flat - np.median(flat, axis=0))
            worst = deviations.argmax(axis=0) if len(flat) > 2 else np.full(doubtful.size, number % len(flat))
            off = deviations.max(axis=0) > tolerance[doubtful]
            doubtful, worst = doubtful[off], worst[off]
            if not doubtful.size:
                return exclude(crew.remaining(who), lost)
            for i in np.unique(worst // readings):
                of_this = worst // readings == i
                again, k = doubtful[of_this], np.zeros(crew.size, dtype=np.intp)
                k[again] = worst[of_this] % readings
                value, entry = (np.take_along_axis(each[i], k[None], axis=0)[0] for each in (values, numbers))
                by = f"by{projectors[i]}"
                crew.strike(again, entry, f"does not agree with the other readings of {bys} at {point}")
                errors = crew.redraw_setting_errors(again, observer.parallax_um, 1)[0]
                slips = crew.redraw_misreadings(again, 1)[0]
                found = self._clear_with_by(again, projectors[i], point, judgement, errors, slips, rest, value, entry)
                values[i, k[found], found], numbers[i, k[found], found] = value[found], entry[found]
                lost = np.concatenate([lost, exclude(again, found)])
                if found.size:
                    self._turn_back(found, (by,), rest)
            doubtful = exclude(doubtful, lost)
        crew.give_up(doubtful, f"{self.seat.model.name}: the readings of {bys} at {point} do not agree")
        return exclude(crew.remaining(who), lost)

    # --- clearing -------------------------------------------------------------------------------------

    def clear_parallax(
        self,
        who: Indices,
        point: str,
        element: str,
        gain_at: Callable[[Indices, Array], Array],
        unless_within: float = 0.0,
    ) -> ClearedPoint:
        """Clear the y-parallax of a point by turning an element, unless it seems to be within so many mm already.

        `gain_at` tells what one unit of the element's counter adds to the parallax ``(m,)`` in mm at places
        ``(3, m)``. What is found and what the element then shows goes into the book.
        """
        crew = self.crew
        judgement, error = self._judgement(who)
        found, turn, gain = np.zeros((3, crew.size))
        place = np.zeros((3, crew.size))
        fused = self._arrive(who, point, judgement, error, place, found)
        apart = exclude(crew.remaining(who), fused)
        if not fused.size:
            return ClearedPoint(fused, apart, found, place, turn)
        gain[fused] = gain_at(fused, place[:, fused])
        turning = fused[np.abs(found[fused]) > unless_within]
        turned = self._turn_until_clear(turning, point, judgement, Clearing(element, gain, error), turn)
        self._tick()
        return ClearedPoint(exclude(fused, exclude(turning, turned)), apart, found, place, turn)

    def look_at_parallaxes(self, who: Indices, points: Sequence[str]) -> Parallaxes:
        """Look at what y-parallax is left at points, without turning anything but the handwheels."""
        crew = self.crew
        p, places = np.zeros((len(points), crew.size)), np.zeros((3, len(points), crew.size))
        apart = np.full(crew.size, None, dtype=object)
        for i, point in enumerate(points):
            judgement, error = self._judgement(who)
            fused = self._arrive(who, point, judgement, error, places[:, i], p[i])
            apart[exclude(crew.remaining(who), fused)] = point
            who = fused
            if not who.size:
                break
            self._tick()
        return Parallaxes(p, places, apart)

    def _judgement(self, who: Indices) -> tuple[SettingErrors, Array]:
        """Draw by how much one arrival at a point is misjudged, and its y-parallax ``(sessions,)`` in um."""
        observer = self.crew.observer
        x, y, height, parallax = self.crew.draw_setting_errors(who, 1.0, (4,))
        plan = observer.stereo_um * np.array([x, y])
        return SettingErrors(plan, observer.height_um * height), observer.parallax_um * parallax

    def _arrive(
        self, who: Indices, point: str, judgement: SettingErrors, error: Array, place: Array, found: Array
    ) -> Indices:
        """Set the mark on a point; put into place where it is and what y-parallax it seems to have, and enter that."""
        seat = self.seat
        self._come_to(who, point)
        fused = self.mark.fuse(who, point, judgement)
        if fused.size:
            readings = seat.counters(fused)
            place[:, fused] = seat.model_position(fused, readings)
            self.eyes.measure_drift(fused, 1, point, readings)
            found[fused] = self._seen_parallax(fused, point, error)
            self.crew.enter(fused, point, "parallax seen", found[fused])
        return fused

    def _seen_parallax(self, who: Indices, point: str, error: Array) -> Array:
        """Return the y-parallax ``(m,)`` in mm as it seems."""
        seen = self.mark.view(who, point)[3] + error[who]
        return np.asarray(1e-3 * seen * self.seat.z[who] / self.seat.c)

    def _turn_until_clear(
        self, who: Indices, point: str, judgement: SettingErrors, clearing: Clearing, turn: Array
    ) -> Indices:
        """Turn an element until a point is clear, enter what it shows, and put the turn into place."""
        crew, seat, element = self.crew, self.seat, clearing.element
        slips = crew.draw_misreadings(who, (1,))[0]
        before = np.zeros(crew.size)
        before[who] = seat.exact_values(who, [element])[element] if who.size else 0.0
        who = self.mark.settle(who, point, judgement, clearing) if who.size else who
        if not who.size:
            return who
        crew.spend(who, crew.observer.seconds_to_read, "reading")
        shown = seat.elements(who, [element])[element]
        written = crew.transcribe(who, point, element, shown, slips)
        crew.enter(who, point, element, written)
        turned = seat.held_position(who, element) - before[who]
        turn[who] = (wrap_gon(turned) if seat.manual.elements[element].endless else turned) + written - shown
        seat.read_settings(who)
        seat.give_up_on_errors(who, f"{seat.model.name}: clearing {point} with {element}")
        return crew.remaining(who)

    # --- model coordinates ----------------------------------------------------------------------------

    def measure_points(self, who: Indices, points: Sequence[str]) -> Array:
        """Measure model points stereoscopically, two pointings that agree; X, Y, Z readings ``(3, n, sessions)``.

        A point whose images cannot be fused is remarked upon and comes out as nan.
        """
        crew, observer, n = self.crew, self.crew.observer, len(points)
        at_point = crew.draw_setting_errors(who, 1.0, (3, n)) * np.sqrt(1.0 - observer.repeat_share**2)
        anew = crew.draw_setting_errors(who, 1.0, (3, n, 2)) * observer.repeat_share
        slips = crew.draw_misreadings(who, (3, n, 2))
        measured = np.full((3, n, crew.size), np.nan)
        for i, point in enumerate(points):
            who = crew.remaining(who)
            self._come_to(who, point)
            self._measure(who, point, at_point[:, i], anew[:, i], slips[:, i], measured[:, i])
            self._tick()
        self.seat.give_up_on_errors(who, f"{self.seat.model.name}: measuring model coordinates")
        return measured

    def _measure(self, who: Indices, point: str, at_point: Array, anew: Array, slips: Array, into: Array) -> None:
        """Put the mean of two pointings that agree into place, or else the median of all."""
        crew, observer = self.crew, self.crew.observer
        sigmas = np.array([observer.stereo_um, observer.stereo_um, observer.height_um])[:, None]
        pointings: list[Array] = []
        entries: list[Numbers] = []
        repeating = who
        while len(pointings) < MAX_POINTINGS and repeating.size:
            k = len(pointings)
            if k < 2:
                error, slip = anew[:, k], slips[:, k]
            else:
                self._strike(repeating, entries[-2])
                error = crew.redraw_setting_errors(repeating, observer.repeat_share, 3)
                slip = crew.redraw_misreadings(repeating, 3)
            readings = np.full((3, crew.size), np.nan)
            found, numbers = self._pointing(repeating, point, sigmas * (at_point + error), slip, readings)
            apart = exclude(crew.remaining(repeating), found)
            crew.remark(apart, f"point {point}: its two images cannot be fused, not measured")
            pointings.append(readings)
            entries.append(numbers)
            repeating = found
            if k:
                agreed = found[self._agree(pointings[-2][:, found], readings[:, found])]
                into[:, agreed] = (pointings[-2][:, agreed] + readings[:, agreed]) / 2.0
                repeating = exclude(found, agreed)
        if repeating.size:
            into[:, repeating] = np.median([each[:, repeating] for each in pointings], axis=0)
        crew.remark(repeating, f"point {point}: no two of {MAX_POINTINGS} pointings agree, median taken")

    def _pointing(
        self, who: Indices, point: str, error: Array, slips: Array, readings: Array
    ) -> tuple[Indices, Numbers]:
        crew = self.crew
        who = self.mark.fuse(who, point, SettingErrors(error[:2], error[2]))
        numbers = np.zeros((3, crew.size), dtype=np.intp)
        if who.size:
            for axis, name in enumerate("XYZ"):
                readings[axis, who] = self._read(who, point, name, slips[axis])
            self.hands.record(who, point)
            for axis, name in enumerate("XYZ"):
                numbers[axis] = crew.enter(who, point, name, readings[axis, who])
        return who, numbers

    def _agree(self, first: Array, second: Array) -> npt.NDArray[np.bool_]:
        difference = np.abs(first - second) / self.seat.counter_units_per_mm[:, None]
        return np.asarray((difference <= AGREEMENT_MM + 1e-9).all(axis=0))

    def _strike(self, who: Indices, numbers: Numbers) -> None:
        for each in numbers:
            self.crew.strike(who, each, "two pointings differ by more than 0.01 mm")
