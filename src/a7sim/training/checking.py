"""Checks of exercises: the reference passes, each faulty run fails for its reason, each criterion decides something."""

import os
import re
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from msgspec.structs import replace as changed

from a7sim.errors import A7SimError
from a7sim.journal.scripts import Script, SendLine, read_script
from a7sim.scenario import Scenario
from a7sim.text import pluralize
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.attempts import run_attempt, seed_for
from a7sim.training.catalogue import FILE
from a7sim.training.dry_runs import DryRuns
from a7sim.training.exercise import FULL_MARKS, Exercise, ExerciseFolder
from a7sim.training.grading import Grade, evaluate_metrics, grade_by, load_record
from a7sim.training.metrics import MetricResult, make_metric
from a7sim.training.template import PLACEHOLDERS
from a7sim.training.variation import scenario_for

MIN_HINTS, MIN_FAULTY = 2, 2

NEVER = 1e12
"""Limit that all values, or none, reach."""


@dataclass(frozen=True)
class CheckResult:
    """Result of the check of an exercise: sentences on errors, empty without errors."""

    name: str
    faults: tuple[str, ...]
    reference_points: float | None = None


@dataclass(frozen=True)
class _Run:
    """Run with its record and the result of each criterion's metric, which changed limits do not affect."""

    record: AttemptRecord
    results: Sequence[MetricResult]

    @classmethod
    def from_record(cls, record: AttemptRecord) -> "_Run":
        return cls(record, evaluate_metrics(record))

    def grade(self, exercise: Exercise) -> Grade:
        """Return the grade with the limits and weights of an exercise with the same metrics."""
        return grade_by(exercise, self.results, self.record.seconds)


def check_exercise(exercise_folder: ExerciseFolder) -> CheckResult:
    """Check an exercise completely."""
    exercise = exercise_folder.exercise
    faults = list(_form_faults(exercise_folder))
    if not _has_all_scripts(exercise_folder):
        return CheckResult(exercise_folder.name, tuple(faults))
    with tempfile.TemporaryDirectory() as folder:
        try:
            faults += _tolerance_faults(
                exercise, scenario_for(exercise_folder, seed_for(exercise_folder, exercise.reference))
            )
            records = _run_all(exercise_folder, Path(folder))
        except A7SimError as error:
            return CheckResult(exercise_folder.name, (*faults, str(error)))
        runs = {name: _Run.from_record(record) for name, record in records.items()}
        faults += _run_faults(exercise, runs)
        faults += _dead_criteria(exercise, runs)
    return CheckResult(exercise_folder.name, tuple(faults), runs["reference"].grade(exercise).points)


def _form_faults(exercise_folder: ExerciseFolder) -> Iterator[str]:
    exercise = exercise_folder.exercise
    if not exercise_folder.text.strip():
        yield "text.md: expected the exercise in plain words, found none"
    if len(exercise.hints) < MIN_HINTS:
        yield f"hint: expected {MIN_HINTS} hints or more, got {len(exercise.hints)}"
    if len(exercise.faulty) < MIN_FAULTY:
        yield f"faulty: expected {MIN_FAULTY} faulty runs or more, got {len(exercise.faulty)}"
    if not exercise.steps:
        yield "step: expected a checklist, got no step"
    total = sum(each.weight for each in exercise.criteria)
    if abs(total - FULL_MARKS) > 1e-6:
        yield f"criterion: expected weights that add up to {FULL_MARKS:g}, got {total:g}"
    for script in _scripts(exercise):
        if not (exercise_folder.folder / script).is_file():
            yield f"{script}: expected a script beside the exercise, found none"
    yield from _template_text(exercise_folder)
    yield from _unused_files(exercise_folder)


def _scripts(exercise: Exercise) -> list[str]:
    runs = (exercise.reference, *exercise.faulty, exercise.opening)
    return [run.script for run in runs if run is not None and run.script]


def _has_all_scripts(exercise_folder: ExerciseFolder) -> bool:
    return all((exercise_folder.folder / script).is_file() for script in _scripts(exercise_folder.exercise))


def _template_text(exercise_folder: ExerciseFolder) -> Iterator[str]:
    """Yield a sentence for each text of the template that the author has not replaced."""
    exercise = exercise_folder.exercise
    texts = {"goal": exercise.goal}
    texts |= {f"{each.id}: feedback": each.feedback for each in exercise.criteria}
    texts |= {f"hint {number}": each.text for number, each in enumerate(exercise.hints, start=1)}
    left = [(place, text) for place, text in texts.items() if text in PLACEHOLDERS]
    left += [("text.md", line.strip()) for line in exercise_folder.text.splitlines() if line.strip() in PLACEHOLDERS]
    for script in dict.fromkeys(_scripts(exercise)):
        file = exercise_folder.folder / script
        comments = file.read_text(encoding="utf-8", errors="replace") if file.is_file() else ""
        left += [(script, text) for text in sorted(PLACEHOLDERS) if f"# {text}" in comments]
    for place, text in left:
        yield f"{place}: expected a text of your own, got that of the template: {text}"


def _unused_files(exercise_folder: ExerciseFolder) -> Iterator[str]:
    """Yield a sentence for each file in the folder that neither the exercise nor one of its scripts uses.

    A used file names another one by its path relative to its own folder. Hidden files are ignored.
    """
    folder, exercise = exercise_folder.folder, exercise_folder.exercise
    if not folder.is_dir():
        return
    used = {FILE, "text.md", exercise.scenario, f"{exercise.scenario}.toml", *_scripts(exercise)}
    relative = [path.relative_to(folder) for path in folder.rglob("*") if path.is_file()]
    files = {path.as_posix() for path in relative if not any(part.startswith(".") for part in path.parts)}
    pending = [name for name in used if name in files]
    while pending:
        user = pending.pop()
        text = (folder / user).read_text(encoding="utf-8", errors="replace")
        named = {name for name in files - used if _is_named(name, user, text)}
        used |= named
        pending += named
    for name in sorted(files - used):
        yield f"{name}: expected only files that the exercise uses, got one that it does not name"


