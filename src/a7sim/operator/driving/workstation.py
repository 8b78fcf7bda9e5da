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

EntryNumbers = npt.NDArray[np.intp]


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
        has_disagreement = np.array([self.disagreement[session] is not None for session in active], dtype=bool)
        return np.asarray(active[has_disagreement])


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
        self._entries: dict[tuple[int, str, float], tuple[EntryNumbers, EntryNumbers]] = {}

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
        self.driver.note(active, f"{self.controls.model.name}: {self.operators.form}, round {number}")

    def compute(self, active: Indices) -> None:
        """Add the duration of one computation."""
        self.operators.spend(active, self.operators.observer.seconds_to_compute, "computing")

    def has_point(self, active: Indices, point: str, sides: Sequence[int] = (1, 2)) -> BoolArray:
        """Return which active sessions find a point pricked on both prints, or on that of one photograph."""
        prints = [self._prints[side].get(point) for side in sides]
        if any(positions is None for positions in prints):
            return np.zeros(active.size, dtype=bool)
        return np.asarray(
            ~np.isnan([positions[0, active] for positions in prints if positions is not None]).any(axis=0)
        )

    def group_by_points(
        self, active: Indices, points: Sequence[str], sides: Sequence[int] = (1, 2)
    ) -> Iterator[tuple[Indices, list[str]]]:
        """Yield groups of sessions that find the same subset of points pricked on the prints of these photographs.

        Each active session occurs once, the subset in the order of `points`, possibly empty.
        """
        if not points:
            yield active, []
            return
        shown = np.array([self.has_point(active, point, sides) for point in points])
        for is_shown in np.unique(shown, axis=1).T:
            sessions = active[(shown == is_shown[:, None]).all(axis=0)]
            yield sessions, [point for point, found in zip(points, is_shown, strict=True) if found]

    def _select_point(self, active: Indices, point: str) -> None:
        """Select a point, or by mistake a standard point near it."""
        near = neighbours(self.controls.model.standard_points, point) if self.operators.may_mistake_points else []
        self.operators.select_point(active, point, {name: self.has_point(active, name) for name in near})

    # --- monocular pointing ---------------------------------------------------------------------------

    def point_monocularly(self, active: Indices, side: int, points: Sequence[str], level: float) -> Array:
        """Point with the eye of photograph 1 (left-hand) or 2 at a Z reading; X, Y readings ``(2, n, sessions)``."""
        operators = self.operators
        errors = operators.draw_setting_errors(active, operators.observer.monocular_um, (2, len(points)))
        misreadings = operators.draw_misreadings(active, (2, len(points)))
        self._drive_to_level(active, level)
        readings = np.zeros((2, len(points), operators.size))
        for i, point in enumerate(points):
            active = operators.remaining(active)
            self._select_point(active, point)
            self._point_once(active, side, point, level, errors[:, i], misreadings[:, i], readings[:, i])
        return readings

    def repeat_pointing(self, active: Indices, side: int, point: str, level: float, reason: str) -> Array:
        """Strike out a pointing and repeat it; X, Y ``(2, sessions)``."""
        operators = self.operators
        for numbers in self._entries[side, point, level]:
            operators.strike(active, numbers, reason)
        operators.recheck_points(active)
        self._drive_to_level(active, level)
        errors = operators.redraw_setting_errors(active, operators.observer.monocular_um, 2)
        misreadings = operators.redraw_misreadings(active, 2)
        readings = np.zeros((2, operators.size))
        self._point_once(active, side, point, level, errors, misreadings, readings)
        return readings

    def _drive_to_level(self, active: Indices, level: float) -> None:
        self.controls.drive(active, {"Z": np.full(active.size, level)})
        self.controls.give_up_on_errors(active, f"driving Z to {level:.2f}")

    def _point_once(
        self, active: Indices, side: int, point: str, level: float, errors: Array, misreadings: Array, readings: Array
    ) -> None:
        operators = self.operators
        self.pointing.bring_into_view(active, side, point)
        self.pointing.bisect(operators.remaining(active), side, point, errors)
        active = operators.remaining(active)
        items = [f"{name} {side_name(side)} at Z {level:.2f}" for name in "XY"]
        for axis, item in enumerate(items):
            readings[axis, active] = self._read(active, point, item, misreadings[axis])
        self.pointing.measure_drift(active, side, point, readings[:, active])
        numbers = [operators.enter(active, point, item, readings[axis, active]) for axis, item in enumerate(items)]
        self._entries[side, point, level] = (numbers[0], numbers[1])
        self._tick()

    def _read(self, active: Indices, point: str, item: str, misreadings: Array) -> Array:
        """Read the counter ``(m,)`` named at the start of an item, with misreadings ``(sessions,)``."""
        self.operators.spend(active, self.operators.observer.seconds_to_read, "reading")
        return self.operators.transcribe(active, point, item, self.driver.counter(active, item[0]), misreadings)

    # --- y-parallaxes ---------------------------------------------------------------------------------

    def parallaxes(
        self, active: Indices, points: Sequence[str], readings: int, projectors: Sequence[int] = (1, 2)
    ) -> Parallaxes:
        """Measure y-parallaxes with by' or by" or both, `readings` times with each."""
        operators, observer, n = self.operators, self.operators.observer, len(points)
        plan_errors = operators.draw_setting_errors(active, observer.stereo_um, (2, n))
        height_errors = operators.draw_setting_errors(active, observer.height_um, (n,))
        errors = operators.draw_setting_errors(active, observer.parallax_um, (n, len(projectors), readings))
        misreadings = operators.draw_misreadings(active, (n, len(projectors), readings))
        initial_by = self._read_by(active)
        parallax_mm, places = np.zeros((n, operators.size)), np.zeros((3, n, operators.size))
        disagreement = np.full(operators.size, None, dtype=object)
        measuring = active
        for i, point in enumerate(points):
            self._select_point(measuring, point)
            setting_errors = SettingErrors(plan_errors[:, i], height_errors[i])
            fused = self.mark.fuse(measuring, point, setting_errors)
            if fused.size:
                counter_readings = self.controls.counters(fused)
                places[:, i, fused] = self.controls.model_position(fused, counter_readings)
                self.pointing.measure_drift(fused, 1, point, counter_readings)
            cleared = self._measure_parallax(
                fused, point, setting_errors, projectors, initial_by, errors[i], misreadings[i], parallax_mm[i]
            )
            lost = exclude(operators.remaining(measuring), cleared)
            disagreement[lost] = point
            if lost.size:
                self._return_elements(lost, ("by1", "by2"), initial_by)
            measuring = cleared
            if not measuring.size:
                break
            self._tick()
        if measuring.size:
            self.controls.give_up_on_errors(measuring, f"{self.controls.model.name}: measuring y-parallaxes")
        return Parallaxes(parallax_mm, places, disagreement)

    def _read_by(self, active: Indices) -> dict[str, Array]:
        initial_by = {name: np.zeros(self.operators.size) for name in ("by1", "by2")}
        for name, counts in self.controls.elements(active, ["by1", "by2"]).items():
            initial_by[name][active] = counts
        return initial_by

    def _return_elements(self, active: Indices, names: Sequence[str], initial_by: Mapping[str, Array]) -> None:
        self.operators.spend(active, self.operators.observer.seconds_to_turn, "turning")
        for name in names:
            self.controls.run_element(active, name, initial_by[name][active])

    def _measure_parallax(
        self,
        active: Indices,
        point: str,
        setting_errors: SettingErrors,
        projectors: Sequence[int],
        initial_by: Mapping[str, Array],
        errors: Array,
        misreadings: Array,
        out: Array,
    ) -> Indices:
        """Clear the parallax of a point with by of projectors; write the mean readings ``(sessions,)`` into `out`."""
        values = np.zeros(errors.shape)
        numbers = np.zeros(errors.shape, dtype=np.intp)
        for i, projector in enumerate(projectors):
            for k in range(errors.shape[1]):
                active = self._clear_with_by(
                    active,
                    projector,
                    point,
                    setting_errors,
                    errors[i, k],
                    misreadings[i, k],
                    initial_by,
                    values[i, k],
                    numbers[i, k],
                )
            if active.size:
                self._return_elements(active, (f"by{projector}",), initial_by)
        active = self._repeat_doubtful_readings(active, point, setting_errors, projectors, initial_by, values, numbers)
        out[active] = values[:, :, active].mean(axis=1).mean(axis=0)
        return active

    def _clear_with_by(
        self,
        active: Indices,
        projector: int,
        point: str,
        setting_errors: SettingErrors,
        errors: Array,
        misreadings: Array,
        initial_by: Mapping[str, Array],
        values: Array,
        numbers: EntryNumbers,
    ) -> Indices:
        if not active.size:
            return active
        by, sense = f"by{projector}", self._sense_of_by(projector)
        active = self.mark.settle(
            active, point, setting_errors, Clearing(by, np.full(self.operators.size, -sense), errors)
        )
        if active.size:
            self.operators.spend(active, self.operators.observer.seconds_to_read, "reading")
            counts = self.operators.transcribe(active, point, by, self.driver.elements(active, [by])[by], misreadings)
            numbers[active] = self.operators.enter(active, point, by, counts)[active]
            values[active] = sense * (counts - initial_by[by][active])
        return active

    def _sense_of_by(self, projector: int) -> float:
        return 1.0 if self.controls.model.side_of(projector) == 1 else -1.0

    def _repeat_doubtful_readings(
        self,
        active: Indices,
        point: str,
        setting_errors: SettingErrors,
        projectors: Sequence[int],
        initial_by: Mapping[str, Array],
        values: Array,
        numbers: EntryNumbers,
    ) -> Indices:
        """Strike out readings that contradict the others and repeat them, in place.

        Of two contradicting readings it is unknown which one is wrong: they are repeated in turn.
        """
        operators, observer = self.operators, self.operators.observer
        tolerance = MIN_SLIP_MM + 5e-3 * observer.parallax_um * self.controls.z / self.controls.c
        doubtful, lost = active, active[:0]
        readings = values.shape[1]
        by_names = " and ".join("by'" if projector == 1 else 'by"' for projector in projectors)
        for number in range(MAX_POINTINGS):
            flat = values.reshape(-1, operators.size)[:, doubtful]
            deviations = np.abs(flat - np.median(flat, axis=0))
            worst = deviations.argmax(axis=0) if len(flat) > 2 else np.full(doubtful.size, number % len(flat))
            is_doubtful = deviations.max(axis=0) > tolerance[doubtful]
            doubtful, worst = doubtful[is_doubtful], worst[is_doubtful]
            if not doubtful.size:
                return exclude(operators.remaining(active), lost)
            for i in np.unique(worst // readings):
                is_same_projector = worst // readings == i
                repeating, k = doubtful[is_same_projector], np.zeros(operators.size, dtype=np.intp)
                k[repeating] = worst[is_same_projector] % readings
                value, entry = (np.take_along_axis(array[i], k[None], axis=0)[0] for array in (values, numbers))
                by = f"by{projectors[i]}"
                operators.strike(repeating, entry, f"does not agree with the other readings of {by_names} at {point}")
                errors = operators.redraw_setting_errors(repeating, observer.parallax_um, 1)[0]
                misreadings = operators.redraw_misreadings(repeating, 1)[0]
                cleared = self._clear_with_by(
                    repeating, projectors[i], point, setting_errors, errors, misreadings, initial_by, value, entry
                )
                values[i, k[cleared], cleared], numbers[i, k[cleared], cleared] = value[cleared], entry[cleared]
                lost = np.concatenate([lost, exclude(repeating, cleared)])
                if cleared.size:
                    self._return_elements(cleared, (by,), initial_by)
            doubtful = exclude(doubtful, lost)
        operators.give_up(doubtful, f"{self.controls.model.name}: the readings of {by_names} at {point} do not agree")
        return exclude(operators.remaining(active), lost)

    # --- clearing -------------------------------------------------------------------------------------

    def clear_parallax(
        self,
        active: Indices,
        point: str,
        element: str,
        gain_at: Callable[[Indices, Array], Array],
        tolerance_mm: float = 0.0,
    ) -> ClearedPoint:
        """Clear the y-parallax of a point by turning an element, unless it already appears to be within a limit in mm.

        `gain_at` returns the change of the parallax ``(m,)`` in mm by one unit of the element's counter at positions
        ``(3, m)``. The parallax and the final reading of the element are added to the book.
        """
        operators = self.operators
        setting_errors, error = self._draw_setting_errors(active)
        arrival_parallax_mm, element_change, gain = np.zeros((3, operators.size))
        model_position_mm = np.zeros((3, operators.size))
        fused = self._arrive_at_point(active, point, setting_errors, error, model_position_mm, arrival_parallax_mm)
        disagreement = exclude(operators.remaining(active), fused)
        if not fused.size:
            return ClearedPoint(fused, disagreement, arrival_parallax_mm, model_position_mm, element_change)
        gain[fused] = gain_at(fused, model_position_mm[:, fused])
        turning = fused[np.abs(arrival_parallax_mm[fused]) > tolerance_mm]
        turned = self._turn_until_clear(turning, point, setting_errors, Clearing(element, gain, error), element_change)
        self._tick()
        return ClearedPoint(
            exclude(fused, exclude(turning, turned)),
            disagreement,
            arrival_parallax_mm,
            model_position_mm,
            element_change,
        )

    def look_at_parallaxes(self, active: Indices, points: Sequence[str]) -> Parallaxes:
        """Look at the remaining y-parallax at points, turning only the handwheels."""
        operators = self.operators
        parallax_mm, places = np.zeros((len(points), operators.size)), np.zeros((3, len(points), operators.size))
        disagreement = np.full(operators.size, None, dtype=object)
        for i, point in enumerate(points):
            setting_errors, error = self._draw_setting_errors(active)
            fused = self._arrive_at_point(active, point, setting_errors, error, places[:, i], parallax_mm[i])
            disagreement[exclude(operators.remaining(active), fused)] = point
            active = fused
            if not active.size:
                break
            self._tick()
        return Parallaxes(parallax_mm, places, disagreement)

    def _draw_setting_errors(self, active: Indices) -> tuple[SettingErrors, Array]:
        """Draw the setting errors of one arrival at a point, and the error of its y-parallax ``(sessions,)`` in um."""
        observer = self.operators.observer
        x, y, height, parallax = self.operators.draw_setting_errors(active, 1.0, (4,))
        plan = observer.stereo_um * np.array([x, y])
        return SettingErrors(plan, observer.height_um * height), observer.parallax_um * parallax

    def _arrive_at_point(
        self,
        active: Indices,
        point: str,
        setting_errors: SettingErrors,
        error: Array,
        model_position_mm: Array,
        parallax_mm: Array,
    ) -> Indices:
        """Set the mark on a point; write its position and its apparent y-parallax into the arrays and the book."""
        controls = self.controls
        self._select_point(active, point)
        fused = self.mark.fuse(active, point, setting_errors)
        if fused.size:
            readings = controls.counters(fused)
            model_position_mm[:, fused] = controls.model_position(fused, readings)
            self.pointing.measure_drift(fused, 1, point, readings)
            parallax_mm[fused] = self._apparent_parallax(fused, point, error)
            self.operators.enter(fused, point, "parallax seen", parallax_mm[fused])
        return fused

    def _apparent_parallax(self, active: Indices, point: str, error: Array) -> Array:
        """Return the apparent y-parallax ``(m,)`` in mm."""
        seen = self.mark.view(active, point)[3] + error[active]
        return np.asarray(1e-3 * seen * self.controls.z[active] / self.controls.c)

    def _turn_until_clear(
        self, active: Indices, point: str, setting_errors: SettingErrors, clearing: Clearing, element_change: Array
    ) -> Indices:
        """Turn an element until a point is clear, add its reading to the book, and write the turn into the array."""
        operators, controls, element = self.operators, self.controls, clearing.element
        misreadings = operators.draw_misreadings(active, (1,))[0]
        before = np.zeros(operators.size)
        before[active] = controls.exact_values(active, [element])[element] if active.size else 0.0
        active = self.mark.settle(active, point, setting_errors, clearing) if active.size else active
        if not active.size:
            return active
        operators.spend(active, operators.observer.seconds_to_read, "reading")
        shown = controls.elements(active, [element])[element]
        written = operators.transcribe(active, point, element, shown, misreadings)
        operators.enter(active, point, element, written)
        change = controls.held_position(active, element) - before[active]
        element_change[active] = (
            (wrap_gon(change) if controls.manual.elements[element].endless else change) + written - shown
        )
        controls.read_settings(active)
        controls.give_up_on_errors(active, f"{controls.model.name}: clearing {point} with {element}")
        return operators.remaining(active)

    # --- model coordinates ----------------------------------------------------------------------------

    def measure_points(self, active: Indices, points: Sequence[str]) -> Array:
        """Measure model points stereoscopically, two pointings that agree; X, Y, Z readings ``(3, n, sessions)``.

        A point whose images cannot be fused gets a remark and nan.
        """
        operators, observer, n = self.operators, self.operators.observer, len(points)
        point_errors = operators.draw_setting_errors(active, 1.0, (3, n)) * np.sqrt(1.0 - observer.repeat_share**2)
        pointing_errors = operators.draw_setting_errors(active, 1.0, (3, n, 2)) * observer.repeat_share
        misreadings = operators.draw_misreadings(active, (3, n, 2))
        measured = np.full((3, n, operators.size), np.nan)
        for i, point in enumerate(points):
            active = operators.remaining(active)
            self._select_point(active, point)
            self._measure_point(
                active, point, point_errors[:, i], pointing_errors[:, i], misreadings[:, i], measured[:, i]
            )
            self._tick()
        self.controls.give_up_on_errors(active, f"{self.controls.model.name}: measuring model coordinates")
        return measured

    def _measure_point(
        self, active: Indices, point: str, point_errors: Array, pointing_errors: Array, misreadings: Array, out: Array
    ) -> None:
        """Write the mean of two pointings that agree, or else the median of all, into `out`."""
        operators, observer = self.operators, self.operators.observer
        sigmas = np.array([observer.stereo_um, observer.stereo_um, observer.height_um])[:, None]
        pointings: list[Array] = []
        entries: list[EntryNumbers] = []
        repeating = active
        while len(pointings) < MAX_POINTINGS and repeating.size:
            k = len(pointings)
            if k < 2:
                error, misreading = pointing_errors[:, k], misreadings[:, k]
            else:
                self._strike_pointing(repeating, entries[-2])
                error = operators.redraw_setting_errors(repeating, observer.repeat_share, 3)
                misreading = operators.redraw_misreadings(repeating, 3)
            readings = np.full((3, operators.size), np.nan)
            fused, numbers = self._point_stereoscopically(
                repeating, point, sigmas * (point_errors + error), misreading, readings
            )
            not_fused = exclude(operators.remaining(repeating), fused)
            operators.remark(not_fused, f"point {point}: its two images cannot be fused, not measured")
            pointings.append(readings)
            entries.append(numbers)
            repeating = fused
            if k:
                agreed = fused[self._is_in_agreement(pointings[-2][:, fused], readings[:, fused])]
                out[:, agreed] = (pointings[-2][:, agreed] + readings[:, agreed]) / 2.0
                repeating = exclude(fused, agreed)
        if repeating.size:
            out[:, repeating] = np.median([pointing[:, repeating] for pointing in pointings], axis=0)
        operators.remark(repeating, f"point {point}: no two of {MAX_POINTINGS} pointings agree, median taken")

    def _point_stereoscopically(
        self, active: Indices, point: str, error: Array, misreadings: Array, readings: Array
    ) -> tuple[Indices, EntryNumbers]:
        operators = self.operators
        active = self.mark.fuse(active, point, SettingErrors(error[:2], error[2]))
        numbers = np.zeros((3, operators.size), dtype=np.intp)
        if active.size:
            for axis, name in enumerate("XYZ"):
                readings[axis, active] = self._read(active, point, name, misreadings[axis])
            self.driver.record(active, point)
            for axis, name in enumerate("XYZ"):
                numbers[axis] = operators.enter(active, point, name, readings[axis, active])
        return active, numbers

    def _is_in_agreement(self, first: Array, second: Array) -> npt.NDArray[np.bool_]:
        difference = np.abs(first - second) / self.controls.counter_units_per_mm[:, None]
        return np.asarray((difference <= AGREEMENT_MM + 1e-9).all(axis=0))

    def _strike_pointing(self, active: Indices, numbers: EntryNumbers) -> None:
        for entry_numbers in numbers:
            self.operators.strike(active, entry_numbers, "two pointings differ by more than 0.01 mm")
