"""Metrics of results, by the truth that never crosses the link."""

import math

import numpy as np
from msgspec import field

from a7sim.geometry import GON, Array, plane_rotation
from a7sim.scenario import Scenario
from a7sim.standard_points import CASES
from a7sim.training.action_log import LoggedAutograph, Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.metrics.base import (
    BEST_FIDUCIAL_UM,
    BEST_HEIGHT_UM,
    BEST_PARALLAX_UM,
    BEST_POINTING_UM,
    HALF_A_COUNT,
    MAX_OF_SEVERAL,
    Metric,
    MetricResult,
    describe_points,
    handle_label,
    join_words,
    register_metric,
)

MAX_STEPS = 20


def half_a_count_um(scenario: Scenario) -> float:
    """Return half a count of by at photo scale."""
    plan = scenario.plan
    return 1e3 * HALF_A_COUNT * scenario.camera.c / plan.projection_height


class MaxAtReadings(Metric, frozen=True, kw_only=True):
    """Largest value of a quantity at the registrations, in um at photo scale."""

    unit = "um"
    truth = True
    elements: list[str] = field(default_factory=list)
    """Only where one of these was registered."""
    points: list[str] = field(default_factory=list)

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the value."""
        names = [record.name_of(point) for point in self.points]
        readings = [
            each
            for each in record.readings
            if (not self.elements or set(self.elements) & set(each.elements)) and (not names or each.point in names)
        ]
        if not readings:
            return MetricResult(None, "nothing was registered")
        unseen = [each for each in readings if self._value_um(each) is None]
        if unseen:
            return MetricResult(None, f"at {describe_points(unseen, record)} the point was not in view")
        worst = max(readings, key=lambda each: self._value_um(each) or 0.0)
        value = self._value_um(worst) or 0.0
        elements = f" with {join_words(map(handle_label, worst.elements))}" if worst.elements else ""
        return MetricResult(
            round(value, 1), f"{self._description(value)} at {describe_points([worst], record)}{elements}"
        )

    def _value_um(self, reading: Reading) -> float | None:
        raise NotImplementedError

    def _description(self, value: float) -> str:
        raise NotImplementedError


@register_metric("parallax-left")
class RemainingParallax(MaxAtReadings, frozen=True, kw_only=True):
    """Largest y-parallax at a registration, um at photo scale."""

    def _value_um(self, reading: Reading) -> float | None:
        return None if reading.stereo is None else abs(reading.stereo[1])

    def _description(self, value: float) -> str:
        return f"the largest remaining y-parallax was {value:.0f} um at photo scale,"

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye, and half a count."""
        return math.hypot(MAX_OF_SEVERAL * BEST_PARALLAX_UM, half_a_count_um(scenario))


@register_metric("off-the-ground")
class HeightParallax(MaxAtReadings, frozen=True, kw_only=True):
    """Largest x-parallax at a registration: the mark was above or below the ground, um."""

    def _value_um(self, reading: Reading) -> float | None:
        return None if reading.stereo is None else abs(reading.stereo[0])

    def _description(self, value: float) -> str:
        return f"the mark was off the ground by an x-parallax of {value:.0f} um"

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye."""
        return MAX_OF_SEVERAL * BEST_HEIGHT_UM


@register_metric("beside-the-point")
class PlanDeviation(MaxAtReadings, frozen=True, kw_only=True):
    """Largest distance of the mark from the point in plan at a registration, um at photo scale."""

    eye: int = 0
    """Of one eye; 0 for the mean of both."""

    def _value_um(self, reading: Reading) -> float | None:
        eyes = [reading.eyes[self.eye - 1]] if self.eye else list(reading.eyes)
        offsets = [each for each in eyes if each is not None]
        if len(offsets) < len(eyes):
            return None
        return math.hypot(sum(x for x, _ in offsets) / len(offsets), sum(y for _, y in offsets) / len(offsets))

    def _description(self, value: float) -> str:
        return f"the mark was {value:.0f} um from the point"

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye, and the least count of both wheels."""
        return MAX_OF_SEVERAL * BEST_POINTING_UM


def y_parallax_at(record: AttemptRecord, point: str) -> float | None:
    """Return the y-parallax in um at photo scale of a point as the projectors are set, None if it is on no picture.

    It is the view of both eyes with the mark on the ground there.
    """
    autograph, model = record.autograph, record.model
    images = []
    for projector in (model.left_projector, model.right_projector):
        if autograph.loaded(projector) is None:
            return None
        position = autograph.carrier(projector).point(point)
        if position is None:
            return None
        images.append((projector, position))
    mark = np.array([record.scenario.plan.bx / 2.0, 0.0, -record.scenario.plan.projection_height])
    for _ in range(MAX_STEPS):
        displacements = _displacements(autograph, images, mark)
        slopes = np.array([_displacements(autograph, images, mark + step) - displacements for step in np.eye(3)]).T
        change = np.linalg.solve(slopes[:3], -displacements[:3])
        mark = mark + change
        if np.abs(change).max() < 1e-6:
            break
    return float(1e3 * _displacements(autograph, images, mark)[3])


