"""Metrics of models compared with the ground and with each other:

heights, distances, transfer of scale, unchanged elements.
"""

import math
from bisect import bisect_left
from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
from msgspec import field

from a7sim.geometry import Array, length_of
from a7sim.scenario import ModelPlan, Scenario
from a7sim.text import pluralize
from a7sim.training.action_log import AXES, MOVEMENTS, Reading, StudentAction
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.metrics.base import (
    BEST_HEIGHT_UM,
    BEST_PARALLAX_UM,
    BEST_POINTING_UM,
    HALF_A_COUNT,
    Metric,
    MetricResult,
    handle_label,
    join_words,
    register_metric,
)

PLAN_AXES = ("X", "Y")

MIN_ARRIVAL = 2.0
"""Counter units by which a carriage moves when the mark is brought to a point, and not when it is set on it."""

READINGS_PER_POINT = 2
"""Number of registrations of a point that form its reading: a point is measured twice."""


def last_readings(record: AttemptRecord, points: Iterable[str], base: str = "") -> dict[str, list[Reading]]:
    """Return the last two pointings at points, with a base mode if given; points without any are left out."""
    by_point = {}
    for point in points:
        name = record.name_of(point)
        readings = pointings(record, name, base)
        if readings:
            by_point[name] = readings[-READINGS_PER_POINT:]
    return by_point


def pointings(record: AttemptRecord, name: str, base: str = "") -> list[Reading]:
    """Return the registrations of a point's coordinates, without readings of an element just turned there."""
    actions = [each for each in record.actions if each.kind in MOVEMENTS]
    readings = [each for each in record.readings if each.point == name and base in ("", each.base)]
    return [each for each in readings if not _is_turned_at_point(actions, each)]


def _is_turned_at_point(actions: Sequence[StudentAction], reading: Reading) -> bool:
    """Return whether a registered element was turned after the mark had reached the point.

    The console registers the element in hand with each reading, so its name alone is no indication.
    """
    for action in reversed(actions[: bisect_left(actions, reading.action_index, key=lambda each: each.index)]):
        if action.name in reading.elements:
            return True
        if action.name in PLAN_AXES and abs(action.after - action.before) >= MIN_ARRIVAL:
            return False
    return False


def mean_display(readings: Sequence[Reading]) -> Array:
    """Return the mean readings of the X, Y and Z counters ``(3,)``."""
    return np.asarray(np.mean([[each.counters[axis] for axis in AXES] for each in readings], axis=0))


def height_floor_um(scenario: Scenario) -> float:
    """Return the x-parallax error of the best eye, including the film's irregular deformation in both pictures."""
    film = math.hypot(scenario.film.irregular_um, scenario.film.identification_um)
    return math.hypot(BEST_HEIGHT_UM, math.sqrt(2.0) * film)


def metres_per_um(scenario: Scenario, scale_number: float) -> float:
    """Return the change of height by a micrometre of x-parallax at photo scale, m on the ground."""
    plan, c = scenario.plan, scenario.camera.c
    return 1e-6 * scale_number * plan.projection_height / c * plan.projection_height / plan.bx


@register_metric("missing-pointings")
class MissingPointings(Metric, frozen=True, kw_only=True):
    """Number of missing pointings: a required number at each point, with each of some base modes."""

    unit = "registrations"
    points: list[str]
    each: int = 1
    bases: list[str] = field(default_factory=lambda: [""])

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        missing = {
            f"{point}{f' with base {base}' if base else ''}": self.each
            - len(pointings(record, record.name_of(point), base))
            for base in self.bases
            for point in self.points
        }
        missing = {place: count for place, count in missing.items() if count > 0}
        total, wanted = sum(missing.values()), len(self.points) * self.each * len(self.bases)
        if not total:
            return MetricResult(0.0, "no registration is missing")
        return MetricResult(
            float(total), f"{total} of {pluralize(wanted, 'registration')} missing: {join_words(missing)}"
        )