def _is_named(name: str, user: str, text: str) -> bool:
    """Return whether the text of a file names another file; both paths are relative to the exercise's folder."""
    path = os.path.relpath(name, Path(user).parent).replace(os.sep, "/")
    return re.search(rf"(?<![\w./-]){re.escape(path)}", text) is not None


def _tolerance_faults(exercise: Exercise, scenario: Scenario) -> Iterator[str]:
    for each in exercise.criteria:
        metric = make_metric(each)
        if not metric.more_is_better:
            floor = round(metric.floor(scenario), 4)
            for band, limit in (("excellent", each.excellent), ("pass", each.passing)):
                if limit < floor:
                    least = f"not below the accuracy of eye and least count, {floor:g}"
                    yield f"{each.id}: expected {band} {least}, got {limit:g}"
        if not metric.meets(each.excellent, each.passing):
            limits = f"excellent {each.excellent:g} and pass {each.passing:g}"
            yield f"{each.id}: expected excellent at least as strict as pass, got {limits}"


def _run_all(exercise_folder: ExerciseFolder, folder: Path) -> dict[str, AttemptRecord]:
    """Return the records of the reference, of the faulty runs, and of runs that do nothing, are slow or stop early.

    The reference is an attempt with a journal, as a student's; the others are dry runs.
    """
    exercise = exercise_folder.exercise
    dry_runs = DryRuns(exercise_folder)
    records = {"reference": _run_reference(exercise_folder, folder)}
    for i, played in enumerate(exercise.faulty, start=1):
        records[f"faulty {i}"], error = dry_runs.run_attempt(played)
        if error and played.script:
            raise A7SimError(f"{played.script}: {error}")
    seed = seed_for(exercise_folder, exercise.reference)
    script = read_script(exercise_folder.folder / exercise.reference.script) if exercise.reference.script else None
    records["nothing"] = dry_runs.run_and_leave(seed, None)
    records["slow"] = dry_runs.run_and_leave(seed, script, 10.0 * exercise.minutes)
    records["half"] = dry_runs.run_and_leave(seed, _first_half(script)) if script else records["nothing"]
    return records


def _run_reference(exercise_folder: ExerciseFolder, folder: Path) -> AttemptRecord:
    reference = exercise_folder.exercise.reference
    seed = seed_for(exercise_folder, reference)
    error = run_attempt(exercise_folder, reference, folder, seed)
    if error:
        raise A7SimError(f"reference: expected it to finish: {error}")
    return load_record(exercise_folder, seed, folder)


def _first_half(script: Script) -> Script:
    lines = [each for each in script.statements if isinstance(each, SendLine)]
    return replace(script, statements=tuple(lines[: len(lines) // 2]))


def _run_faults(exercise: Exercise, runs: dict[str, _Run]) -> Iterator[str]:
    reference = runs["reference"].grade(exercise)
    if not reference.passed:
        reason = "; ".join(f"{each.id}: {each.reason}" for each in reference.failed) or pluralize(
            reference.points, "point"
        )
        yield f"reference: expected it to pass, got {reason}"
    for i, faulty in enumerate(exercise.faulty, start=1):
        grade = runs[f"faulty {i}"].grade(exercise)
        name = faulty.script or f"faulty {i} ({faulty.procedure})"
        if grade.passed:
            yield f"{name}: expected it to fail, got {pluralize(grade.points, 'point')}"
        if faulty.fails not in [each.id for each in grade.failed]:
            got = ", ".join(each.id for each in grade.failed) or "nothing"
            yield f"{name}: expected {faulty.fails} to fail, got {got}"
    if runs["nothing"].grade(exercise).passed:
        yield "expected a run without actions not to pass, got a pass"
    for step in exercise.steps:
        metric = make_metric(step)
        result = metric.evaluate(runs["reference"].record)
        if not metric.meets(result.value, step.done):
            yield f"step {step.text!r}: expected the reference to tick it, got {result.reason}"
        if exercise.opening is not None and metric.meets(metric.evaluate(runs["nothing"].record).value, step.done):
            yield f"step {step.text!r}: expected an open item after the opening, got it ticked"


def _dead_criteria(exercise: Exercise, runs: dict[str, _Run]) -> Iterator[str]:
    """Yield the criteria that decide nothing: limits and weights whose change does not change any verdict.

    The run without any action is left out: it fails all criteria.
    """
    active_runs = [run for name, run in runs.items() if name != "nothing"]
    verdicts = [_verdict(run, exercise) for run in active_runs]
    for criterion in exercise.criteria:
        sense = -1.0 if make_metric(criterion).more_is_better else 1.0
        mutations = {
            "its tolerances are unlimited": changed(criterion, excellent=sense * NEVER, passing=sense * NEVER),
            "its tolerances are impossible": changed(criterion, excellent=-sense * NEVER, passing=-sense * NEVER),
            "its weight is almost 0": changed(criterion, weight=1e-6),
            "its weight is 1000": changed(criterion, weight=1e3),
        }
        for mutation, mutant in mutations.items():
            criteria = [mutant if each.id == mutant.id else each for each in exercise.criteria]
            mutated = changed(exercise, criteria=criteria)
            if [_verdict(run, mutated) for run in active_runs] == verdicts:
                yield f"{criterion.id}: expected some grade to change if {mutation}, got no change"


def _verdict(run: _Run, exercise: Exercise) -> tuple[bool, float]:
    grade = run.grade(exercise)
    return grade.passed, grade.points
