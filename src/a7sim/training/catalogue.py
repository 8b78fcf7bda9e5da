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
    there = _folders()
    if name.isdecimal():
        found = [each for each in there if int(each.name.partition("-")[0]) == int(name)]
    else:
        found = [each for each in there if each.name == name] or [each for each in there if name and name in each.name]
    if len(found) != 1:
        known = ", ".join(each.name for each in found or there)
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
    mistakes = list(schema_errors(raw, _expected()))
    if not mistakes:
        exercise = msgspec.convert(raw, Exercise)
        mistakes = _mistakes_of_reference(exercise)
        if not mistakes:
            return ExerciseFolder(exercise, folder)
    raise ExerciseError("\n".join(f"{path}: {mistake}" for mistake in mistakes))


@cache
def _expected() -> msgspec.inspect.Type:
    return msgspec.inspect.type_info(Exercise)


def _mistakes_of_reference(exercise: Exercise) -> list[str]:
    mistakes: list[str] = []
    measured: list[tuple[str, MetricSpec]] = [(f"step[{i}]", each) for i, each in enumerate(exercise.steps)]
    measured += [(f"criterion[{i}]", each) for i, each in enumerate(exercise.criteria)]
    for place, each in measured:
        mistakes += _mistakes_of_measure(place, each)
    for i, step in enumerate(exercise.steps):
        known = MEASURES.get(step.measure)
        if known is not None and known.truth:
            mistakes.append(
                f"step[{i}].measure: expected what can be seen at the link, got {step.measure!r}: the truth"
            )
    ids = exercise.criterion_ids
    mistakes += [f"criterion: expected every id once, got {each!r} twice" for each in _twice(ids)]
    for i, faulty in enumerate(exercise.faulty):
        if faulty.fails not in ids:
            mistakes.append(f"faulty[{i}].fails: expected one of {', '.join(ids)}, got {faulty.fails!r}")
    played: list[tuple[str, Any]] = [("reference", exercise.reference), ("opening", exercise.opening)]
    for place, run in played + [(f"faulty[{i}]", each) for i, each in enumerate(exercise.faulty)]:
        if run is None:
            continue
        if bool(run.script) == bool(run.procedure):
            mistakes.append(f"{place}: expected a script or a procedure, got {'both' if run.script else 'neither'}")
        if run.procedure and run.procedure not in PROCEDURES:
            known_ones = ", ".join(PROCEDURES)
            mistakes.append(f"{place}.procedure: expected one of {known_ones}, got {run.procedure!r}")
    if exercise.handout and exercise.handout not in HANDOUTS:
        mistakes.append(f"handout: expected one of {', '.join(HANDOUTS)}, got {exercise.handout!r}")
    return mistakes


def _mistakes_of_measure(place: str, each: MetricSpec) -> list[str]:
    kind = MEASURES.get(each.measure)
    if kind is None:
        return [f"{place}.measure: expected one of {', '.join(MEASURES)}, got {each.measure!r}"]
    mistakes = list(schema_errors(each.options, msgspec.inspect.type_info(kind), f"{place}.options"))
    if not mistakes:
        make_metric(each)
    return mistakes


def _twice(names: list[str]) -> list[str]:
    return [name for i, name in enumerate(names) if name in names[:i]]
