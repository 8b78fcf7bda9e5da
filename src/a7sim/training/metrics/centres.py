"""Metrics of perspective centres by two levels of Z: pointings, computations, and positions of the centres."""

import math
from collections.abc import Mapping
from statistics import fmean

import numpy as np
from msgspec import field

from a7sim.geometry import Array
from a7sim.reduction import PerspectiveCentre, Undetermined, perspective_centre
from a7sim.scenario import Scenario
from a7sim.standard_points import CASES, PLACES
from a7sim.text import pluralize
from a7sim.training.action_log import Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.metrics.base import (
    BEST_POINTING_UM,
    HALF_A_COUNT,
    Metric,
    MetricResult,
    describe_points,
    handle_label,
    join_words,
    register_metric,
)

MIN_POINTS = 3

LEVEL_TOLERANCE = 0.1
"""Units of the Z counter within which a registration belongs to a level."""

AXES = ("X", "Y", "Z")


class _CentreMetric(Metric, frozen=True, kw_only=True):
    """Registrations with an element of the projector, by1 or by2, that identifies the pointing eye; two levels of Z."""

    levels: tuple[float, float]
    points: list[str] = field(default_factory=lambda: list(CASES["A"]))
    elements: list[str] = field(default_factory=lambda: ["by1", "by2"])

    def _pointings(self, record: AttemptRecord, element: str) -> dict[tuple[str, float], list[Reading]]:
        """Return the registrations by point and level, without those of no level."""
        pointings: dict[tuple[str, float], list[Reading]] = {}
        for reading in record.readings:
            level = next((each for each in self.levels if abs(reading.counters["Z"] - each) <= LEVEL_TOLERANCE), None)
            if element in reading.elements and level is not None:
                pointings.setdefault((reading.point, level), []).append(reading)
        return pointings

    def _centre(self, record: AttemptRecord, element: str) -> PerspectiveCentre | None:
        """Return the centre from the student's pointings, None if they are too few or do not move."""
        pointings = self._pointings(record, element)
        names = [record.name_of(point) for point in self.points]
        complete = [name for name in names if all((name, level) in pointings for level in self.levels)]
        if len(complete) < MIN_POINTS:
            return None
        low, high = (
            np.array(
                [[fmean(each.counters[axis] for each in pointings[name, level]) for name in complete] for axis in "XY"]
            )
            for level in self.levels
        )
        try:
            return perspective_centre(low, high, *self.levels)
        except Undetermined:
            return None

    def _centres(self, record: AttemptRecord) -> dict[str, PerspectiveCentre]:
        centres = {element: self._centre(record, element) for element in self.elements}
        return {element: centre for element, centre in centres.items() if centre is not None}

    def _too_few(self, determined: Mapping[str, object]) -> MetricResult:
        missing = [
            f"the {'left' if each.endswith('1') else 'right'} centre"
            for each in self.elements
            if each not in determined
        ]
        return MetricResult(
            None, f"expected more points registered at both levels, got too few for {join_words(missing)}"
        )


@register_metric("levels-missing")
class MissingLevels(_CentreMetric, frozen=True, kw_only=True):
    """Number of missing registrations: of each point, with each eye, at each level."""

    unit = "registrations"

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        gaps = []
        for element in self.elements:
            pointings = self._pointings(record, element)
            for level in self.levels:
                missing = [point for point in self.points if (record.name_of(point), level) not in pointings]
                gaps += [(element, level, point) for point in missing]
        wanted = len(self.elements) * len(self.levels) * len(self.points)
        if not gaps:
            return MetricResult(0.0, "no registration is missing")
        listing = join_words(f"{point} with {handle_label(element)} at {level:.0f}" for element, level, point in gaps)
        return MetricResult(float(len(gaps)), f"{len(gaps)} of {pluralize(wanted, 'registration')} missing: {listing}")


@register_metric("pointing-rms")
class PointingRms(_CentreMetric, frozen=True, kw_only=True):
    """Displacement of the images from the mark at the registrations: rms of a coordinate, um at photo scale."""

    unit = "um"
    truth = True

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the rms over all registrations at the levels."""
        deviations: list[float] = []
        worst = (0.0, "")
        for element in self.elements:
            eye = record.model.side_of(int(element[-1]))
            for each in (each for readings in self._pointings(record, element).values() for each in readings):
                offsets = each.eyes[eye - 1]
                if offsets is None:
                    side = "left" if eye == 1 else "right"
                    return MetricResult(
                        None,
                        f"{each.point} was registered with {handle_label(element)} outside the view of the {side} eye",
                    )
                deviations += offsets
                pointing = f"{describe_points([each], record)} with {handle_label(element)} at {each.counters['Z']:.0f}"
                worst = max(worst, (math.hypot(*offsets), pointing))
        if not deviations:
            return MetricResult(None, "nothing was registered at the levels")
        rms = math.sqrt(fmean(each**2 for each in deviations))
        message = f"{pluralize(len(deviations) // 2, 'pointing')}: images {rms:.1f} um (rms) from the mark, "
        message += f"the largest distance {worst[0]:.0f} um at {worst[1]}"
        return MetricResult(round(rms, 2), message)

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye."""
        return BEST_POINTING_UM


