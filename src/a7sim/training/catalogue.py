"""Catalogue of exercises: those that come with a7sim, and other folders."""

from functools import cache
from pathlib import Path
from typing import Any

import msgspec

from a7sim.bundled import bundled_dirs
from a7sim.errors import A7SimError
from a7sim.scenario.validation import schema_errors
from a7sim.table_files import read_toml
from a7sim.training.exercise import Exercise, ExerciseFolder, MetricSpec
from a7sim.training.handouts import HANDOUTS
from a7sim.training.metrics import MEASURES, make_metric
from a7sim.training.procedures import PROCEDURES

SEARCH_PATH = bundled_dirs("exercises")
"""Folders of the exercises that come with a7sim."""

FILE = "exercise.toml"


class ExerciseError(A7SimError):
    """Invalid exercise; the text states each error with its path."""


def all_exercises() -> list[ExerciseFolder]:
    """Return the exercises that come with a7sim, by number."""
    return [read_exercise(folder) for folder in _folders()]


def find_exercise(name: str) -> ExerciseFolder:
    """Return an exercise by number, by the name of its folder or a part of it, or by a folder. Raises A7SimError."""
    if (Path(name) / FILE).is_file():
        return read_exercise(Path(name))
    folders = _folders()
    if name.isdecimal():
        found = [each for each in folders if int(each.name.partition("-")[0]) == int(name)]
    else:
        found = [each for each in folders if each.name == name] or [
            each for each in folders if name and name in each.name
        ]
    if len(found) != 1:
        known = ", ".join(each.name for each in found or folders)
        raise A7SimError(f"{name}: expected the number of an exercise, its folder, or one of {known}")
    return read_exercise(found[0])


def _folders() -> list[Path]:
    """Return the folders of the exercises that come with a7sim: number, hyphen, name, in order."""
    catalogue = next((each for each in SEARCH_PATH if each.is_dir()), None)
    return sorted(path.parent for path in catalogue.glob(f"[0-9][0-9]-*/{FILE}")) if catalogue else []


def read_exercise(folder: Path) -> ExerciseFolder:
    """Return the exercise in a folder. Raises A7SimError with all errors."""
    path = folder / FILE
    raw = read_toml(path)
    errors = list(schema_errors(raw, _exercise_type()))
    if not errors:
        exercise = msgspec.convert(raw, Exercise)
        errors = _reference_errors(exercise)
        if not errors:
            return ExerciseFolder(exercise, folder)
    raise ExerciseError("\n".join(f"{path}: {error}" for error in errors))


@cache
def _exercise_type() -> msgspec.inspect.Type:
    return msgspec.inspect.type_info(Exercise)


def _reference_errors(exercise: Exercise) -> list[str]:
    errors: list[str] = []
    specs: list[tuple[str, MetricSpec]] = [(f"step[{i}]", each) for i, each in enumerate(exercise.steps)]
    specs += [(f"criterion[{i}]", each) for i, each in enumerate(exercise.criteria)]
    for path, spec in specs:
        errors += _metric_errors(path, spec)
    for i, step in enumerate(exercise.steps):
        known = MEASURES.get(step.measure)
        if known is not None and known.truth:
            errors.append(
                f"step[{i}].measure: expected a metric of the events at the link, "
                f"got {step.measure!r}: it uses the truth"
            )
    ids = exercise.criterion_ids
    errors += [f"criterion: expected every id once, got {each!r} twice" for each in _duplicates(ids)]
    for i, faulty in enumerate(exercise.faulty):
        if faulty.fails not in ids:
            errors.append(f"faulty[{i}].fails: expected one of {', '.join(ids)}, got {faulty.fails!r}")
    runs: list[tuple[str, Any]] = [("reference", exercise.reference), ("opening", exercise.opening)]
    for path, run in runs + [(f"faulty[{i}]", each) for i, each in enumerate(exercise.faulty)]:
        if run is None:
            continue
        if bool(run.script) == bool(run.procedure):
            errors.append(f"{path}: expected a script or a procedure, got {'both' if run.script else 'neither'}")
        if run.procedure and run.procedure not in PROCEDURES:
            known_procedures = ", ".join(PROCEDURES)
            errors.append(f"{path}.procedure: expected one of {known_procedures}, got {run.procedure!r}")
    if exercise.handout and exercise.handout not in HANDOUTS:
        errors.append(f"handout: expected one of {', '.join(HANDOUTS)}, got {exercise.handout!r}")
    return errors


def _metric_errors(path: str, spec: MetricSpec) -> list[str]:
    kind = MEASURES.get(spec.measure)
    if kind is None:
        return [f"{path}.measure: expected one of {', '.join(MEASURES)}, got {spec.measure!r}"]
    errors = list(schema_errors(spec.options, msgspec.inspect.type_info(kind), f"{path}.options"))
    if not errors:
        make_metric(spec)
    return errors


def _duplicates(names: list[str]) -> list[str]:
    return [name for i, name in enumerate(names) if name in names[:i]]
