"""Sheets of independent models: counter readings at points and centres, with one misread number."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array, length_of
from a7sim.reduction import Ground, Model
from a7sim.reduction.strips import formed_strip, is_centre
from a7sim.scenario import Scenario
from a7sim.scene import build_scene
from a7sim.strip_methods.comparator import strip_by_comparator
from a7sim.strip_methods.strip import given_control, orient_strip
from a7sim.table_files import to_csv
from a7sim.training.handouts.base import Handout, handout
from a7sim.training.handouts.control import control_csv

SHEETS, CONTROL = "models.csv", "control.csv"

COLUMNS = ("model", "point", "X", "Y", "Z")

HANDOUT_STREAM = (7, 1)
"""Spawn key of the misreading, after those of the variations of exercises."""

MISREAD_MM = (0.8, 1.6)
"""Size in the model: a wrong digit of a drum."""


@dataclass(frozen=True)
class Misreading:
    """Number on the sheets that differs from the counter."""

    model: str
    point: str
    axis: int
    by: float
    """mm in the model."""

    def add_to(self, models: Sequence[Model]) -> list[Model]:
        """Return the models with the misreading."""
        return [self._add_to_model(model) if model.name == self.model else model for model in models]

    def _add_to_model(self, model: Model) -> Model:
        coordinates = model.coordinates.copy()
        coordinates[self.axis, model.points.index(self.point)] += self.by
        return Model(model.name, model.points, coordinates)


@handout("model sheets")
def model_sheets(scenario: Scenario, seed: int, wanted: list[str]) -> Handout:
    """Return sheets of a strip's models in counter readings, and as hidden values the strip without the slip.

    The models are those of a comparator with the scenario's observer, at the scale and the presets of the plan. Hidden
    are `bad`, `ties`, `scale`, and x, y and z of the `wanted` points in m.
    """
    scene = build_scene(scenario, seed)
    models = [_to_counters(each, scenario) for each in strip_by_comparator(scenario, scene, seed).models]
    ground = given_control(scenario, scene)
    slip = add_misreading(models, ground, seed)
    strip = orient_strip([model.without(slip.point) if model.name == slip.model else model for model in models], ground)
    positions = dict(zip(strip.points.points, strip.points.coordinates.T.tolist(), strict=True))
    hidden = {
        "bad": slip.point,
        "ties": len(common_points(models[0], models[1])),
        "scale": 1e3 * float(strip.oriented.similarity.scale),
    }
    hidden |= {f"{axis}{name}": positions[name][k] for name in wanted for k, axis in enumerate("xyz")}
    papers = {SHEETS: _sheets_csv(slip.add_to(models), scenario), CONTROL: control_csv(ground)}
    return Handout(papers, hidden)


def add_misreading(models: Sequence[Model], ground: Ground, seed: int) -> Misreading:
    """Return a slip that the joins reveal: its point has by far the largest closing difference. Raises A7SimError."""
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=HANDOUT_STREAM))
    candidates: list[Misreading] = [
        Misreading(after.name, name, axis, float(sign * round(rng.uniform(*MISREAD_MM), 2)))
        for before, after in pairwise(models)
        for name in common_points(before, after)
        if not is_centre(name) and name not in ground.points
        for axis in range(3)
        for sign in (-1.0, 1.0)
    ]
    order: list[int] = rng.permutation(len(candidates)).tolist()
    for i in order:
        if _is_detectable(candidates[i], models):
            return candidates[i]
    raise A7SimError("expected enough ties between the models to detect a misread one, got too few")


def _is_detectable(slip: Misreading, models: Sequence[Model]) -> bool:
    if sum(slip.point in model.points for model in models) > 2:
        return False
    join = next(each for each in formed_strip(slip.add_to(models)).joins if each.after == slip.model)
    differences = np.abs(join.differences).max(axis=0)
    worst = int(differences.argmax())
    return join.points[worst] == slip.point and bool(np.sort(differences)[-2] < 0.6 * differences[worst])


def common_points(before: Model, after: Model) -> list[str]:
    """Return the names of the common points of two models, including their centre."""
    return [name for name in before.points if name in after.points]


def _to_counters(model: Model, scenario: Scenario) -> Model:
    """Return a model at the scale of the plan, with the plan's presets at its first standard point, mm."""
    left, right = (model.at([name])[:, 0] for name in model.centres)
    factor = scenario.plan.bx / float(length_of(right - left))
    first = model.at([f"{model.centres[0].partition(':')[0]}1"])
    preset = np.array(scenario.plan.preset)[:, None] / _units_per_mm(scenario)
    return Model(model.name, model.points, factor * (model.coordinates - first) + preset)


def _units_per_mm(scenario: Scenario) -> Array:
    gear = scenario.plan.height_gear
    assert not isinstance(gear, str)
    return np.array([[1.0], [1.0], [gear]])


def _sheets_csv(models: Sequence[Model], scenario: Scenario) -> str:
    rows = [
        (model.name, name, *(f"{each:.2f}" for each in position))
        for model in models
        for name, position in zip(model.points, (model.coordinates * _units_per_mm(scenario)).T.tolist(), strict=True)
    ]
    return to_csv(COLUMNS, rows)