@register_metric("pointings-apart")
class PointingDisagreement(_CentreMetric, frozen=True, kw_only=True):
    """Distance of the student's pointings from a common centre: the larger rms of both centres, mm at their height."""

    unit = "mm"

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the rms."""
        centres = self._centres(record)
        if len(centres) < len(self.elements):
            return self._too_few(centres)
        element = max(centres, key=lambda each: float(centres[each].rms))
        rms = float(centres[element].rms)
        side = "left" if element.endswith("1") else "right"
        return MetricResult(round(rms, 4), f"the pointings to the {side} centre disagree by {rms:.3f} mm (rms)")

    def floor(self, scenario: Scenario) -> float:
        """Return the rms for the best eye."""
        return rms_of_pointings(scenario, self.levels, BEST_POINTING_UM)


def rms_of_pointings(scenario: Scenario, levels: tuple[float, float], pointing_um: float) -> float:
    """Return the standard deviation of an observation equation, mm, for pointings at photo scale."""
    plan = scenario.plan
    at_model = 1e-3 * pointing_um * plan.projection_height / scenario.camera.c
    units = plan.height_gear if isinstance(plan.height_gear, float) else 1.0
    T0 = (units * plan.projection_height + plan.preset[2] - levels[0]) / (levels[1] - levels[0])
    return at_model * math.hypot(T0, 1.0 - T0)


def sigmas_of_centre(scenario: Scenario, levels: tuple[float, float], pointing_um: float) -> dict[str, float]:
    """Return the standard deviations of X0, Y0 (mm) and Z0 (counter units) from points 1 to 6, whichever is larger."""
    plan = scenario.plan
    units = plan.height_gear if isinstance(plan.height_gear, float) else 1.0
    width = plan.half_width * plan.projection_height / scenario.camera.c
    places = np.array([PLACES[label] for label in CASES["A"]]).T * np.array([plan.bx, width])[:, None]
    shift: Array = -places * (levels[1] - levels[0]) / (units * plan.projection_height)
    spread = float(((shift - shift.mean(axis=1, keepdims=True)) ** 2).sum())
    s0 = rms_of_pointings(scenario, levels, pointing_um)
    x, y = (s0 * math.sqrt(1.0 / len(CASES["A"]) + float(each.mean()) ** 2 / spread) for each in shift)
    return {"X": x, "Y": y, "Z": s0 * abs(levels[1] - levels[0]) / math.sqrt(spread)}


class _CentreAnswerMetric(_CentreMetric, frozen=True, kw_only=True):
    """Largest difference of answered coordinates, such as x1 and x2, over some axes."""

    unit = "counter units"
    truth = True
    axes: list[str] = field(default_factory=lambda: ["X", "Y"])

    def _compare(self, record: AttemptRecord, expected: Mapping[str, Mapping[str, float]], source: str) -> MetricResult:
        deviations: list[tuple[float, str]] = []
        for element, coordinates in expected.items():
            for axis in self.axes:
                key = f"{axis.lower()}{element[-1]}"
                try:
                    number = float(record.answers.get(key, ""))
                except ValueError:
                    return MetricResult(None, f"{key}: expected a number, got {record.answers.get(key) or 'no answer'}")
                deviation = abs(number - coordinates[axis])
                deviations.append((deviation, f"{key} was answered {number:.2f}, {deviation:.2f} off {source}"))
        value, message = max(deviations)
        return MetricResult(round(value, 4) if math.isfinite(value) else None, message)


@register_metric("centre-sums-off")
class CentreComputationDeviation(_CentreAnswerMetric, frozen=True, kw_only=True):
    """Largest difference of answered coordinates from those that follow from the student's registrations."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        centres = self._centres(record)
        if len(centres) < len(self.elements):
            return self._too_few(centres)
        expected = {
            element: {axis: float(getattr(centre, f"{axis}0")) for axis in AXES} for element, centre in centres.items()
        }
        return self._compare(record, expected, "your registrations")

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@register_metric("centre-off")
class CentreDeviation(_CentreAnswerMetric, frozen=True, kw_only=True):
    """Largest difference of answered coordinates from the true centres, in counter units."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference; counters are as at the registrations."""
        readings = {element: self._pointings(record, element) for element in self.elements}
        if not all(readings.values()):
            return self._too_few({element: each for element, each in readings.items() if each})
        expected = {element: self._true_centre(record, element, pointings) for element, pointings in readings.items()}
        return self._compare(record, expected, "the truth")

    def _true_centre(
        self, record: AttemptRecord, element: str, pointings: Mapping[tuple[str, float], list[Reading]]
    ) -> dict[str, float]:
        autograph = record.autograph
        centre = autograph.readings_at(autograph.pose(int(element[-1]))[0])
        registrations = [each for group in pointings.values() for each in group]
        readings = [(each.counters, autograph.readings_at(np.array(each.mark))) for each in registrations]
        return {axis: centre[axis] + fmean(shown[axis] - now[axis] for shown, now in readings) for axis in AXES}

    def floor(self, scenario: Scenario) -> float:
        """Return the largest standard deviation of these coordinates for the best eye."""
        sigmas = sigmas_of_centre(scenario, self.levels, BEST_POINTING_UM)
        return max(sigmas[axis] for axis in self.axes)
