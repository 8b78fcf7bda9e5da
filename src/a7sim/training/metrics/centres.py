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

AT_LEVEL = 0.1
"""Units of the Z counter within which a registration belongs to a level."""

AXES = ("X", "Y", "Z")


class _Centres(Metric, frozen=True, kw_only=True):
    """Registrations with an element of the projector, by1 or by2, that identifies the pointing eye; two levels of Z."""

    levels: tuple[float, float]
    points: list[str] = field(default_factory=lambda: list(CASES["A"]))
    elements: list[str] = field(default_factory=lambda: ["by1", "by2"])

    def _pointings(self, record: AttemptRecord, element: str) -> dict[tuple[str, float], list[Reading]]:
        """Return the registrations by point and level, without those of no level."""
        found: dict[tuple[str, float], list[Reading]] = {}
        for reading in record.readings:
            level = next((each for each in self.levels if abs(reading.shown["Z"] - each) <= AT_LEVEL), None)
            if element in reading.named and level is not None:
                found.setdefault((reading.point, level), []).append(reading)
        return found

    def _centre(self, record: AttemptRecord, element: str) -> PerspectiveCentre | None:
        """Return the centre from the student's pointings, None if they are too few or do not move."""
        found = self._pointings(record, element)
        names = [record.name_of(point) for point in self.points]
        whole = [name for name in names if all((name, level) in found for level in self.levels)]
        if len(whole) < MIN_POINTS:
            return None
        low, high = (
            np.array([[fmean(each.shown[axis] for each in found[name, level]) for name in whole] for axis in "XY"])
            for level in self.levels
        )
        try:
            return perspective_centre(low, high, *self.levels)
        except Undetermined:
            return None

    def _centres(self, record: AttemptRecord) -> dict[str, PerspectiveCentre]:
        found = {element: self._centre(record, element) for element in self.elements}
        return {element: centre for element, centre in found.items() if centre is not None}

    def _few(self, there: Mapping[str, object]) -> MetricResult:
        lacking = [
            f"the {'left' if each.endswith('1') else 'right'} one" for each in self.elements if each not in there
        ]
        return MetricResult(None, f"too few points were registered at both levels for a centre: {join_words(lacking)}")


@register_metric("levels-missing")
class MissingLevels(_Centres, frozen=True, kw_only=True):
    """Number of missing registrations: of each point, with each eye, at each level."""

    unit = "registrations"

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        short = []
        for element in self.elements:
            found = self._pointings(record, element)
            for level in self.levels:
                missing = [point for point in self.points if (record.name_of(point), level) not in found]
                short += [(element, level, point) for point in missing]
        wanted = len(self.elements) * len(self.levels) * len(self.points)
        if not short:
            return MetricResult(0.0, "no registration is missing")
        told = join_words(f"{point} with {handle_label(element)} at {level:.0f}" for element, level, point in short)
        return MetricResult(float(len(short)), f"{len(short)} of {pluralize(wanted, 'registration')} missing: {told}")


@register_metric("pointing-rms")
class PointingRms(_Centres, frozen=True, kw_only=True):
    """Displacement of the images from the mark at the registrations: rms of a coordinate, um at photo scale."""

    unit = "um"
    truth = True

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the rms over all registrations at the levels."""
        off: list[float] = []
        worst = (0.0, "")
        for element in self.elements:
            eye = record.model.side_of(int(element[-1]))
            for each in (each for some in self._pointings(record, element).values() for each in some):
                seen = each.eyes[eye - 1]
                if seen is None:
                    side = "left" if eye == 1 else "right"
                    return MetricResult(
                        None, f"where {each.point} was registered with {handle_label(element)} the {side} eye saw none"
                    )
                off += seen
                place = f"{describe_points([each], record)} with {handle_label(element)} at {each.shown['Z']:.0f}"
                worst = max(worst, (math.hypot(*seen), place))
        if not off:
            return MetricResult(None, "nothing was registered at the levels")
        rms = math.sqrt(fmean(each**2 for each in off))
        told = f"over {pluralize(len(off) // 2, 'pointing')} the images stood {rms:.1f} um (rms) beside the mark, "
        told += f"most of all by {worst[0]:.0f} um at {worst[1]}"
        return MetricResult(round(rms, 2), told)

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye."""
        return BEST_POINTING_UM


@register_metric("pointings-apart")
class PointingDisagreement(_Centres, frozen=True, kw_only=True):
    """Distance of the student's pointings from a common centre: the larger rms of both centres, mm at their height."""

    unit = "mm"

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the rms."""
        centres = self._centres(record)
        if len(centres) < len(self.elements):
            return self._few(centres)
        element = max(centres, key=lambda each: float(centres[each].rms))
        rms = float(centres[element].rms)
        side = "left" if element.endswith("1") else "right"
        return MetricResult(round(rms, 4), f"the lines to the {side} centre miss each other, rms {rms:.3f}")

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


class _Answered(_Centres, frozen=True, kw_only=True):
    """Largest difference of answered coordinates, such as x1 and x2, over some axes."""

    unit = "counter units"
    truth = True
    axes: list[str] = field(default_factory=lambda: ["X", "Y"])

    def _against(self, record: AttemptRecord, right: Mapping[str, Mapping[str, float]], rightly: str) -> MetricResult:
        off: list[tuple[float, str]] = []
        for element, coordinates in right.items():
            for axis in self.axes:
                key = f"{axis.lower()}{element[-1]}"
                try:
                    number = float(record.answers.get(key, ""))
                except ValueError:
                    return MetricResult(None, f"{key}: expected a number, got {record.answers.get(key) or 'no answer'}")
                by = abs(number - coordinates[axis])
                off.append((by, f"{key} was answered {number:.2f}, {rightly} {by:.2f} off"))
        value, told = max(off)
        return MetricResult(round(value, 4) if math.isfinite(value) else None, told)


@register_metric("centre-sums-off")
class CentreComputationDeviation(_Answered, frozen=True, kw_only=True):
    """Largest difference of answered coordinates from those that follow from the student's registrations."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        centres = self._centres(record)
        if len(centres) < len(self.elements):
            return self._few(centres)
        right = {
            element: {axis: float(getattr(centre, f"{axis}0")) for axis in AXES} for element, centre in centres.items()
        }
        return self._against(record, right, "by your own registrations")

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@register_metric("centre-off")
class CentreDeviation(_Answered, frozen=True, kw_only=True):
    """Largest difference of answered coordinates from the true centres, in counter units."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference; counters are as at the registrations."""
        readings = {element: self._pointings(record, element) for element in self.elements}
        if not all(readings.values()):
            return self._few({element: each for element, each in readings.items() if each})
        right = {element: self._truly(record, element, found) for element, found in readings.items()}
        return self._against(record, right, "by the truth")

    def _truly(
        self, record: AttemptRecord, element: str, found: Mapping[tuple[str, float], list[Reading]]
    ) -> dict[str, float]:
        autograph = record.autograph
        centre = autograph.readings_at(autograph.pose(int(element[-1]))[0])
        every = [each for some in found.values() for each in some]
        counted = [(each.shown, autograph.readings_at(np.array(each.mark))) for each in every]
        return {axis: centre[axis] + fmean(shown[axis] - now[axis] for shown, now in counted) for axis in AXES}

    def floor(self, scenario: Scenario) -> float:
        """Return the largest standard deviation of these coordinates for the best eye."""
        sigmas = sigmas_of_centre(scenario, self.levels, BEST_POINTING_UM)
        return max(sigmas[axis] for axis in self.axes)
