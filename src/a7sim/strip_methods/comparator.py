"""Analytical method: photographs measured in a comparator, models computed, a strip formed (P 1-2; fragment S)."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from a7sim.geometry import Array, length_of, plane_rotation
from a7sim.reduction import (
    Model,
    PlaneFit,
    Undetermined,
    corrected_image,
    model_coordinates,
    plane_fit,
    relative_orientation,
)
from a7sim.reduction.schut import orientation_by_schut
from a7sim.reduction.strips import CENTRE, is_centre
from a7sim.scenario import ModelPlan, Scenario
from a7sim.scenario.schema import Comparator, Observer
from a7sim.scene import NamedPoints, Photograph, Scene
from a7sim.standard_points import CASES
from a7sim.strip_methods.parallax_clearing import clear_parallaxes
from a7sim.strip_methods.strip import StripResult, ground_control, orient_strip

COMPARATOR_STREAM = 5
"""Spawn key of the comparator's random numbers, after those of scene, instrument and operator."""

STAGE_MM = 120.0
"""Approximate position of a photograph's middle on the stage; the fiducials eliminate it."""
STAGE_TURN = 0.005
"""Maximum rotation of a photograph on the stage, radians."""


@dataclass(frozen=True)
class ImagePair:
    """Images ``(2, n)`` of the common points of a model's photographs, mm in the system of the fiducials."""

    model: ModelPlan
    points: tuple[str, ...]
    left: Array
    right: Array

    def corrected(self, left: Callable[[Array], Array], right: Callable[[Array], Array]) -> "ImagePair":
        """Return the pair with corrected images."""
        return replace(self, left=left(self.left), right=right(self.right))


def strip_by_comparator(scenario: Scenario, scene: Scene, seed: int) -> StripResult:
    """Measure all photographs of a scenario in the comparator and return the strip, on the ground.

    Input are the measurements, the camera's certificate and the list of ground control. Refraction and earth curvature,
    if in the scenario, are corrected with the heights of a first strip computed without. Raises Undetermined or
    A7SimError for measurements that form no strip.
    """
    point_names = measured_points(scenario, scene, scenario.comparator.case)
    pairs = _measure_pairs(scenario, scene, point_names, seed)
    correct_lens = partial(_correct_lens, scenario=scenario)
    result = _orient_pairs([pair.corrected(correct_lens, correct_lens) for pair in pairs], scenario, scene)
    if not (scenario.air.refraction or scenario.air.earth_curvature):
        return result
    first = result.strip.oriented.model
    ground_height = float(first.at([name for name in first.points if not is_centre(name)])[2].mean())

    def correct_air(photograph: str) -> Callable[[Array], Array]:
        flying_height = float(first.at([photograph + CENTRE])[2, 0])
        return partial(_correct_air, scenario=scenario, flying_height=flying_height, ground_height=ground_height)

    corrected_pairs = [pair.corrected(correct_air(pair.model.left), correct_air(pair.model.right)) for pair in pairs]
    return _orient_pairs(corrected_pairs, scenario, scene)


def measured_points(scenario: Scenario, scene: Scene, case: str) -> frozenset[str]:
    """Return the names of the points to measure: standard points of a case, ground points, points of files."""
    standard = (scene.standard_points[model.name] for model in scenario.models)
    return frozenset(scene.other_points) | {
        positions[label] for positions in standard for label in CASES[case] if label in positions
    }


def _measure_pairs(scenario: Scenario, scene: Scene, point_names: frozenset[str], seed: int) -> list[ImagePair]:
    """Return the pairs of a scenario as measured."""
    comparator, observer = scenario.comparator, scenario.observer
    if comparator.kind == "stereo":
        return [
            _measure_in_stereo(model, scene, point_names, observer, comparator, _stream(seed, index))
            for index, model in enumerate(scenario.models)
        ]
    measured = {
        name: _measure_singly(photograph, observer, comparator, _stream(seed, index))
        for index, (name, photograph) in enumerate(scene.photographs.items())
    }
    return [
        ImagePair(
            model, names, mark_coordinates(measured[model.left], names), mark_coordinates(measured[model.right], names)
        )
        for model in scenario.models
        for names in [common_points(measured[model.left], measured[model.right], point_names)]
    ]


