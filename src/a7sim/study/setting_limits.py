"""Check of the plan of a scenario against the ranges of its plotter before a session starts."""

from collections.abc import Iterator

import numpy as np

from a7sim.geometry import GON, Array, mxm, mxv, rotation, transposed
from a7sim.operator import ModelJob
from a7sim.plotters import VARIANTS, Variant
from a7sim.scenario import Plan, Scenario
from a7sim.scenario.schema import ModelPlan, Photo
from a7sim.scene import RelativeTruth
from a7sim.session.truth import RelativePose, true_elements


def settings_out_of_range(scenario: Scenario) -> Iterator[str]:
    """Yield a sentence for each planned setting outside the range of its element or carriage."""
    if not {"plotter", "bridge"} & {*scenario.work} or scenario.plotting is None:
        return
    variant, plan = VARIANTS[scenario.instrument.variant], scenario.plan
    planned = {"plan.bx": ("bx", plan.bx), "camera.c": ("c1", scenario.camera.c)}
    for path, (name, value) in planned.items():
        element = variant.elements[name]
        if not element.low <= value <= element.high:
            yield f"{path}: expected {element.low:g} to {element.high:g} mm, the range of {name}, got {value:g}"
    yield from _levels_beyond_reach(plan, variant)
    photos = {photo.name: photo for photo in scenario.photos}
    for model in scenario.models:
        yield from _orientation_beyond_reach(model, photos[model.left], photos[model.right], plan, variant)


def _levels_beyond_reach(plan: Plan, variant: Variant) -> Iterator[str]:
    if plan.centre_method not in ("two levels", "levels"):
        return
    gear = plan.height_gear
    if isinstance(gear, str):
        if gear not in variant.height_gears:
            return
        gear = variant.height_gears[gear].units_per_mm
    farthest, nearest = (-each for each in variant.carriages["Z"])
    preset = plan.preset[2]
    low, high = (preset + (plan.projection_height - distance) * gear for distance in (farthest, nearest))
    for level in plan.centre_levels:
        if not low <= level <= high:
            yield (
                f"plan.centre_levels: expected {low:.0f} to {high:.0f}, where the Z carriage of the {variant.name} "
                f"can go from a projection height of {plan.projection_height:g} mm, got {level:g}"
            )


def _orientation_beyond_reach(
    model: ModelPlan, left: Photo, right: Photo, plan: Plan, variant: Variant
) -> Iterator[str]:
    """Yield a sentence for each element that the true orientation of the photographs moves outside its range."""
    if left.position is None or right.position is None or "upside down" in (left.laid, right.laid):
        return
    counters = {name: element.zero for name, element in variant.elements.items()} | {"bx": plan.bx}
    start = {name: np.array([shown]) for name, shown in counters.items()}
    job = ModelJob(model.name, left.name, right.name, model.base, "", {})
    for name, (value,) in true_elements(_flown(left, right).batch(), plan.method, start, job, variant).items():
        element = variant.elements.get(name)
        if element is not None and not element.endless and not element.low <= value <= element.high:
            yield (
                f"photos: expected tilts and places of {left.name} and {right.name} that {name} of the "
                f"{variant.name} can take ({element.low:g} to {element.high:g} {element.unit}), got {value:.2f}"
            )


def _flown(left: Photo, right: Photo) -> RelativePose:
    to_left = transposed(_turned(left))
    base = np.subtract(right.position or (), left.position or ())
    return RelativePose.from_truth(RelativeTruth(mxm(to_left, _turned(right)), mxv(to_left, base), "the flight"))


def _turned(photo: Photo) -> Array:
    return rotation(photo.omega * GON, photo.phi * GON, photo.kappa * GON)
