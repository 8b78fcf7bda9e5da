"""Metrics of an empirical relative orientation: points, elements, and the over-correction of omega."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, PARALLAX_ELEMENTS, Array
from a7sim.operator.procedures.empirical import clearing_coefficients, over_correction_by_coefficients
from a7sim.reduction import ProjectorPose
from a7sim.scenario import Scenario
from a7sim.standard_points import CASES
from a7sim.training.action_log import Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.metrics.base import (
    HALF_A_COUNT,
    Metric,
    MetricResult,
    describe_points,
    handle_label,
    join_words,
    register_metric,
)


def projector_poses(record: AttemptRecord, reading: Reading) -> tuple[ProjectorPose, ProjectorPose]:
    """Return the poses of the left-hand and the right-hand photograph's projectors by their counters."""
    zero = {name: record.autograph.element_data(name).zero for name in record.autograph.variant.elements}

    def pose(projector: int, x: float) -> ProjectorPose:
        tilts = [
            reading.counters[f"{name}{projector}"] - zero[f"{name}{projector}"] for name in ("omega", "phi", "kappa")
        ]
        centre = [x, -reading.counters[f"by{projector}"], reading.counters[f"bz{projector}"]]
        return ProjectorPose(np.array(centre)[:, None], GON * np.array(tilts)[:, None])

    model = record.model
    return pose(model.left_projector, 0.0), pose(model.right_projector, abs(reading.counters["bx"]))


class _ClearingMetric(Metric, frozen=True, kw_only=True):
    """Steps by point and element, such as { "2" = "kappa1" }, in groups with free order."""

    steps: list[dict[str, str]]

    def _step_of(self, record: AttemptRecord, reading: Reading) -> str | None:
        """Return the point of the step of a registration, None if it belongs to no step."""
        for group in self.steps:
            for point, element in group.items():
                if element in reading.elements and reading.point == record.name_of(point):
                    return point
        return None

    def _elements(self) -> dict[str, str]:
        return {point: element for group in self.steps for point, element in group.items()}


@register_metric("steps-missing")
class MissingSteps(_ClearingMetric, frozen=True, kw_only=True):
    """Number of steps that were not registered, came before their predecessors, or had another element reading."""

    unit = "steps"

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        first: dict[str, int] = {}
        strays: list[Reading] = []
        elements = self._elements()
        for reading in record.readings:
            step = self._step_of(record, reading)
            if step is not None:
                first.setdefault(step, reading.action_index)
            elif set(reading.elements) & set(elements.values()):
                strays.append(reading)
        missing = [point for point in elements if point not in first]
        early: list[str] = []
        before = -1
        for group in self.steps:
            indices = {point: first[point] for point in group if point in first}
            early += [point for point, index in indices.items() if index < before]
            before = max([before, *indices.values()])
        messages = [f"not registered: {self._list_steps(missing)}"] if missing else []
        messages += [f"registered before a preceding step: {self._list_steps(early)}"] if early else []
        messages += [f"registered at a wrong point: {self._list_readings(strays, record)}"] if strays else []
        stray_count = len({(each.point, each.elements) for each in strays})
        return MetricResult(
            float(len(missing) + len(early) + stray_count),
            "; ".join(messages) or f"cleared in order: {self._list_steps(list(elements))}",
        )

    def _list_steps(self, points: list[str]) -> str:
        elements = self._elements()
        return join_words(f"{handle_label(elements[point])} at {point}" for point in points)

    def _list_readings(self, readings: list[Reading], record: AttemptRecord) -> str:
        return join_words(
            dict.fromkeys(
                f"{join_words(map(handle_label, each.elements))} at {describe_points([each], record)}"
                for each in readings
            )
        )


@dataclass(frozen=True)
class OmegaTurn:
    """Turn of omega at the last point: start, position at which the point was clear, and end."""

    reading: Reading
    before: float
    cleared: float
    left: float
    needed: float
    """Required multiple of the clearing turn, by the positions of the five points."""

    @property
    def times(self) -> float:
        """Return the actual multiple of the clearing turn."""
        return (self.left - self.before) / (self.cleared - self.before)

    @property
    def remains(self) -> float:
        """Return the share of the parallax that the next round finds again."""
        return abs(1.0 - self.times / self.needed)


