"""Metrics of a numerical relative orientation: corrections that follow from the student's readings, and settings."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from statistics import fmean

import numpy as np
from msgspec import field

from a7sim.geometry import GON, Array
from a7sim.reduction import Undetermined, element_corrections
from a7sim.scenario import Scenario
from a7sim.standard_points import CASES
from a7sim.text import pluralize
from a7sim.training.action_log import Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.forms import FIVE_ELEMENTS, multipliers
from a7sim.training.metrics.base import (
    BEST_PARALLAX_UM,
    HALF_A_COUNT,
    Metric,
    MetricResult,
    handle_label,
    join_words,
    register_metric,
)
from a7sim.training.metrics.clearing import projector_poses

BY_ELEMENTS = ("by1", "by2")


@dataclass(frozen=True)
class MeasuredRound:
    """Readings of by' and by" with the same settings of the five elements."""

    record: AttemptRecord
    readings: Sequence[Reading]

    @cached_property
    def elements(self) -> Mapping[str, str]:
        """Return the five elements of the plotter by those of the sides: with base out they are exchanged."""
        projectors = {1: self.record.model.left_projector, 2: self.record.model.right_projector}
        return {name: f"{name[:-1]}{projectors[int(name[-1])]}" for name in FIVE_ELEMENTS}

    @cached_property
    def parallaxes(self) -> dict[str, float]:
        """Return the y-parallaxes in mm by position, from the means of by' and by" minus their rest positions."""
        parallaxes = {}
        for label, name in self.record.model.standard_points.items():
            readings = [each for each in self.readings if each.point == name]
            by_element = {by: [each.counters[by] for each in readings if by in each.elements] for by in BY_ELEMENTS}
            if all(by_element.values()):
                rest = {
                    by: fmean(each.counters[by] for each in readings if by not in each.elements) for by in BY_ELEMENTS
                }
                sense = 1.0 if self.record.model.left_projector == 1 else -1.0
                moved = {by: fmean(by_element[by]) - rest[by] for by in BY_ELEMENTS}
                parallaxes[label] = sense * (moved["by1"] - moved["by2"]) / 2.0
        return parallaxes

    def has_case(self, case: str) -> bool:
        """Return whether all points of a case were read with both."""
        return set(CASES[case]) & set(self.record.model.standard_points) <= set(self.parallaxes)

    def corrections(self, case: str) -> list[dict[str, float]]:
        """Return the resulting corrections in gon, by element, for all methods that are taught.

        By the form for regular points or by least squares, from the parallaxes or from their differences from the mean.
        """
        labels = [label for label in CASES[case] if label in self.parallaxes]
        p = np.array([self.parallaxes[label] for label in labels])
        solutions = []
        for values in (p - p.mean(), p):
            if len(labels) == len(CASES[case]):
                solutions.append(multipliers(self.record.scenario, case) @ values)
            solutions.append(self._least_squares(labels, values))
        return [
            {self.elements[n]: float(v) for n, v in zip(FIVE_ELEMENTS, solution, strict=True)} for solution in solutions
        ]

    def _least_squares(self, labels: Sequence[str], p: Array) -> Array:
        names = [self.record.name_of(label) for label in labels]
        marks = [np.mean([each.mark for each in self.readings if each.point == name], axis=0) for name in names]
        left, right = projector_poses(self.record, self.readings[0])
        solution = element_corrections(p[:, None], np.array(marks).T[..., None], left, right, FIVE_ELEMENTS)
        return solution.unknowns[:, 0] / GON

    def reading(self, element: str) -> float:
        """Return the reading of an element."""
        return self.readings[0].counters[element]


def find_rounds(record: AttemptRecord) -> list[MeasuredRound]:
    """Return the rounds of measuring by' and by"; turning one of the five elements starts a new one."""
    rounds: list[list[Reading]] = []
    for each in (each for each in record.readings if set(each.elements) & set(BY_ELEMENTS)):
        if rounds and all(
            abs(each.counters[name] - rounds[-1][-1].counters[name]) < HALF_A_COUNT for name in FIVE_ELEMENTS
        ):
            rounds[-1].append(each)
        else:
            rounds.append([each])
    return [MeasuredRound(record, readings) for readings in rounds]


