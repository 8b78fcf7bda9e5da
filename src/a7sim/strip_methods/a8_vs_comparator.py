"""The same strip by comparator and on the A8, over many flights: residuals at the checks (P, Table 1)."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.reduction.absolute import GroundFit, max_abs_residual, root_mean_square
from a7sim.reduction.strips import is_centre
from a7sim.scenario import Scenario
from a7sim.scene import build_scene
from a7sim.strip_methods.a8_strip import strip_on_a8
from a7sim.strip_methods.comparator import strip_by_comparator
from a7sim.strip_methods.strip import StripResult


@dataclass(frozen=True)
class Residuals:
    """Residuals of strips at their checks in X, Y, Z ``(3, seeds)``, m, and closing differences of their models."""

    rms: Array
    largest: Array
    closing: Array
    """Rms closing differences of the joins ``(2, seeds)`` in plan, each coordinate, and height, mm in the picture."""


@dataclass(frozen=True)
class StripComparison:
    """The same strips by comparator and on the A8, and the differences of their new points ``(3, seeds)``, m."""

    seeds: tuple[int, ...]
    comparator: Residuals
    a8: Residuals
    difference_rms: Array
    difference_largest: Array


def compare_a8_to_comparator(scenario: Scenario, seeds: Iterable[int]) -> StripComparison:
    """Return the residuals of both methods at the check points, over seeds.

    Each seed has its own film, A8 and observers.
    """
    seeds = tuple(seeds)
    results: list[tuple[StripResult, StripResult]] = []
    for seed in seeds:
        scene = build_scene(scenario, seed)
        results.append((strip_by_comparator(scenario, scene, seed), strip_on_a8(scenario, scene, seed)))
    c = scenario.camera.c
    differences = [coordinate_differences(*pair) for pair in results]
    return StripComparison(
        seeds,
        _residuals([comparator for comparator, _ in results], c),
        _residuals([a8 for _, a8 in results], c),
        np.array([root_mean_square(each) for each in differences]).T,
        np.array([max_abs_residual(each) for each in differences]).T,
    )


def _residuals(results: list[StripResult], c: float) -> Residuals:
    fits = [_fit(result).at_checks for result in results]
    return Residuals(
        np.array([root_mean_square(fit) for fit in fits]).T,
        np.array([max_abs_residual(fit) for fit in fits]).T,
        np.array([_closing(result, c) for result in results]).T,
    )


def _fit(result: StripResult) -> GroundFit:
    return (result.strip.adjusted or result.strip.oriented).fit


def _closing(result: StripResult, c: float) -> tuple[float, float]:
    """Return the rms closing differences in plan and height, at the scale of the picture by the first model."""
    first = result.models[0]
    heights = first.at([name for name in first.points if not is_centre(name)])[2]
    reduction = c / float(np.abs(heights).mean())
    differences = np.concatenate([join.differences for join in result.strip.formed.joins], axis=1) * reduction
    return float(np.sqrt((differences[:2] ** 2).mean())), float(np.sqrt((differences[2] ** 2).mean()))


def coordinate_differences(comparator: StripResult, a8: StripResult) -> Array:
    """Return A8 minus comparator ``(3, n)`` at the points that are neither control nor centres."""
    comparator_points, a8_points = comparator.strip.points, a8.strip.points
    ground = comparator.strip.oriented.fit.ground
    control = {name for name, role in zip(ground.points, ground.roles, strict=True) if role != "check"}
    names = sorted(
        name
        for name in set(comparator_points.points) & set(a8_points.points)
        if not is_centre(name) and name not in control
    )
    return np.asarray(a8_points.at(names) - comparator_points.at(names))
