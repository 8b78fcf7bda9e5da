"""Scenario of each student: values of an exercise's scenario that the seed draws anew."""

import hashlib
from collections.abc import Mapping
from typing import Any

import msgspec
import numpy as np

from a7sim.errors import A7SimError
from a7sim.scenario import Scenario, load_scenario
from a7sim.training.exercise import ExerciseFolder

TRAINING_STREAM = 7
"""Spawn key of the variations of exercises, beside those of scene, instrument and operator."""

_DECIMALS = 4


def attempt_seed(student: str, exercise: str, mode: str = "practice") -> int:
    """Return the seed of a student's exercise: different for each student, and another one for an exam."""
    digest = hashlib.sha256("\0".join((student, exercise, mode)).encode("utf-8", "surrogatepass")).digest()
    return int.from_bytes(digest[:4])


def scenario_for(exercise_folder: ExerciseFolder, seed: int, observer: Mapping[str, Any] | None = None) -> Scenario:
    """Return the scenario of an exercise as a seed draws it. Raises A7SimError for invalid settings.

    `observer` overrides the virtual operator.
    """
    exercise = exercise_folder.exercise
    file = exercise_folder.folder / exercise.scenario
    name = file if file.is_file() else exercise.scenario
    overrides = {path: to_toml(value) for path, value in exercise.settings.items()}
    overrides |= {f"observer.{key}": to_toml(value) for key, value in (observer or {}).items()}
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(TRAINING_STREAM,)))
    if exercise.vary:
        nominal = msgspec.to_builtins(load_scenario(name, overrides))
        for path, tolerance in exercise.vary.items():
            overrides[path] = to_toml(_draw(_number_at(nominal, path), tolerance, rng))
    for alternatives in exercise.choose:
        alternative = alternatives[int(rng.integers(len(alternatives)))]
        overrides |= {path: to_toml(value) for path, value in alternative.items()}
    return load_scenario(name, overrides)


def _draw(value: float, tolerance: float, rng: np.random.Generator) -> float:
    if isinstance(value, int):
        return value + int(rng.integers(0, int(tolerance) + 1))
    return round(value + float(rng.uniform(-tolerance, tolerance)), _DECIMALS)


def _number_at(data: Any, path: str) -> float:
    for key in path.split("."):
        try:
            data = data[int(key)] if isinstance(data, list | tuple) else data[key]
        except (KeyError, IndexError, ValueError, TypeError):
            raise A7SimError(f"vary: expected the path of a number of the scenario, got {path!r}") from None
    if not isinstance(data, int | float) or isinstance(data, bool):
        raise A7SimError(f"vary: expected the path of a number of the scenario, got {path!r}")
    return data


def to_toml(value: Any) -> str:
    """Return a value in TOML notation."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{key} = {to_toml(each)}" for key, each in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(to_toml, value)) + "]"
    return msgspec.json.encode(value).decode()
