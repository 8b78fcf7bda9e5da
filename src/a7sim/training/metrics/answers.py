"""Metrics of answers, at the instrument or on paper."""

import math
from collections.abc import Sequence

from msgspec import field

from a7sim.scenario import Scenario
from a7sim.training.action_log import Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.metrics.base import HALF_A_COUNT, Metric, MetricResult, join_words, register_metric
from a7sim.training.metrics.truth import y_parallax_at


@register_metric("not-answered")
class MissingAnswers(Metric, frozen=True, kw_only=True):
    """Number of missing answers."""

    unit = "answers"
    keys: list[str] = field(default_factory=list)
    """All answers of the exercise if none are named."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        missing = [key for key in self.keys or record.exercise.answers if not record.answers.get(key)]
        return MetricResult(
            float(len(missing)), f"not answered: {join_words(missing)}" if missing else "all questions are answered"
        )


@register_metric("answer-off")
class AnswerDeviation(Metric, frozen=True, kw_only=True):
    """Difference of an answered number from the truth.

    `true` is 'play X' (of a carriage or an element, mm), 'parallax 3' (the y-parallax at a point at the end, um), or a
    hidden value of the handout.
    """

    truth = True
    key: str
    true: str
    least: float = 0.0
    """Smallest readable difference: no tolerance is smaller."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        answered = record.answers.get(self.key, "")
        try:
            number = float(answered)
        except ValueError:
            message = f"expected a number, got {answered!r}" if answered else "not answered"
            return MetricResult(None, f"{self.key}: {message}")
        value = abs(number - self._truth(record))
        return MetricResult(round(value, 4) if math.isfinite(value) else None, f"{self.key} was answered {answered}")

    def _truth(self, record: AttemptRecord) -> float:
        kind, _, name = self.true.partition(" ")
        if kind == "play":
            return record.autograph.play(name)
        if kind == "parallax":
            return y_parallax_at(record, record.name_of(name)) or math.nan
        return float(record.hidden.get(self.true, math.nan))

    def floor(self, scenario: Scenario) -> float:
        """Return the smallest readable difference."""
        return self.least


@register_metric("answers-off")
class MaxAnswerDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference of several answered numbers from the hidden values of the handout."""

    truth = True
    keys: list[str]
    least: float = 0.0
    """Smallest readable difference: no tolerance is smaller."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        deviations: dict[str, float] = {}
        for key in self.keys:
            try:
                deviations[key] = abs(float(record.answers.get(key, "")) - float(record.hidden[key]))
            except (ValueError, KeyError):
                answered = record.answers.get(key, "")
                message = f"expected a number, got {answered!r}" if answered else "not answered"
                return MetricResult(None, f"{key}: {message}")
        worst = max(deviations, key=lambda key: deviations[key])
        if not math.isfinite(deviations[worst]):
            return MetricResult(None, f"{worst}: expected a number, got {record.answers[worst]!r}")
        return MetricResult(
            round(deviations[worst], 4), f"{worst} was answered {record.answers[worst]}, the largest deviation"
        )

    def floor(self, scenario: Scenario) -> float:
        """Return the smallest readable difference."""
        return self.least


@register_metric("answer-wrong")
class WrongAnswers(Metric, frozen=True, kw_only=True):
    """Number of answers that differ from the hidden words of the handout under the same keys."""

    unit = "answers"
    truth = True
    keys: list[str]

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        missing = [key for key in self.keys if not record.answers.get(key)]
        wrong = [key for key in self.keys if key not in missing and not self._is_right(record, key)]
        messages = [f"not answered: {join_words(missing)}"] if missing else []
        messages += [f"{key}: {record.answers[key]} is wrong" for key in wrong]
        return MetricResult(float(len(missing) + len(wrong)), "; ".join(messages) or f"{join_words(self.keys)}: right")

    def _is_right(self, record: AttemptRecord, key: str) -> bool:
        right = record.hidden.get(key, ())
        allowed = [right] if isinstance(right, str | int | float) else right
        return _normalize(record.answers[key]) in {_normalize(str(each)) for each in allowed}


@register_metric("place-by-scales")
class PlaceByScales(Metric, frozen=True, kw_only=True):
    """Difference of answered coordinates of a point from those given by its registered scales (P 3.1), mm."""

    unit = "mm"
    point: str
    keys: list[str]
    """Of the answers for x and y."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the distance from the nearest registration of the point."""
        try:
            answered = [float(record.answers.get(key, "")) for key in self.keys]
        except ValueError:
            return MetricResult(None, f"expected numbers for {join_words(self.keys)}")
        readings = [each for each in record.readings if each.point == record.name_of(self.point)]
        if not readings:
            return MetricResult(None, f"nothing was registered at {self.point}")
        by_deviation = {self._deviation(record, each, answered): each for each in readings}
        nearest = min(by_deviation)
        x, y = self._position(record, by_deviation[nearest])
        return MetricResult(
            round(nearest, 4), f"answered {answered[0]:g}, {answered[1]:g}; the scales give {x:.2f}, {y:.2f}"
        )

    def _position(self, record: AttemptRecord, reading: Reading) -> tuple[float, float]:
        variant = record.autograph.variant
        x, y = (
            (reading.counters[axis] - variant.scales[axis].at_origin) / variant.scales[axis].units_per_mm
            for axis in "XY"
        )
        return x - variant.centres_on_base[0] * reading.counters["bx"], y

    def _deviation(self, record: AttemptRecord, reading: Reading, answered: Sequence[float]) -> float:
        x, y = self._position(record, reading)
        return math.hypot(answered[0] - x, answered[1] - y)

    def floor(self, scenario: Scenario) -> float:
        """Return half a count of both scales, which count in two millimetres."""
        return 2.0 * math.sqrt(2.0) * HALF_A_COUNT


def _normalize(text: str) -> str:
    try:
        return f"{float(text):.6g}"
    except ValueError:
        return text.lower().replace("-", " ").replace("_", " ").strip().strip("\"'")