@register_metric("heights-off")
class HeightDeviation(Metric, frozen=True, kw_only=True):
    """Difference of heights by the Z counter from the ground: rms or the largest, m."""

    unit = "m"
    truth = True
    points: list[str]
    scale_number: float
    """Of the model, by which the counter reads metres."""
    largest: bool = False

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the deviation by the last two registrations of each point."""
        readings = last_readings(record, self.points)
        missing = [point for point in self.points if record.name_of(point) not in readings]
        if missing:
            return MetricResult(None, f"nothing was registered at {join_words(missing)}")
        truth = record.scene.ground_points
        deviations = {name: float(mean_display(group)[2] - truth[name][2]) for name, group in readings.items()}
        worst = max(deviations, key=lambda name: abs(deviations[name]))
        rms = math.sqrt(sum(each**2 for each in deviations.values()) / len(deviations))
        message = f"heights are off by {rms:.2f} m (rms), the largest {deviations[worst]:+.2f} m at {worst}"
        return MetricResult(round(abs(deviations[worst]) if self.largest else rms, 4), message)

    def floor(self, scenario: Scenario) -> float:
        """Return the errors of the best eye and the film, and half a count."""
        return height_floor_um(scenario) * metres_per_um(scenario, self.scale_number)


@register_metric("distances-off")
class DistanceDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference in per mille of distances in plan by the counters from the ground."""

    unit = "per mille"
    truth = True
    points: list[str]
    scale_number: float
    shortest_m: float = 500.0
    """Shorter distances hardly determine the scale."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the mean over all pairs, by the last two registrations of each point."""
        readings = last_readings(record, self.points)
        truth = record.scene.ground_points
        metres = 1e-3 * self.scale_number / record.autograph.variant.scales["X"].units_per_mm
        shares = []
        for first, second in combinations(readings, 2):
            true = float(length_of((truth[second] - truth[first])[:2]))
            if true >= self.shortest_m:
                difference = mean_display(readings[second]) - mean_display(readings[first])
                shares.append(metres * float(length_of(difference[:2])) / true - 1.0)
        if not shares:
            return MetricResult(None, f"expected two registered points of {join_words(self.points)}, got fewer")
        share = 1e3 * sum(shares) / len(shares)
        message = f"the model is {abs(share):.2f} per mille too {'large' if share > 0 else 'small'}"
        return MetricResult(round(abs(share), 4), message)

    def floor(self, scenario: Scenario) -> float:
        """Return the error of two pointings over the width of the model."""
        film = math.hypot(scenario.film.irregular_um, scenario.film.identification_um)
        um = math.sqrt(2.0) * math.hypot(BEST_POINTING_UM, film)
        return um / (1.5 * scenario.plan.half_width)


def element_at(record: AttemptRecord, name: str, index: int) -> float:
    """Return the position of an element before an action."""
    moved = [each for each in record.action_log.actions if each.kind in ("set", "turn") and each.name == name]
    before = [each.after for each in moved if each.index < index]
    later = [each.before for each in moved if each.index >= index]
    return before[-1] if before else later[0] if later else record.autograph.element(name)


def change_of_base(record: AttemptRecord, mode: str) -> StudentAction | None:
    """Return the student's last action that changed the base to a mode, None if there is none."""
    changes = [each for each in record.actions if each.kind == "base" and each.text == mode]
    return changes[-1] if changes else None


