"""Metrics of a grid test: pointings at crosses, levels, and errors of the projectors."""

import math

from msgspec import field

from a7sim.scenario import Scenario
from a7sim.session.grid_test import true_errors
from a7sim.training.action_log import Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.metrics.base import (
    BEST_POINTING_UM,
    HALF_A_COUNT,
    MAX_OF_SEVERAL,
    Metric,
    MetricResult,
    join_words,
    register_metric,
)
from a7sim.training.metrics.truth import MaxAtReadings


@register_metric("cross-missed")
class CrossDistance(MaxAtReadings, frozen=True, kw_only=True):
    """Largest distance of the mark from a point at a registration, in the pointing eye, um."""

    def _value_um(self, reading: Reading) -> float | None:
        offsets = [each for each in reading.eyes if each is not None]
        return min(math.hypot(x, y) for x, y in offsets) if offsets else None

    def _description(self, value: float) -> str:
        return f"the mark was {value:.0f} um from the cross"

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye, and half a count of both wheels at the highest level."""
        count = 1e3 * HALF_A_COUNT * math.sqrt(2.0) * scenario.camera.c / scenario.plan.projection_height
        return math.hypot(MAX_OF_SEVERAL * BEST_POINTING_UM, count)


@register_metric("levels-near")
class LevelDepthRatio(Metric, frozen=True, kw_only=True):
    """Depth of the highest level of pointings below the centres as a share of that of the lowest."""

    points: list[str]

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the ratio by the Z counter, which counts mm from the base line in a grid test."""
        names = [record.name_of(point) for point in self.points]
        depths = [-each.mark[2] for each in record.readings if each.point in names]
        if not depths:
            return MetricResult(None, f"nothing was registered at {join_words(self.points)}")
        high, low = min(depths), max(depths)
        return MetricResult(round(high / low, 3), f"pointed at from {high:.0f} to {low:.0f} mm below the centre")


@register_metric("errors-answered")
class AnsweredErrorDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference of answered errors of elements, such as c1 or phi2, from the true ones."""

    unit = "mm or gon"
    truth = True
    elements: list[str] = field(default_factory=lambda: ["c1", "c2"])
    local_um: float = 10.0
    """Of the local errors of the projector, which a few crosses cannot separate from others."""
    reach_mm: float = 100.0
    """Distance of the crosses from the middle of the plate."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the true position minus the counter reading."""
        deviations: dict[str, float] = {}
        for element in self.elements:
            answered = record.answers.get(element, "")
            try:
                answer = float(answered)
            except ValueError:
                return MetricResult(
                    None, f"{element}: {f'expected a number, got {answered!r}' if answered else 'not answered'}"
                )
            autograph = record.autograph
            truth = true_errors(autograph, autograph.condition, int(element[-1]))["errors"]
            deviations[element] = abs(answer - truth[element[:-1]])
        worst = max(deviations, key=lambda element: deviations[element])
        if not math.isfinite(deviations[worst]):
            return MetricResult(None, f"{worst}: expected a number, got {record.answers[worst]!r}")
        return MetricResult(
            round(deviations[worst], 4), f"{worst} was answered {record.answers[worst]}, the largest deviation"
        )

    def floor(self, scenario: Scenario) -> float:
        """Return the precision of c in mm, or of a tilt in gon, with local errors of eight crosses."""
        c, mm = scenario.camera.c, 1e-3 * self.local_um
        of_c = mm * c / self.reach_mm / math.sqrt(8.0)
        of_tilt = 63.66 * mm * c / self.reach_mm**2 / math.sqrt(6.0)
        return of_c if all(element[0] == "c" for element in self.elements) else of_tilt