@register_metric("over-correction-off")
class OverCorrectionDeviation(_ClearingMetric, frozen=True, kw_only=True):
    """Share of the last point's parallax that remains after a round because omega was turned too far or too little.

    The last step is omega's. It counts if the clearing turn was `least` or more, and the worst of these. The clearing
    turn is the first registration there; its end is the reading at the registration of another step, or at the end.
    """

    truth = True
    least: float = 0.15
    """Gon."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the share."""
        turns = self._turns(record)
        last, omega = list(self._elements().items())[-1]
        if not turns:
            return MetricResult(
                None,
                f"expected a turn of {handle_label(omega)} by {self.least:g} gon or more registered at point {last}, "
                "got none",
            )
        worst = max(turns, key=lambda each: each.remains)
        return MetricResult(
            round(worst.remains, 3),
            f"at point {last} {handle_label(omega)} was turned by {worst.times:.2f} times the clearing turn "
            f"(required {worst.needed:.2f} times): {worst.remains:.0%} of the parallax is left after the next round",
        )

    def _turns(self, record: AttemptRecord) -> list[OmegaTurn]:
        *_, (last, omega) = self._elements().items()
        start_readings = [each.before for each in record.actions if each.name == omega and each.kind in ("set", "turn")]
        before = start_readings[0] if start_readings else record.autograph.element(omega)
        readings = [each for each in record.readings if self._step_of(record, each) is not None]
        latest: dict[str, Reading] = {}
        cleared: Reading | None = None
        turns = []
        for reading in readings:
            step = self._step_of(record, reading) or ""
            if step != last:
                if cleared is not None:
                    turns.append(self._turn(record, latest, cleared, before, reading.counters[omega]))
                    cleared = None
                before = reading.counters[omega]
            elif cleared is None:
                cleared = reading
            latest[step] = reading
        if cleared is not None:
            turns.append(self._turn(record, latest, cleared, before, record.autograph.element(omega)))
        return [each for each in turns if each is not None]

    def _turn(
        self, record: AttemptRecord, latest: dict[str, Reading], cleared: Reading, before: float, left: float
    ) -> OmegaTurn | None:
        *_, (_, omega) = self._elements().items()
        if abs(cleared.counters[omega] - before) < self.least or set(latest) != set(self._elements()):
            return None
        marks = np.array([latest[point].mark for point in self._elements()]).T[..., None]
        needed = float(over_correction_by_coefficients(self._coefficients(record, marks, cleared))[0])
        return OmegaTurn(cleared, before, cleared.counters[omega], left, needed)

    def _coefficients(self, record: AttemptRecord, marks: Array, reading: Reading) -> Array:
        names = [f"{name[:-1]}{record.model.side_of(int(name[-1]))}" for name in self._elements().values()]
        rows = [PARALLAX_ELEMENTS.index(name) for name in names]
        return clearing_coefficients(marks, *projector_poses(record, reading))[rows]

    def floor(self, scenario: Scenario) -> float:
        """Return the effect of half a count at either end of the shortest turn."""
        return 2.0 * HALF_A_COUNT / self.least


@register_metric("missing-point-wrong")
class WrongMissingPoints(Metric, frozen=True, kw_only=True):
    """Number of positions 1 to 6 wrongly answered as missing, or missing and not answered."""

    unit = "points"
    truth = True
    key: str

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        answered = record.answers.get(self.key, "")
        if not answered:
            return MetricResult(None, f"{self.key}: not answered")
        answered_points = set(answered.replace(",", " ").replace("+", " ").split())
        missing = set(CASES["A"]) - set(record.model.standard_points)
        wrong = sorted(answered_points ^ missing)
        if not wrong:
            return MetricResult(0.0, f"{self.key} was answered {answered}: right")
        return MetricResult(float(len(wrong)), f"{self.key} was answered {answered}: wrong for {join_words(wrong)}")