def _displacements(autograph: LoggedAutograph, images: list[tuple[int, Array]], mark: Array) -> Array:
    """Return the displacements of images from a mark ``(4,)`` in mm at photo scale: mean x and y, px, py."""
    offsets = []
    for projector, position in images:
        swing = plane_rotation(autograph.element(f"kappa{projector}") * GON)
        offsets.append(swing @ (position - autograph.on_carrier(projector, mark)))
    (x1, y1), (x2, y2) = offsets
    return np.array([(x1 + x2) / 2.0, (y1 + y2) / 2.0, x1 - x2, y1 - y2])


@register_metric("residual-parallax")
class ResidualParallax(Metric, frozen=True, kw_only=True):
    """Final y-parallax at the standard points: rms, or the largest, um at photo scale."""

    unit = "um"
    truth = True
    points: list[str] = field(default_factory=lambda: list(CASES["A"]))
    largest: bool = False

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the y-parallax."""
        names = {point: record.name_of(point) for point in self.points if point in record.model.standard_points}
        parallaxes = {point: y_parallax_at(record, name) for point, name in names.items()}
        visible = {point: value for point, value in parallaxes.items() if value is not None}
        if len(visible) < len(parallaxes) or not visible:
            return MetricResult(None, "expected the pictures of the model in their projectors, got others")
        worst = max(visible, key=lambda point: abs(visible[point]))
        rms = math.sqrt(sum(each**2 for each in visible.values()) / len(visible))
        message = f"y-parallaxes of {rms:.0f} um (rms) are left, the largest {visible[worst]:+.0f} um at point {worst}"
        return MetricResult(round(abs(visible[worst]) if self.largest else rms, 1), message)

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye, the film's irregular deformation, and half a count."""
        film = math.sqrt(2.0) * math.hypot(scenario.film.irregular_um, scenario.film.identification_um)
        rms = math.hypot(BEST_PARALLAX_UM, half_a_count_um(scenario), film)
        return MAX_OF_SEVERAL * rms if self.largest else rms


@register_metric("picture-off-centre")
class CentringDeviation(Metric, frozen=True, kw_only=True):
    """Displacement of pictures from centred: the largest remaining shift or, at the fiducials, rotation, mm."""

    unit = "mm"
    truth = True
    projectors: list[int] = field(default_factory=lambda: [1, 2])

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the displacement."""
        deviations: list[tuple[float, str]] = []
        for projector in self.projectors:
            name = record.autograph.loaded(projector)
            if name is None or name not in record.scene.photographs:
                return MetricResult(None, f"expected a photograph in projector {projector}, got none")
            shift, rotation, _ = _mounting_error(record, projector)
            deviations.append((shift, f"{name} is {shift:.3f} mm off the principal point"))
            deviations.append((rotation, f"{name} is rotated by {rotation:.3f} mm at its fiducials"))
        value, message = max(deviations)
        return MetricResult(round(value, 4), message)

    def floor(self, scenario: Scenario) -> float:
        """Return the precision of the mean of four fiducials."""
        return 1e-3 * MAX_OF_SEVERAL * BEST_FIDUCIAL_UM / 2.0


def _mounting_error(record: AttemptRecord, projector: int) -> tuple[float, float, float]:
    """Return shift and rotation in mm of a picture, and the change of size of its film."""
    camera = record.scenario.camera
    displacements = record.autograph.carrier(projector).fiducial_displacements()
    positions = {each.name: (each.x, each.y) for each in camera.fiducials}
    xy = np.array([positions[name] for name, _, _ in displacements]).T
    d = np.array([(dx, dy) for _, dx, dy in displacements]).T
    centred = xy - xy.mean(axis=1, keepdims=True)
    squares = float((centred**2).sum())
    turn = float((centred[0] * d[1] - centred[1] * d[0]).sum()) / squares
    scale = float((centred * d).sum()) / squares
    shift = d.mean(axis=1) + np.array(camera.principal_point)
    return float(np.hypot(*shift)), abs(turn) * float(np.abs(xy).max()), scale


@register_metric("principal-distance-off")
class PrincipalDistanceDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference of a principal distance from that of the camera for the shrunk film, mm."""

    unit = "mm"
    truth = True
    projectors: list[int] = field(default_factory=lambda: [1, 2])

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        deviations: list[tuple[float, str]] = []
        for projector in self.projectors:
            if record.autograph.loaded(projector) is None:
                return MetricResult(None, f"expected a photograph in projector {projector}, got none")
            wanted = record.scenario.camera.c * (1.0 + _mounting_error(record, projector)[2])
            shown = record.autograph.element(f"c{projector}")
            side = "long" if shown > wanted else "short"
            message = (
                f"{handle_label(f'c{projector}')} reads {shown:.2f}: {abs(shown - wanted):.3f} mm too {side} "
                "for the film"
            )
            deviations.append((abs(shown - wanted), message))
        value, message = max(deviations)
        return MetricResult(round(value, 4), message)

    def floor(self, scenario: Scenario) -> float:
        """Return half a count, and the precision of a scale from four fiducials."""
        reach = max(abs(each.x) for each in scenario.camera.fiducials)
        return HALF_A_COUNT + 1e-3 * BEST_FIDUCIAL_UM / math.sqrt(8.0) * scenario.camera.c / reach