@register_metric("moved-since")
class ElementChange(Metric, frozen=True, kw_only=True):
    """Largest difference of elements from their positions at the change of base, mm or gon."""

    unit = "mm or gon"
    elements: list[str]
    base: str = "outside"
    """Base mode after the change."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        change = change_of_base(record, self.base)
        if change is None:
            return MetricResult(None, f"expected the base to be changed to {self.base}, got no change")
        moved = {}
        for name in self.elements:
            deviation = record.autograph.element(name) - element_at(record, name, change.index)
            moved[name] = abs((deviation + 200.0) % 400.0 - 200.0) if name.startswith("kappa") else abs(deviation)
        worst = max(moved, key=lambda name: moved[name])
        movements = [f"{handle_label(name)} by {amount:.2f}" for name, amount in moved.items() if amount > HALF_A_COUNT]
        return MetricResult(round(moved[worst], 4), f"moved since the change of base: {join_words(movements)}")

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@register_metric("ties-apart")
class TiePointDisagreement(Metric, frozen=True, kw_only=True):
    """Largest difference of a counter between the readings of common points in two models, mm.

    The two models are the one with base in and the one with base out.
    """

    unit = "mm"
    points: list[str]
    axes: list[str] = field(default_factory=lambda: list(AXES))

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference by the last two registrations of each point in either model."""
        inside, outside = (last_readings(record, self.points, base) for base in ("inside", "outside"))
        missing = [point for point in self.points if record.name_of(point) not in inside.keys() & outside.keys()]
        if missing:
            return MetricResult(None, f"not registered both with base in and with base out: {join_words(missing)}")
        units = {"Z": record.autograph.z_units_per_mm}
        differences = []
        for name, readings in inside.items():
            difference = mean_display(outside[name]) - mean_display(readings)
            for axis, amount in zip(AXES, difference.tolist(), strict=True):
                if axis in self.axes:
                    mm = amount / units.get(axis, 1.0)
                    differences.append((abs(mm), f"{axis} at {name} differs by {mm:+.3f} mm from the first model"))
        worst, message = max(differences)
        return MetricResult(round(worst, 4), message)

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye in heights of two models."""
        plan = scenario.plan
        um = math.sqrt(2.0) * height_floor_um(scenario)
        return 1e-3 * um * plan.projection_height / scenario.camera.c * plan.projection_height / plan.bx


@register_metric("scale-not-carried")
class ScaleTransferDeviation(Metric, frozen=True, kw_only=True):
    """Difference of the second model's scale from the first's, per mille: by the bases, compared with the flight."""

    unit = "per mille"
    truth = True
    first: str = "1"
    base: str = "outside"

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        change = change_of_base(record, self.base)
        if change is None:
            return MetricResult(None, f"expected the base to be changed to {self.base}, got no change")
        models = {each.name: each for each in record.scenario.models}
        before = self._scale(record, models[self.first], change.index)
        after = self._scale(record, models[record.model.name], record.action_log.actions[-1].index + 1)
        share = 1e3 * (after / before - 1.0)
        message = (
            f"the second model is {abs(share):.2f} per mille {'larger' if share > 0 else 'smaller'} than the first"
        )
        return MetricResult(round(abs(share), 4), message)

    def _scale(self, record: AttemptRecord, model: ModelPlan, index: int) -> float:
        elements = {
            name: element_at(record, name, index)
            for name in ("bx", "by1", "by2", "bz1", "bz2")
            if name in record.autograph.variant.elements
        }
        base = np.array(
            [
                elements["bx"],
                elements.get("by1", 0.0) - elements.get("by2", 0.0),
                elements.get("bz1", 0.0) - elements.get("bz2", 0.0),
            ]
        )
        stations = record.scene.stations
        return float(length_of(base) / length_of(stations[model.right].centre - stations[model.left].centre))

    def floor(self, scenario: Scenario) -> float:
        """Return the error of phi of both photographs in both models due to y-parallaxes in the outer rows (T 2.32)."""
        plan, c = scenario.plan, scenario.camera.c
        film = math.hypot(scenario.film.irregular_um, scenario.film.identification_um)
        parallax = math.hypot(BEST_PARALLAX_UM, math.sqrt(2.0) * film)
        base = plan.bx * c / plan.projection_height
        tilt = parallax / (base * plan.half_width / c) / math.sqrt(2.0)
        return 2.0 * c * tilt / base
