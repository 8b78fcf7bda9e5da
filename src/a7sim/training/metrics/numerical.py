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
from a7sim.training.forms import FIVE, multipliers
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

BYS = ("by1", "by2")


@dataclass(frozen=True)
class MeasuredRound:
    """Readings of by' and by" with the same settings of the five elements."""

    record: AttemptRecord
    readings: Sequence[Reading]

    @cached_property
    def elements(self) -> Mapping[str, str]:
        """Return the five elements of the plotter by those of the sides: with base out they are exchanged."""
        projectors = {1: self.record.model.left_projector, 2: self.record.model.right_projector}
        return {name: f"{name[:-1]}{projectors[int(name[-1])]}" for name in FIVE}

    @cached_property
    def parallaxes(self) -> dict[str, float]:
        """Return the y-parallaxes in mm by position, from the means of by' and by" minus their rest positions."""
        found = {}
        for label, name in self.record.model.standard_points.items():
            there = [each for each in self.readings if each.point == name]
            read = {by: [each.shown[by] for each in there if by in each.named] for by in BYS}
            if all(read.values()):
                rest = {by: fmean(each.shown[by] for each in there if by not in each.named) for by in BYS}
                sense = 1.0 if self.record.model.left_projector == 1 else -1.0
                moved = {by: fmean(read[by]) - rest[by] for by in BYS}
                found[label] = sense * (moved["by1"] - moved["by2"]) / 2.0
        return found

    def has(self, case: str) -> bool:
        """Return whether all points of a case were read with both."""
        return set(CASES[case]) & set(self.record.model.standard_points) <= set(self.parallaxes)

    def sums(self, case: str) -> list[dict[str, float]]:
        """Return the resulting corrections in gon, by element, for all methods that are taught.

        By the form for regular points or by least squares, from the parallaxes or from their differences from the mean.
        """
        labels = [label for label in CASES[case] if label in self.parallaxes]
        p = np.array([self.parallaxes[label] for label in labels])
        ways = []
        for each in (p - p.mean(), p):
            if len(labels) == len(CASES[case]):
                ways.append(multipliers(self.record.scenario, case) @ each)
            ways.append(self._rigorous(labels, each))
        return [{self.elements[n]: float(v) for n, v in zip(FIVE, way, strict=True)} for way in ways]

    def _rigorous(self, labels: Sequence[str], p: Array) -> Array:
        names = [self.record.name_of(label) for label in labels]
        marks = [np.mean([each.mark for each in self.readings if each.point == name], axis=0) for name in names]
        left, right = projector_poses(self.record, self.readings[0])
        solution = element_corrections(p[:, None], np.array(marks).T[..., None], left, right, FIVE)
        return solution.unknowns[:, 0] / GON

    def shows(self, element: str) -> float:
        """Return the reading of an element."""
        return self.readings[0].shown[element]


def find_rounds(record: AttemptRecord) -> list[MeasuredRound]:
    """Return the rounds of measuring by' and by"; turning one of the five elements starts a new one."""
    rounds: list[list[Reading]] = []
    for each in (each for each in record.readings if set(each.named) & set(BYS)):
        if rounds and all(abs(each.shown[name] - rounds[-1][-1].shown[name]) < HALF_A_COUNT for name in FIVE):
            rounds[-1].append(each)
        else:
            rounds.append([each])
    return [MeasuredRound(record, readings) for readings in rounds]


@dataclass(frozen=True)
class AnsweredCase:
    """Case of the exercise: measurements, resulting corrections, answers and settings."""

    sums: Sequence[Mapping[str, float]]
    answered: Mapping[str, float]
    """Empty unless all five were answered."""
    set: Mapping[str, float]


def answered_case(record: AttemptRecord, case: str) -> AnsweredCase | None:
    """Return the first complete round of a case with its results; None if there is none."""
    rounds = find_rounds(record)
    place = next((i for i, each in enumerate(rounds) if each.has(case)), None)
    if place is None:
        return None
    this, elements = rounds[place], rounds[place].elements.values()
    after = rounds[place + 1].shows if place + 1 < len(rounds) else record.autograph.element
    try:
        sums = this.sums(case)
    except Undetermined:
        return None
    answers = {name: _number(record.answers.get(f"{case.lower()}-{name}", "")) for name in elements}
    answered = {name: value for name, value in answers.items() if value is not None}
    moved = {name: after(name) - this.shows(name) for name in elements}
    changed = {name: math.remainder(value, 400.0) for name, value in moved.items()}
    return AnsweredCase(sums, answered if len(answered) == len(FIVE) else {}, changed)


def _number(text: str) -> float | None:
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _apart(given: Mapping[str, float], ways: Sequence[Mapping[str, float]]) -> tuple[float, str, float]:
    """Return the largest difference from the nearest method, its element, and the right value."""
    worst = [max((abs(given[name] - way[name]), name, way[name]) for name in way) for way in ways]
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
        found = answered_case(record, self.case)
        if found is None:
            return MetricResult(
                None, f"not all points of case {self.case} were read with by' and by\" at the same settings"
            )
        off, name, right = _apart(found.answered or found.set, found.sums)
        given = (found.answered or found.set)[name]
        how = "answered" if found.answered else "set"
        told = f"case {self.case}: {handle_label(name)} was {how} as {given:+.2f} and your readings give {right:+.2f}"
        return MetricResult(round(off, 4), told)

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
        there = {case: each for case in self.cases if (each := answered_case(record, case)) is not None}
        if len(there) < len(self.cases):
            return MetricResult(None, f"case {join_words(set(self.cases) - set(there))} was not measured whole")
        all_off = [
            (_apart(each.set, [each.answered] if each.answered else each.sums), case) for case, each in there.items()
        ]
        (off, name, right), case = max(all_off)
        told = (
            f"case {case}: {handle_label(name)} was turned by {there[case].set[name]:+.2f} and should be by "
            f"{right:+.2f}"
        )
        return MetricResult(round(off, 4), told)

    def floor(self, scenario: Scenario) -> float:
        """Return a count: both the old and the new setting are full counts."""
        return 2.0 * HALF_A_COUNT


@register_metric("parallax-rms")
class ParallaxRms(Metric, frozen=True, kw_only=True):
    """Rms of the y-parallaxes at the registrations of elements, um at photo scale."""

    unit = "um"
    truth = True
    elements: list[str] = field(default_factory=lambda: list(BYS))

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the rms."""
        left = [
            each.stereo[1]
            for each in record.readings
            if set(each.named) & set(self.elements) and each.stereo is not None
        ]
        if not left:
            return MetricResult(None, "nothing was registered with both images in view")
        rms = math.sqrt(fmean(each**2 for each in left))
        return MetricResult(
            round(rms, 2), f"over {pluralize(len(left), 'reading')} y-parallaxes of {rms:.1f} um (rms) were left"
        )

    def floor(self, scenario: Scenario) -> float:
        """Return the error of the best eye, and the rounding of the drum."""
        return BEST_PARALLAX_UM