@dataclass(frozen=True)
class AnsweredCase:
    """Case of the exercise: measurements, resulting corrections, answers and settings."""

    corrections: Sequence[Mapping[str, float]]
    answered: Mapping[str, float]
    """Empty unless all five were answered."""
    settings: Mapping[str, float]


def answered_case(record: AttemptRecord, case: str) -> AnsweredCase | None:
    """Return the first complete round of a case with its results; None if there is none."""
    rounds = find_rounds(record)
    index = next((i for i, each in enumerate(rounds) if each.has_case(case)), None)
    if index is None:
        return None
    measured_round, elements = rounds[index], rounds[index].elements.values()
    after = rounds[index + 1].reading if index + 1 < len(rounds) else record.autograph.element
    try:
        corrections = measured_round.corrections(case)
    except Undetermined:
        return None
    answers = {name: _number(record.answers.get(f"{case.lower()}-{name}", "")) for name in elements}
    answered = {name: value for name, value in answers.items() if value is not None}
    moved = {name: after(name) - measured_round.reading(name) for name in elements}
    settings = {name: math.remainder(value, 400.0) for name, value in moved.items()}
    return AnsweredCase(corrections, answered if len(answered) == len(FIVE_ELEMENTS) else {}, settings)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _nearest_difference(
    corrections: Mapping[str, float], solutions: Sequence[Mapping[str, float]]
) -> tuple[float, str, float]:
    """Return the largest difference from the nearest method, its element, and the right value."""
    worst = [
        max((abs(corrections[name] - solution[name]), name, solution[name]) for name in solution)
        for solution in solutions
    ]
    return min(worst)


@register_metric("sums-off")
class ComputationDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference of corrections from those that follow from the student's readings, gon.

    Of the corrections as answered, CASE-ELEMENT such as a-kappa1, or else as set.
    """

    unit = "gon"
    truth = True
    case: str

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        case = answered_case(record, self.case)
        if case is None:
            return MetricResult(
                None, f"not all points of case {self.case} were read with by' and by\" at the same settings"
            )
        corrections = case.answered or case.settings
        deviation, name, expected = _nearest_difference(corrections, case.corrections)
        how = "answered" if case.answered else "set"
        value = f"{handle_label(name)} was {how} as {corrections[name]:+.2f}"
        message = f"case {self.case}: {value}, your readings give {expected:+.2f}"
        return MetricResult(round(deviation, 4), message)

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@register_metric("set-otherwise")
class SettingDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference of the corrections that were set from the computed ones, gon, over some cases."""

    unit = "gon"
    truth = True
    cases: list[str] = field(default_factory=lambda: ["A"])

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        cases = {case: each for case in self.cases if (each := answered_case(record, case)) is not None}
        if len(cases) < len(self.cases):
            return MetricResult(None, f"case {join_words(set(self.cases) - set(cases))} was not measured completely")
        deviations = [
            (_nearest_difference(each.settings, [each.answered] if each.answered else each.corrections), case)
            for case, each in cases.items()
        ]
        (deviation, name, expected), case = max(deviations)
        amount = cases[case].settings[name]
        message = f"case {case}: {handle_label(name)} was turned by {amount:+.2f}, required {expected:+.2f}"
        return MetricResult(round(deviation, 4), message)

    def floor(self, scenario: Scenario) -> float:
        """Return a count: both the old and the new setting are full counts."""
        return 2.0 * HALF_A_COUNT


@register_metric("parallax-rms")
class ParallaxRms(Metric, frozen=True, kw_only=True):
    """Rms of the y-parallaxes at the registrations of elements, um at photo scale."""

    unit = "um"
    truth = True
    elements: list[str] = field(default_factory=lambda: list(BY_ELEMENTS))

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the rms."""
        parallaxes = [
            each.stereo[1]
            for each in record.readings
            if set(each.elements) & set(self.elements) and each.stereo is not None
        ]
        if not parallaxes:
            return MetricResult(None, "nothing was registered with both images in view")
        rms = math.sqrt(fmean(each**2 for each in parallaxes))
        return MetricResult(
            round(rms, 2), f"{pluralize(len(parallaxes), 'reading')}: y-parallaxes of {rms:.1f} um (rms)"
        )

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye, and the rounding of the drum."""
        return BEST_PARALLAX_UM
