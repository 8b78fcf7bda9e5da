"""A strip on the Wild A8, on arrays: what P's chain reads there (P 3.1, 3.2).

Errors and their sources: docs/decisions/0005-a8-strip.md.
"""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array, plane_rotation
from a7sim.instrument.condition import INSTRUMENT_STREAM
from a7sim.operator.dice import OPERATOR_STREAM
from a7sim.reduction import Model, a8_centres, a8_model_coordinates, picture_lie
from a7sim.scenario import ModelPlan, Observer, Scenario
from a7sim.scene import Photograph, Scene
from a7sim.session.analytical import (
    StripResult,
    blamed_on_model,
    calibrated_fiducials,
    common_points,
    measured_points,
    on_the_ground,
    places_of,
    pointed_at,
    rounded,
    with_centres,
)
from a7sim.session.clearing import Cleared, cleared
from a7sim.session.projectors import Projector
from a7sim.standard_points import CASES

POINTINGS = 2
"""Of every model point (thesis 3.5)."""

SCALE_STEP = 0.01
"""Least count of the X and Y scales in their units of 2 mm, and of the glass scale of heights in mm."""

COLUMN_MM = 300.0
"""Zin, to which P ties the glass scale (P 3.2)."""

REFERENCE_MM = 400.0
"""What the glass scale shows there [assumption: an integer in its middle]."""

C_STEP_MM = 0.01
"""Least count of the principal distance."""


@dataclass(frozen=True)
class Laid:
    """A photograph on its carrier: image points ``(2, n)`` about the principal point, and the c set for its film."""

    image: Array
    c: float


def laid(photograph: Photograph, names: tuple[str, ...], observer: Observer, rng: np.random.Generator) -> Laid:
    """Centre a photograph by its fiducials and set the principal distance for the size its film has."""
    camera = photograph.camera
    marks = calibrated_fiducials(photograph)
    seen = photograph.fiducials.xy + 1e-3 * observer.fiducial_um * rng.standard_normal(marks.shape)
    lie = picture_lie(seen - marks, marks)
    shift = np.array([lie.dx, lie.dy]) + np.array(camera.principal_point)
    centred = plane_rotation(-lie.turn) @ places_of(photograph.points, names) - shift[:, None]
    return Laid(centred, float(rounded(np.array(camera.c * (1.0 + lie.scale)), C_STEP_MM)))


@dataclass(frozen=True)
class A8:
    """An A8 and the person in its chair, for one session."""

    projectors: tuple[Projector, Projector]
    observer: Observer
    bx: float
    readings_of_parallax: int
    rng: np.random.Generator

    def set_up(self, model: ModelPlan, scene: Scene, wanted: frozenset[str], standard: frozenset[str]) -> Model:
        """Orient a model on its standard points and return it with all wanted points, measured, mm at its scale."""
        photographs = scene.photographs[model.left], scene.photographs[model.right]
        names = common_points(photographs[0].points, photographs[1].points, wanted)
        pictures = tuple(laid(each, names, self.observer, self.rng) for each in photographs)
        left, right = (
            projector.shown(picture.image, self.rng)
            for projector, picture in zip(self.projectors, pictures, strict=True)
        )
        c = tuple(
            picture.c + projector.principal_distance_error
            for projector, picture in zip(self.projectors, pictures, strict=True)
        )
        oriented_on = [i for i, name in enumerate(names) if name in standard]
        sigma = 1e-3 * self.observer.parallax_um / np.sqrt(self.readings_of_parallax)
        errors = sigma * self.rng.standard_normal(len(oriented_on))
        with blamed_on_model(model.name):
            stand = cleared(left[:, oriented_on], right[:, oriented_on], (c[0], c[1]), self.bx, errors)
        readings = self._read(stand.seen(left, right)[0], stand)
        centres = np.array(a8_centres(self.bx, COLUMN_MM, REFERENCE_MM)).T
        points, ends = (a8_model_coordinates(each, self.bx, COLUMN_MM, REFERENCE_MM) for each in (readings, centres))
        return with_centres(model, names, points, ends)

    def _read(self, points: Array, stand: Cleared) -> Array:
        """Return the scales' readings ``(3, n)`` for points ``(3, n)`` from the left centre, as pointed at."""
        observer = self.observer
        enlargement = -points[2] / stand.c[0]
        plan = 1e-3 * observer.stereo_um * enlargement
        height = 1e-3 * observer.height_um * enlargement * -points[2] / self.bx
        pointed = pointed_at(points, np.array([plan, plan, height]), observer.repeat_share, POINTINGS, self.rng)
        x, y, z = pointed
        readings = np.array([x / 2.0 + 200.0 - self.bx / 4.0, y / 2.0 + 200.0, z + COLUMN_MM + REFERENCE_MM])
        return np.asarray(rounded(readings, SCALE_STEP).mean(axis=-1))


def strip_on_a8(scenario: Scenario, scene: Scene, seed: int) -> StripResult:
    """Set up and measure all models of a scenario on an A8 and return the strip, on the ground.

    The same ground control and checks, the same points and the same connection as `strip_by_comparator`; c is set for
    the film's mean size, affine shrinkage and lens distortion stay in. Raises Mistake where the scenario has no plan,
    Undetermined or Mistake for what does not make a strip.
    """
    plan = scenario.plan
    faults, person = (
        np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(stream,)))
        for stream in (INSTRUMENT_STREAM, OPERATOR_STREAM)
    )
    test = scenario.instrument.grid_test
    a8 = A8(
        (Projector.drawn(test, faults), Projector.drawn(test, faults)),
        scenario.observer,
        plan.bx,
        plan.parallax_readings,
        person,
    )
    wanted = measured_points(scenario, scene, plan.case)
    models = tuple(
        a8.set_up(model, scene, wanted, frozenset(positions[label] for label in CASES[plan.case] if label in positions))
        for model in scenario.models
        for positions in [scene.standard_points[model.name]]
    )
    return on_the_ground(models, scenario, scene)
