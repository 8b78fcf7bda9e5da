"""Whether the plan of a scenario lies within what its plotter can do, before anybody sits down."""

from collections.abc import Iterator

from a7sim.manual import VARIANTS, Variant
from a7sim.scenario import Plan, Scenario


def beyond_reach(scenario: Scenario) -> Iterator[str]:
    """Yield a sentence for every planned setting outside the range of its element or carriage."""
    if not {"plotter", "bridge"} & {*scenario.work} or scenario.plotting is None:
        return
    variant, plan = VARIANTS[scenario.instrument.variant], scenario.plan
    planned = {"plan.bx": ("bx", plan.bx), "camera.c": ("c1", scenario.camera.c)}
    for path, (name, value) in planned.items():
        element = variant.elements[name]
        if not element.low <= value <= element.high:
            yield f"{path}: expected {element.low:g} to {element.high:g} mm, the range of {name}, got {value:g}"
    yield from _levels_beyond_reach(plan, variant)


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
