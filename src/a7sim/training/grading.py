"""Grading of an attempt: its journal is replayed, and each criterion gets a band, points and a reason."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import msgspec

from a7sim.errors import A7SimError
from a7sim.journal.format import read_journal
from a7sim.journal.session_files import JOURNAL
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.attempts import written_answers
from a7sim.training.environment import AttemptEnvironment, UnreliableJournalError, replay_environment
from a7sim.training.exercise import FULL_MARKS, Criterion, Exercise, ExerciseFolder
from a7sim.training.handouts import make_handout
from a7sim.training.metrics import MetricResult, make_metric

JUST_PASSED = 0.6
"""Share of its weight that a criterion earns at the limit of its pass band; above, it rises to the whole weight."""

EXCELLENT, PASSED, FAILED = "excellent", "pass", "fail"


class CriterionResult(msgspec.Struct, frozen=True):
    """Criterion with its grade."""

    id: str
    title: str
    band: str
    points: float
    weight: float
    value: float | None
    unit: str
    excellent: float
    passing: float = msgspec.field(name="pass")
    reason: str = ""
    feedback: str = ""
    required: bool = True

    @property
    def lost(self) -> float:
        """Return the lost points."""
        return round(self.weight - self.points, 1)

    @property
    def sentence(self) -> str:
        """Return the reason, its cost, and the advice."""
        if self.band == EXCELLENT:
            return f"{self.reason}: {self.points:+g}"
        return f"{self.reason}: -{self.lost:g}. {self.feedback}"


class Grade(msgspec.Struct, frozen=True):
    """Grade of an attempt."""

    exercise: str
    title: str
    passed: bool
    points: float
    """Remainder of 100 after hints."""
    pass_points: float
    hints: int
    hint_points: float
    minutes: float
    marks: list[CriterionResult]

    @property
    def failed(self) -> list[CriterionResult]:
        """Return the failed criteria."""
        return [each for each in self.marks if each.band == FAILED]


@dataclass(frozen=True)
class HintsTaken:
    """Number of hints, and their cost."""

    number: int = 0
    cost: float = 0.0


def grade_record(record: AttemptRecord, hints: HintsTaken | None = None, exercise_name: str = "") -> Grade:
    """Return the grade of a record."""
    return grade_by(record.exercise, evaluate_metrics(record), record.seconds, hints, exercise_name)


def evaluate_metrics(record: AttemptRecord) -> list[MetricResult]:
    """Return the results of the metrics of all criteria, in order."""
    return [make_metric(each).evaluate(record) for each in record.exercise.criteria]


def grade_by(
    exercise: Exercise,
    results: Sequence[MetricResult],
    seconds: float,
    hints: HintsTaken | None = None,
    exercise_name: str = "",
) -> Grade:
    """Return the grade for the metrics' results of an attempt that took this many simulated s."""
    hints = hints or HintsTaken()
    marks = [grade_criterion(criterion, result) for criterion, result in zip(exercise.criteria, results, strict=True)]
    earned = round(max(0.0, sum(each.points for each in marks) - hints.cost), 1)
    is_required_failed = any(each.band == FAILED and each.required for each in marks)
    return Grade(
        exercise_name,
        exercise.title,
        not is_required_failed and earned >= exercise.pass_points,
        earned,
        exercise.pass_points,
        hints.number,
        hints.cost,
        round(seconds / 60.0, 1),
        marks,
    )


def grade_criterion(criterion: Criterion, result: MetricResult) -> CriterionResult:
    """Return a criterion with its band and points by the result of its metric."""
    metric = make_metric(criterion)
    value = result.value
    if metric.meets(value, criterion.excellent):
        band, share = EXCELLENT, 1.0
    elif metric.meets(value, criterion.passing) and value is not None:
        width = criterion.passing - criterion.excellent
        position = (criterion.passing - value) / width if width else 1.0
        band, share = PASSED, JUST_PASSED + (1.0 - JUST_PASSED) * position
    else:
        band, share = FAILED, 0.0
    return CriterionResult(
        criterion.id,
        criterion.title,
        band,
        round(share * criterion.weight, 1),
        criterion.weight,
        value,
        metric.unit,
        criterion.excellent,
        criterion.passing,
        result.reason,
        criterion.feedback,
        criterion.required,
    )


def grade_folder(exercise_folder: ExerciseFolder, seed: int, folder: Path, hints: HintsTaken | None = None) -> Grade:
    """Return the grade of the attempt in a folder. Raises UnreliableJournalError for an unreliable journal."""
    return grade_record(load_record(exercise_folder, seed, folder), hints, exercise_folder.name)


def load_record(exercise_folder: ExerciseFolder, seed: int, folder: Path) -> AttemptRecord:
    """Return the record of the attempt in a folder by replaying it. Raises UnreliableJournalError."""
    try:
        environment = replay_environment(exercise_folder, seed, read_journal(folder / JOURNAL))
    except UnreliableJournalError:
        raise
    except A7SimError as error:
        raise UnreliableJournalError(str(error)) from error
    return make_record(environment, written_answers(folder))


def make_record(environment: AttemptEnvironment, written_answers: dict[str, str] | None = None) -> AttemptRecord:
    """Return the record of an attempt with the answers on paper, and the hidden values of its handouts."""
    exercise = environment.exercise_folder.exercise
    hidden = make_handout(exercise.handout, environment.scenario, environment.seed, exercise.handout_options).hidden
    return environment.record(written_answers, dict(hidden))


def grade_lines(grade: Grade) -> Sequence[str]:
    """Return a grade as lines of text: the verdict, then each criterion."""
    verdict = "passed" if grade.passed else "not passed"
    lines = [f"{grade.title}: {verdict}, {grade.points:g} of {FULL_MARKS:g} points"]
    if grade.hints:
        lines.append(f"  hints: {grade.hints}, -{grade.hint_points:g}")
    lines += [
        f"  {each.band:<9} {each.points:4g}/{each.weight:<4g} {each.title}: {each.sentence}" for each in grade.marks
    ]
    return lines