def _measure_singly(
    photograph: Photograph, observer: Observer, comparator: Comparator, rng: np.random.Generator
) -> NamedPoints:
    """Return all points of a photograph from a monocomparator."""
    stage = _Stage.mount(photograph, observer, comparator, rng)
    observed = simulate_pointings(
        stage.at(photograph.points.xy), 1e-3 * observer.monocular_um, observer.repeat_share, comparator.pointings, rng
    )
    return NamedPoints(photograph.points.names, stage.read(observed))


def _measure_in_stereo(
    model: ModelPlan,
    scene: Scene,
    point_names: frozenset[str],
    observer: Observer,
    comparator: Comparator,
    rng: np.random.Generator,
) -> ImagePair:
    """Return the points of a pair from a stereocomparator: x', y' of the left image, and px, py to the right one."""
    photographs = scene.photographs[model.left], scene.photographs[model.right]
    names = common_points(photographs[0].points, photographs[1].points, point_names)
    stages = [_Stage.mount(each, observer, comparator, rng) for each in photographs]
    left, right = (
        stage.at(mark_coordinates(each.points, names)) for stage, each in zip(stages, photographs, strict=True)
    )
    share, pointings = observer.repeat_share, comparator.pointings
    observed = simulate_pointings(left, 1e-3 * observer.stereo_um, share, pointings, rng)
    px = simulate_pointings((right - left)[:1], 1e-3 * observer.height_um, share, pointings, rng)
    py = simulate_pointings((right - left)[1:], 1e-3 * observer.parallax_um, 1.0, pointings, rng)
    step = 1e-3 * comparator.least_count_um
    parallaxes = round_to_count(np.concatenate([px, py]), step)
    return ImagePair(
        model, names, stages[0].read(observed), stages[1].read(round_to_count(observed, step) + parallaxes)
    )


@dataclass(frozen=True)
class _Stage:
    """Photograph on a stage of the comparator, and the fit of its fiducials to the calibrated ones."""

    turn: Array
    shift: Array
    step: float
    fit: PlaneFit

    @classmethod
    def mount(
        cls, photograph: Photograph, observer: Observer, comparator: Comparator, rng: np.random.Generator
    ) -> "_Stage":
        turn, shift = plane_rotation(STAGE_TURN * rng.standard_normal()), STAGE_MM + rng.standard_normal(2)
        step = 1e-3 * comparator.least_count_um
        fiducials = turn @ photograph.fiducials.xy + shift[:, None]
        observed = simulate_pointings(
            fiducials, 1e-3 * observer.monocular_um, observer.repeat_share, comparator.pointings, rng
        )
        read = round_to_count(observed, step).mean(axis=-1)
        return cls(turn, shift, step, plane_fit(read, calibrated_fiducials(photograph), comparator.fit))

    def at(self, film: Array) -> Array:
        """Return positions on the stage of positions ``(2, n)`` on film."""
        return np.asarray(self.turn @ film + self.shift[:, None])

    def read(self, observed: Array) -> Array:
        """Return the means of readings ``(2, n, pointings)`` in mm of the calibrated system."""
        return self.fit.calibrated(round_to_count(observed, self.step).mean(axis=-1))


def calibrated_fiducials(photograph: Photograph) -> Array:
    """Return the calibrated positions ``(2, n)`` of a photograph's fiducials."""
    calibrated = {fiducial.name: (fiducial.x, fiducial.y) for fiducial in photograph.camera.fiducials}
    return np.array([calibrated[name] for name in photograph.fiducials.names]).T


def simulate_pointings(
    places: Array, sigma: Array | float, share: float, pointings: int, rng: np.random.Generator
) -> Array:
    """Return positions ``(k, n)`` with the errors of repeated pointings ``(k, n, pointings)``.

    `share` of the error is new when the pointing is repeated at once; the rest is the appearance of the point itself.
    """
    sigmas = np.broadcast_to(sigma, places.shape)[..., None]
    return np.asarray(places[..., None] + sigmas * pointing_errors(places.shape, share, pointings, rng))


