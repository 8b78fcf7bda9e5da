"""Strip on the Wild A8 as arrays: the measuring chain of P (P 3.1, 3.2).

Errors and their sources: docs/decisions/0005-a8-strip.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array, plane_rotation
from a7sim.instrument.condition import INSTRUMENT_STREAM
from a7sim.operator.people.random_draws import OPERATOR_STREAM
from a7sim.reduction import Model, Undetermined, a8_centres, a8_model_coordinates, picture_placement
from a7sim.scenario import ModelPlan, Observer, Scenario
from a7sim.scene import Photograph, Scene
from a7sim.standard_points import CASES
from a7sim.strip_methods.a8_projector import Projector
from a7sim.strip_methods.comparator import (
    add_centres,
    calibrated_fiducials,
    common_points,
    errors_for_model,
    mark_coordinates,
    measured_points,
    orient_measured_strip,
    pointing_errors,
    round_to_count,
)
from a7sim.strip_methods.parallax_clearing import ClearedPair, clear_parallaxes
from a7sim.strip_methods.strip import StripResult

POINTINGS = 2
"""Of each model point (thesis 3.5)."""

SCALE_STEP = 0.01
"""Least count of the X and Y scales in their units of 2 mm, and of the glass scale of heights in mm."""

COLUMN_MM = 300.0
"""Zin, to which P refers the glass scale (P 3.2)."""

REFERENCE_MM = 400.0
"""Reading of the glass scale at the column reading [assumption: an integer in its middle]."""

C_STEP_MM = 0.01
"""Least count of the principal distance."""


@dataclass(frozen=True)
class CentredPhoto:
    """Photograph on its carrier: image points ``(2, n)`` about the principal point, and the c set for its film."""

    image: Array
    c: float


def centre_photo(
    photograph: Photograph, names: tuple[str, ...], observer: Observer, rng: np.random.Generator
) -> CentredPhoto:
    """Centre a photograph by its fiducials and set the principal distance for the size of its film."""
    camera = photograph.camera
    marks = calibrated_fiducials(photograph)
    observed = photograph.fiducials.xy + 1e-3 * observer.fiducial_um * rng.standard_normal(marks.shape)
    placement = picture_placement(observed - marks, marks)
    shift = np.array([placement.dx, placement.dy]) + np.array(camera.principal_point)
    centred = plane_rotation(-placement.turn) @ mark_coordinates(photograph.points, names) - shift[:, None]
    return CentredPhoto(centred, float(round_to_count(np.array(camera.c * (1.0 + placement.scale)), C_STEP_MM)))


@dataclass(frozen=True)
class A8Setup:
    """A8 and its operator for one session."""

    projectors: tuple[Projector, Projector]
    observer: Observer
    bx: float
    readings_of_parallax: int
    rng: np.random.Generator

    def set_up(
        self, model: ModelPlan, scene: Scene, point_names: frozenset[str], standard: frozenset[str]
    ) -> "ProjectedPair":
        """Mount the photographs of a model; draw the errors of projection and observation."""
        photographs = scene.photographs[model.left], scene.photographs[model.right]
        names = common_points(photographs[0].points, photographs[1].points, point_names)
        pictures = tuple(centre_photo(each, names, self.observer, self.rng) for each in photographs)
        left, right = (
            projector.project(picture.image, self.rng)
            for projector, picture in zip(self.projectors, pictures, strict=True)
        )
        c = tuple(
            picture.c + projector.principal_distance_error
            for projector, picture in zip(self.projectors, pictures, strict=True)
        )
        orientation_points = [i for i, name in enumerate(names) if name in standard]
        sigma = 1e-3 * self.observer.parallax_um / np.sqrt(self.readings_of_parallax)
        errors = sigma * self.rng.standard_normal(len(orientation_points))
        pointing = pointing_errors((3, len(names)), self.observer.repeat_share, POINTINGS, self.rng)
        return ProjectedPair(model, names, left, right, (c[0], c[1]), orientation_points, errors, pointing)

    def clear(self, models: Sequence["ProjectedPair"]) -> list[ClearedPair]:
        """Clear the parallaxes of models, together for models with the same number of orientation points."""
        if len({len(each.orientation_points) for each in models}) == 1:
            left, right = (np.stack([each.at_standard_points[side] for each in models], axis=-1) for side in range(2))
            c1, c2 = np.array([each.c for each in models]).T
            try:
                cleared_pairs = clear_parallaxes(
                    left, right, (c1, c2), self.bx, np.stack([each.errors for each in models], axis=-1)
                )
            except Undetermined:
                pass
            else:
                return [cleared_pairs.of(i) for i in range(len(models))]
        cleared_singly = []
        for each in models:
            with errors_for_model(each.model.name):
                cleared_singly.append(clear_parallaxes(*each.at_standard_points, each.c, self.bx, each.errors))
        return cleared_singly

    def measure(self, pair: "ProjectedPair", cleared_pair: ClearedPair) -> Model:
        """Return a model with all its points, mm at its scale."""
        readings = self._read(cleared_pair.model_points(pair.left, pair.right)[0], cleared_pair, pair.pointing)
        centres = np.array(a8_centres(self.bx, COLUMN_MM, REFERENCE_MM)).T
        points, ends = (a8_model_coordinates(each, self.bx, COLUMN_MM, REFERENCE_MM) for each in (readings, centres))
        return add_centres(pair.model, pair.names, points, ends)

    def _read(self, points: Array, cleared_pair: ClearedPair, pointing: Array) -> Array:
        """Return the scale readings ``(3, n)`` of points ``(3, n)`` from the left centre, with pointing errors."""
        observer = self.observer
        enlargement = -points[2] / cleared_pair.c[0]
        plan = 1e-3 * observer.stereo_um * enlargement
        height = 1e-3 * observer.height_um * enlargement * -points[2] / self.bx
        x, y, z = points[..., None] + np.array([plan, plan, height])[..., None] * pointing
        readings = np.array([x / 2.0 + 200.0 - self.bx / 4.0, y / 2.0 + 200.0, z + COLUMN_MM + REFERENCE_MM])
        return np.asarray(round_to_count(readings, SCALE_STEP).mean(axis=-1))


@dataclass(frozen=True)
class ProjectedPair:
    """Photographs of a model as projected, and the errors of their observation."""

    model: ModelPlan
    names: tuple[str, ...]
    left: Array
    right: Array
    """Image points ``(2, n)`` about the principal points, mm."""
    c: tuple[float, float]
    orientation_points: list[int]
    """Indices of the standard points on which the model is oriented."""
    errors: Array
    """Errors of clearing their parallaxes, mm in the picture."""
    pointing: Array
    """Errors ``(3, n, pointings)`` in units of their standard deviations."""

    @property
    def at_standard_points(self) -> tuple[Array, Array]:
        """Image points of both photographs on which the model is oriented."""
        return self.left[:, self.orientation_points], self.right[:, self.orientation_points]


def strip_on_a8(scenario: Scenario, scene: Scene, seed: int) -> StripResult:
    """Set up and measure all models of a scenario on an A8 and return the strip, on the ground.

    Ground control, checks, points and joins are those of `strip_by_comparator`; c is set for the film's mean size,
    affine shrinkage and lens distortion remain. Raises A7SimError if the scenario has no plan, Undetermined or
    A7SimError for measurements that form no strip.
    """
    plan = scenario.plan
    instrument_rng, operator_rng = (
        np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(stream,)))
        for stream in (INSTRUMENT_STREAM, OPERATOR_STREAM)
    )
    test = scenario.instrument.grid_test
    a8 = A8Setup(
        (Projector.sample(test, instrument_rng), Projector.sample(test, instrument_rng)),
        scenario.observer,
        plan.bx,
        plan.parallax_readings,
        operator_rng,
    )
    point_names = measured_points(scenario, scene, plan.case)
    pairs = [
        a8.set_up(
            model, scene, point_names, frozenset(positions[label] for label in CASES[plan.case] if label in positions)
        )
        for model in scenario.models
        for positions in [scene.standard_points[model.name]]
    ]
    models = tuple(a8.measure(pair, cleared_pair) for pair, cleared_pair in zip(pairs, a8.clear(pairs), strict=True))
    return orient_measured_strip(models, scenario, scene)
