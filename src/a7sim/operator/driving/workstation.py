"""Workstation: the operations that a procedure requests of the operators of a batch.

The same code drives one instrument over the link (`ScpiDriver`) and a batch of instruments as arrays. The last axis of
arrays contains all sessions; `active` are the indices of the active ones. Sessions that give up are no longer active.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, exclude
from a7sim.geometry import Array
from a7sim.operator.driving.controls import Controls, side_name, wrap_gon
from a7sim.operator.driving.driver import BoolArray, InstrumentDriver
from a7sim.operator.driving.floating_mark import Clearing, FloatingMark, SettingErrors
from a7sim.operator.driving.job import Job, ModelJob
from a7sim.operator.driving.pointing import Pointing
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.people.slips import neighbours

MAX_POINTINGS = 12
AGREEMENT_MM = 0.01
"""Maximum difference of two accepted pointings of a model point (thesis 3.5)."""

MIN_SLIP_MM = 0.03
"""A reading of by that differs less than this from the others is not taken for a blunder."""

Numbers = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Parallaxes:
    """Y-parallaxes ``(n, sessions)`` in mm, left-hand minus right-hand, and the positions ``(3, n, sessions)``.

    x is counted from the left-hand centre, y from the base line, z below the centres, all in mm. `disagreement` is the
    point whose images could not be fused, if any; then the other values are invalid.
    """

    parallax_mm: Array
    places: Array
    disagreement: npt.NDArray[np.object_]

    def disagrees(self, active: Indices) -> Indices:
        """Return the sessions that could not fuse the images of a point."""
        parted = np.array([self.disagreement[session] is not None for session in active], dtype=bool)
        return np.asarray(active[parted])


@dataclass(frozen=True)
class ClearedPoint:
    """Result of clearing a y-parallax with an element; arrays ``(sessions,)``, zero for inactive sessions."""

    sessions: Indices
    """Sessions in which it was clear or was cleared."""
    disagreement: Indices
    """Sessions in which the images could not be fused."""
    arrival_parallax_mm: Array
    """Apparent y-parallax in mm on arrival."""
    model_position_mm: Array
    """Position ``(3, sessions)``: x from the left-hand centre, y from the base line, z below the centres, mm."""
    element_change: Array
    """Turn that cleared the point, gon or mm, as written."""


class Workstation:
    """Batch of operators at their instruments."""

    def __init__(
        self, operators: OperatorBatch, driver: InstrumentDriver, job: Job, tick: Callable[[], None] = lambda: None
    ) -> None:
        self.operators = operators
        self.job = job
        self.driver = driver
        self.controls = Controls(operators, driver, job)
        self.pointing = Pointing(self.controls)
        self.mark = FloatingMark(self.pointing)
        self._tick = tick
        self._prints: Mapping[int, Mapping[str, Array]] = {}
        self._entries: dict[tuple[int, str, float], tuple[Numbers, Numbers]] = {}

    # --- setting up -----------------------------------------------------------------------------------

    def begin(self, active: Indices, model: ModelJob, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Start a model whose pictures are mounted; `prints` by side (1 left, 2 right), positions ``(2, sessions)``."""
        self.pointing.set_prints(prints)
        self._prints = prints
        self._entries.clear()
        self.controls.begin(active, model)

    def preset(self, active: Indices, point: str) -> None:
        """Point at a point in the left-hand photograph and preset the counters to the plan's numbers there."""
        plan = self.job.plan
        self.controls.drive_z_to(active, np.full(active.size, -plan.projection_height))
        errors = self.operators.draw_setting_errors(active, self.operators.observer.monocular_um, (2,))
        self.pointing.bring_into_view(active, 1, point)
        self.pointing.bisect(self.operators.remaining(active), 1, point, errors)
        self.controls.preset(self.operators.remaining(active), plan.preset)

    def begin_round(self, active: Indices, number: int) -> None:
        """Start a round of a procedure: the next readings are entered under its number."""
        self.operators.begin_round(active, number)
        if self.operators.person is not None:
            self.driver.note(active, f"{self.controls.model.name}: {self.operators.person.book.form}, round {number}")

    def compute(self, active: Indices) -> None:
        """Add the duration of one computation."""
        self.operators.spend(active, self.operators.observer.seconds_to_compute, "computing")

    def has_point(self, active: Indices, point: str, hands: Sequence[int] = (1, 2)) -> BoolArray:
        """Return which active sessions find a point pricked on both prints, or on that of one photograph."""
        prints = [self._prints[side].get(point) for side in hands]
        if any(each is None for each in prints):
            return np.zeros(active.size, dtype=bool)
        return np.asarray(~np.isnan([each[0, active] for each in prints if each is not None]).any(axis=0))

    def group_by_points(
        self, active: Indices, points: Sequence[str], hands: Sequence[int] = (1, 2)
    ) -> Iterator[tuple[Indices, list[str]]]:
        """Yield groups of sessions that find the same subset of points pricked on the prints of these photographs.

        Each active session occurs once, the subset in the order of `points`, possibly empty.
        """
        if not points:
            yield active, []
            return
        shown = np.array([self.has_point(active, point, hands) for point in points])
        for pattern in np.unique(shown, axis=1).T:
            them = active[(shown == pattern[:, None]).all(axis=0)]
            yield them, [point for point, there in zip(points, pattern, strict=True) if there]

    def _come_to(self, active: Indices, point: str) -> None:
        """Select a point, or by mistake a standard point near it."""
        near = neighbours(self.controls.model.standard_points, point) if self.operators.may_mistake_points else []
        self.operators.select_point(active, point, {name: self.has_point(active, name) for name in near})

    # --- monocular pointing ---------------------------------------------------------------------------

    def point_monocularly(self, active: Indices, side: int, points: Sequence[str], level: float) -> Array:
        """Point with the eye of photograph 1 (left-hand) or 2 at a Z reading; X, Y readings ``(2, n, sessions)``."""
        operators = self.operators
        errors = operators.draw_setting_errors(active, operators.observer.monocular_um, (2, len(points)))
        slips = operators.draw_misreadings(active, (2, len(points)))
        self._drive_to_level(active, level)
        readings = np.zeros((2, len(points), operators.size))
        for i, point in enumerate(points):
            active = operators.remaining(active)
            self._come_to(active, point)
            self._point_once(active, side, point, level, errors[:, i], slips[:, i], readings[:, i])
        return readings

    def repeat_pointing(self, active: Indices, side: int, point: str, level: float, why: str) -> Array:
        """Strike out a pointing and repeat it; X, Y ``(2, sessions)``."""
        operators = self.operators
        for numbers in self._entries[side, point, level]:
            operators.strike(active, numbers, why)
        operators.recheck_points(active)
        self._drive_to_level(active, level)
        errors = operators.redraw_setting_errors(active, operators.observer.monocular_um, 2)
        slips = operators.redraw_misreadings(active, 2)
        readings = np.zeros((2, operators.size))
        self._point_once(active, side, point, level, errors, slips, readings)
        return readings

    def _drive_to_level(self, active: Indices, level: float) -> None:
        self.controls.drive(active, {"Z": np.full(active.size, level)})
        self.controls.give_up_on_errors(active, f"driving Z to {level:.2f}")

    def _point_once(
        self, active: Indices, side: int, point: str, level: float, errors: Array, slips: Array, readings: Array
    ) -> None:
        operators = self.operators
        self.pointing.bring_into_view(active, side, point)
        self.pointing.bisect(operators.remaining(active), side, point, errors)
        active = operators.remaining(active)
        items = [f"{name} {side_name(side)} at Z {level:.2f}" for name in "XY"]
        for axis, item in enumerate(items):
            readings[axis, active] = self._read(active, point, item, slips[axis])
        self.pointing.measure_drift(active, side, point, readings[:, active])
        numbers = [operators.enter(active, point, item, readings[axis, active]) for axis, item in enumerate(items)]
        self._entries[side, point, level] = (numbers[0], numbers[1])
        self._tick()

    def _read(self, active: Indices, point: str, item: str, slips: Array) -> Array:
        """Read the counter ``(m,)`` named at the start of an item, with misreadings ``(sessions,)``."""
        self.operators.spend(active, self.operators.observer.seconds_to_read, "reading")
        return self.operators.transcribe(active, point, item, self.driver.counter(active, item[0]), slips)

    # --- y-parallaxes ---------------------------------------------------------------------------------

    def parallaxes(
        self, active: Indices, points: Sequence[str], readings: int, projectors: Sequence[int] = (1, 2)
    ) -> Parallaxes:
        """Measure y-parallaxes with by' or by" or both, `readings` times with each."""
        operators, observer, n = self.operators, self.operators.observer, len(points)
        plan_errors = operators.draw_setting_errors(active, observer.stereo_um, (2, n))
        height_errors = operators.draw_setting_errors(active, observer.height_um, (n,))
        errors = operators.draw_setting_errors(active, observer.parallax_um, (n, len(projectors), readings))
        slips = operators.draw_misreadings(active, (n, len(projectors), readings))
        rest = self._at_rest(active)
        p, places = np.zeros((n, operators.size)), np.zeros((3, n, operators.size))
        apart = np.full(operators.size, None, dtype=object)
        measuring = active
        for i, point in enumerate(points):
            self._come_to(measuring, point)
            judgement = SettingErrors(plan_errors[:, i], height_errors[i])
            fused = self.mark.fuse(measuring, point, judgement)
            readings_there = self.controls.counters(fused) if fused.size else np.zeros((3, 0))
            places[:, i, fused] = self.controls.model_position(fused, readings_there)
            self.pointing.measure_drift(fused, 1, point, readings_there) if fused.size else None
            cleared = self._parallax(fused, point, judgement, projectors, rest, errors[i], slips[i], p[i])
            lost = exclude(operators.remaining(measuring), cleared)
            apart[lost] = point
            if lost.size:
                self._turn_back(lost, ("by1", "by2"), rest)
            measuring = cleared
            if not measuring.size:
                break
            self._tick()
        if measuring.size:
            self.controls.give_up_on_errors(measuring, f"{self.controls.model.name}: measuring y-parallaxes")
        return Parallaxes(p, places, apart)

    def _at_rest(self, active: Indices) -> dict[str, Array]:
        rest = {name: np.zeros(self.operators.size) for name in ("by1", "by2")}
        for name, counts in self.controls.elements(active, ["by1", "by2"]).items():
            rest[name][active] = counts
        return rest

    def _turn_back(self, active: Indices, names: Sequence[str], rest: Mapping[str, Array]) -> None:
        self.operators.spend(active, self.operators.observer.seconds_to_turn, "turning")
        for name in names:
            self.controls.run_element(active, name, rest[name][active])

    def _parallax(
        self,
        active: Indices,
        point: str,
        judgement: SettingErrors,
        projectors: Sequence[int],
        rest: Mapping[str, Array],
        errors: Array,
        slips: Array,
        into: Array,
    ) -> Indices:
        """Clear the parallax of a point with by of projectors; write the mean readings ``(sessions,)`` into `out`."""
        values = np.zeros(errors.shape)
        numbers = np.zeros(errors.shape, dtype=np.intp)
        for i, projector in enumerate(projectors):
            for k in range(errors.shape[1]):
                active = self._clear_with_by(
                    active, projector, point, judgement, errors[i, k], slips[i, k], rest, values[i, k], numbers[i, k]
                )
            if active.size:
                self._turn_back(active, (f"by{projector}",), rest)
        active = self._without_slips(active, point, judgement, projectors, rest, values, numbers)
        into[active] = values[:, :, active].mean(axis=1).mean(axis=0)
        return active

    def _clear_with_by(
        self,
        active: Indices,
        projector: int,
        point: str,
        judgement: SettingErrors,
        errors: Array,
        slips: Array,
        rest: Mapping[str, Array],
        values: Array,
        numbers: Numbers,
    ) -> Indices:
        if not active.size:
            return active
        by, sense = f"by{projector}", self._sense_of_by(projector)
        active = self.mark.settle(active, point, judgement, Clearing(by, np.full(self.operators.size, -sense), errors))
        if active.size:
            self.operators.spend(active, self.operators.observer.seconds_to_read, "reading")
            counts = self.operators.transcribe(active, point, by, self.driver.elements(active, [by])[by], slips)
            numbers[active] = self.operators.enter(active, point, by, counts)[active]
            values[active] = sense * (counts - rest[by][active])
        return active

    def _sense_of_by(self, projector: int) -> float:
        return 1.0 if self.controls.model.side_of(projector) == 1 else -1.0

    def _without_slips(
        self,
        active: Indices,
        point: str,
        judgement: SettingErrors,
        projectors: Sequence[int],
        rest: Mapping[str, Array],
        values: Array,
        numbers: Numbers,
    ) -> Indices:
        """Strike out readings that contradict the others and repeat them, in place.

        Of two contradicting readings it is unknown which one is wrong: they are repeated in turn.
        """
        operators, observer = self.operators, self.operators.observer
        tolerance = MIN_SLIP_MM + 5e-3 * observer.parallax_um * self.controls.z / self.controls.c
        doubtful, lost = active, active[:0]
        readings = values.shape[1]
        bys = " and ".join("by'" if projector == 1 else 'by"' for projector in projectors)
        for number in range(MAX_POINTINGS):
            flat = values.reshape(-1, operators.size)[:, doubtful]
            deviations = np.abs(flat - np.median(flat, axis=0))
            worst = deviations.argmax(axis=0) if len(flat) > 2 else np.full(doubtful.size, number % len(flat))
            off = deviations.max(axis=0) > tolerance[doubtful]
            doubtful, worst = doubtful[off], worst[off]
            if not doubtful.size:
                return exclude(operators.remaining(active), lost)
            for i in np.unique(worst // readings):
                of_this = worst // readings == i
                again, k = doubtful[of_this], np.zeros(operators.size, dtype=np.intp)
                k[again] = worst[of_this] % readings
                value, entry = (np.take_along_axis(each[i], k[None], axis=0)[0] for each in (values, numbers))
                by = f"by{projectors[i]}"
                operators.strike(again, entry, f"does not agree with the other readings of {bys} at {point}")
                errors = operators.redraw_setting_errors(again, observer.parallax_um, 1)[0]
                slips = operators.redraw_misreadings(again, 1)[0]
                found = self._clear_with_by(again, projectors[i], point, judgement, errors, slips, rest, value, entry)
                values[i, k[found], found], numbers[i, k[found], found] = value[found], entry[found]
                lost = np.concatenate([lost, exclude(again, found)])
                if found.size:
                    self._turn_back(found, (by,), rest)
            doubtful = exclude(doubtful, lost)
        operators.give_up(doubtful, f"{self.controls.model.name}: the readings of {bys} at {point} do not agree")
        return exclude(operators.remaining(active), lost)

    # --- clearing -------------------------------------------------------------------------------------

    def clear_parallax(
        self,
        active: Indices,
        point: str,
        element: str,
        gain_at: Callable[[Indices, Array], Array],
        unless_within: float = 0.0,
    ) -> ClearedPoint:
        """Clear the y-parallax of a point by turning an element, unless it already appears to be within a limit in mm.

        `gain_at` returns the change of the parallax ``(m,)`` in mm by one unit of the element's counter at positions
        ``(3, m)``. The parallax and the final reading of the element are added to the book.
        """
        operators = self.operators
        judgement, error = self._judgement(active)
        found, turn, gain = np.zeros((3, operators.size))
        place = np.zeros((3, operators.size))
        fused = self._arrive(active, point, judgement, error, place, found)
        apart = exclude(operators.remaining(active), fused)
        if not fused.size:
            return ClearedPoint(fused, apart, found, place, turn)
        gain[fused] = gain_at(fused, place[:, fused])
        turning = fused[np.abs(found[fused]) > unless_within]
        turned = self._turn_until_clear(turning, point, judgement, Clearing(element, gain, error), turn)
        self._tick()
        return ClearedPoint(exclude(fused, exclude(turning, turned)), apart, found, place, turn)

    def look_at_parallaxes(self, active: Indices, points: Sequence[str]) -> Parallaxes:
        """Look at the remaining y-parallax at points, turning only the handwheels."""
        operators = self.operators
        p, places = np.zeros((len(points), operators.size)), np.zeros((3, len(points), operators.size))
        apart = np.full(operators.size, None, dtype=object)
        for i, point in enumerate(points):
            judgement, error = self._judgement(active)
            fused = self._arrive(active, point, judgement, error, places[:, i], p[i])
            apart[exclude(operators.remaining(active), fused)] = point
            active = fused
            if not active.size:
                break
            self._tick()
        return Parallaxes(p, places, apart)

    def _judgement(self, active: Indices) -> tuple[SettingErrors, Array]:
        """Draw the setting errors of one arrival at a point, and the error of its y-parallax ``(sessions,)`` in um."""
        observer = self.operators.observer
        x, y, height, parallax = self.operators.draw_setting_errors(active, 1.0, (4,))
        plan = observer.stereo_um * np.array([x, y])
        return SettingErrors(plan, observer.height_um * height), observer.parallax_um * parallax

    def _arrive(
        self, active: Indices, point: str, judgement: SettingErrors, error: Array, place: Array, found: Array
    ) -> Indices:
        """Set the mark on a point; write its position and its apparent y-parallax into the arrays and the book."""
        controls = self.controls
        self._come_to(active, point)
        fused = self.mark.fuse(active, point, judgement)
        if fused.size:
            readings = controls.counters(fused)
            place[:, fused] = controls.model_position(fused, readings)
            self.pointing.measure_drift(fused, 1, point, readings)
            found[fused] = self._seen_parallax(fused, point, error)
            self.operators.enter(fused, point, "parallax seen", found[fused])
        return fused

    def _seen_parallax(self, active: Indices, point: str, error: Array) -> Array:
        """Return the apparent y-parallax ``(m,)`` in mm."""
        seen = self.mark.view(active, point)[3] + error[active]
        return np.asarray(1e-3 * seen * self.controls.z[active] / self.controls.c)

    def _turn_until_clear(
        self, active: Indices, point: str, judgement: SettingErrors, clearing: Clearing, turn: Array
    ) -> Indices:
        """Turn an element until a point is clear, add its reading to the book, and write the turn into the array."""
        operators, controls, element = self.operators, self.controls, clearing.element
        slips = operators.draw_misreadings(active, (1,))[0]
        before = np.zeros(operators.size)
        before[active] = controls.exact_values(active, [element])[element] if active.size else 0.0
        active = self.mark.settle(active, point, judgement, clearing) if active.size else active
        if not active.size:
            return active
        operators.spend(active, operators.observer.seconds_to_read, "reading")
        shown = controls.elements(active, [element])[element]
        written = operators.transcribe(active, point, element, shown, slips)
        operators.enter(active, point, element, written)
        turned = controls.held_position(active, element) - before[active]
        turn[active] = (wrap_gon(turned) if controls.manual.elements[element].endless else turned) + written - shown
        controls.read_settings(active)
        controls.give_up_on_errors(active, f"{controls.model.name}: clearing {point} with {element}")
        return operators.remaining(active)

    # --- model coordinates ----------------------------------------------------------------------------

    def measure_points(self, active: Indices, points: Sequence[str]) -> Array:
        """Measure model points stereoscopically, two pointings that agree; X, Y, Z readings ``(3, n, sessions)``.

        A point whose images cannot be fused gets a remark and nan.
        """
        operators, observer, n = self.operators, self.operators.observer, len(points)
        at_point = operators.draw_setting_errors(active, 1.0, (3, n)) * np.sqrt(1.0 - observer.repeat_share**2)
        anew = operators.draw_setting_errors(active, 1.0, (3, n, 2)) * observer.repeat_share
        slips = operators.draw_misreadings(active, (3, n, 2))
        measured = np.full((3, n, operators.size), np.nan)
        for i, point in enumerate(points):
            active = operators.remaining(active)
            self._come_to(active, point)
            self._measure(active, point, at_point[:, i], anew[:, i], slips[:, i], measured[:, i])
            self._tick()
        self.controls.give_up_on_errors(active, f"{self.controls.model.name}: measuring model coordinates")
        return measured

    def _measure(self, active: Indices, point: str, at_point: Array, anew: Array, slips: Array, into: Array) -> None:
        """Write the mean of two pointings that agree, or else the median of all, into `out`."""
        operators, observer = self.operators, self.operators.observer
        sigmas = np.array([observer.stereo_um, observer.stereo_um, observer.height_um])[:, None]
        pointings: list[Array] = []
        entries: list[Numbers] = []
        repeating = active
        while len(pointings) < MAX_POINTINGS and repeating.size:
            k = len(pointings)
            if k < 2:
                error, slip = anew[:, k], slips[:, k]
            else:
                self._strike(repeating, entries[-2])
                error = operators.redraw_setting_errors(repeating, observer.repeat_share, 3)
                slip = operators.redraw_misreadings(repeating, 3)
            readings = np.full((3, operators.size), np.nan)
            found, numbers = self._pointing(repeating, point, sigmas * (at_point + error), slip, readings)
            apart = exclude(operators.remaining(repeating), found)
            operators.remark(apart, f"point {point}: its two images cannot be fused, not measured")
            pointings.append(readings)
            entries.append(numbers)
            repeating = found
            if k:
                agreed = found[self._agree(pointings[-2][:, found], readings[:, found])]
                into[:, agreed] = (pointings[-2][:, agreed] + readings[:, agreed]) / 2.0
                repeating = exclude(found, agreed)
        if repeating.size:
            into[:, repeating] = np.median([each[:, repeating] for each in pointings], axis=0)
        operators.remark(repeating, f"point {point}: no two of {MAX_POINTINGS} pointings agree, median taken")

    def _pointing(
        self, active: Indices, point: str, error: Array, slips: Array, readings: Array
    ) -> tuple[Indices, Numbers]:
        operators = self.operators
        active = self.mark.fuse(active, point, SettingErrors(error[:2], error[2]))
        numbers = np.zeros((3, operators.size), dtype=np.intp)
        if active.size:
            for axis, name in enumerate("XYZ"):
                readings[axis, active] = self._read(active, point, name, slips[axis])
            self.driver.record(active, point)
            for axis, name in enumerate("XYZ"):
                numbers[axis] = operators.enter(active, point, name, readings[axis, active])
        return active, numbers

    def _agree(self, first: Array, second: Array) -> npt.NDArray[np.bool_]:
        difference = np.abs(first - second) / self.controls.counter_units_per_mm[:, None]
        return np.asarray((difference <= AGREEMENT_MM + 1e-9).all(axis=0))

    def _strike(self, active: Indices, numbers: Numbers) -> None:
        for each in numbers:
            self.operators.strike(active, each, "two pointings differ by more than 0.01 mm")