def pointing_errors(shape: tuple[int, ...], share: float, pointings: int, rng: np.random.Generator) -> Array:
    """Return the errors ``(*shape, pointings)`` of `simulate_pointings` in units of their standard deviations."""
    observed = np.sqrt(1.0 - share**2) * rng.standard_normal(shape)
    return np.asarray(observed[..., None] + share * rng.standard_normal((*shape, pointings)))


def round_to_count(values: Array, least_count: float) -> Array:
    """Return readings rounded to a least count; unchanged for a least count of zero."""
    return np.asarray(np.round(values / least_count) * least_count) if least_count else values


def common_points(left: NamedPoints, right: NamedPoints, point_names: frozenset[str]) -> tuple[str, ...]:
    """Return the names, in order, of the wanted points in both photographs."""
    return tuple(sorted(point_names.intersection(left.names) & point_names.intersection(right.names)))


def mark_coordinates(marks: NamedPoints, names: Sequence[str]) -> Array:
    """Return the positions ``(2, len(names))`` of named marks."""
    index = {name: i for i, name in enumerate(marks.names)}
    return marks.xy[:, [index[name] for name in names]]


def _stream(seed: int, photograph: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(COMPARATOR_STREAM, photograph)))


def _correct_lens(image: Array, scenario: Scenario) -> Array:
    camera = scenario.camera
    return corrected_image(image, camera.c, principal_point=camera.principal_point, distortion=camera.distortion)


def _correct_air(image: Array, scenario: Scenario, flying_height: float, ground_height: float) -> Array:
    camera = scenario.camera
    return corrected_image(
        image,
        camera.c,
        principal_point=camera.principal_point,
        distortion=camera.distortion,
        flying_height_m=flying_height,
        ground_height_m=ground_height,
        refraction=scenario.air.refraction,
        curvature=scenario.air.earth_curvature,
    )


def _orient_pairs(pairs: Sequence[ImagePair], scenario: Scenario, scene: Scene) -> StripResult:
    c, method = scenario.camera.c, scenario.comparator.orientation
    return orient_measured_strip(tuple(_compute_model(pair, c, method) for pair in pairs), scenario, scene)


def orient_measured_strip(models: tuple[Model, ...], scenario: Scenario, scene: Scene) -> StripResult:
    """Return the strip of a scenario's models, joined and adjusted by its plan."""
    plan = scenario.strip
    return StripResult(models, orient_strip(models, ground_control(scenario, scene), plan.join, plan.polynomial))


def _compute_model(pair: ImagePair, c: float, method: str) -> Model:
    """Return a model computed from its images, at the scale of the photographs, in the left photograph's frame."""
    with errors_for_model(pair.model.name):
        turn, base = _orient_pair(pair.left, pair.right, c, method)
    base_length = float(length_of((pair.left - pair.right).mean(axis=1)))
    points, _ = model_coordinates(pair.left, pair.right, c, c, turn, base, base_length)
    return add_centres(pair.model, pair.points, points, np.array([np.zeros(3), base_length * base]).T)


@contextmanager
def errors_for_model(name: str) -> Iterator[None]:
    """Add the name of the model to errors about its points."""
    try:
        yield
    except Undetermined as undetermined:
        raise Undetermined(f"model {name}: {undetermined}") from undetermined


def add_centres(model: ModelPlan, names: Sequence[str], points: Array, centres: Array) -> Model:
    """Return a model of points ``(3, n)`` and of its left and right centre ``(3, 2)``."""
    ends = (f"{model.left}{CENTRE}", f"{model.right}{CENTRE}")
    return Model(model.name, (*names, *ends), np.concatenate([points, centres], axis=1))


def _orient_pair(left: Array, right: Array, c: float, method: str) -> tuple[Array, Array]:
    """Return the rotation ``(3, 3)`` of the right photograph into the left one's frame, and the unit base there."""
    if method == "parallax":
        cleared = clear_parallaxes(left, right, (c, c), bx=1.0)
        return cleared.rotation, cleared.base
    orientation = (
        orientation_by_schut(left, right, c, c) if method == "schut" else relative_orientation(left, right, c, c)
    )
    return orientation.rotation, orientation.base
