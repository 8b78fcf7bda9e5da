"""Observing the perspective centres at two Z levels (thesis 3.6)."""

from collections.abc import Sequence

import numpy as np

from a7sim.geometry import Array
from a7sim.operator.bench import Bench, given_up
from a7sim.operator.job import ModelJob
from a7sim.reduction import PerspectiveCentre, perspective_centre

SUSPICIOUS_RMS = 0.19
"""Counter units; none of the thesis's twenty centres but the misprinted one has a larger rms."""

SLIPPED = 1.5
"""A point whose removal lowers a suspicious rms by this factor is pointed at again."""

MOST_REPETITIONS = 3


def observe_centre(
    bench: Bench, model: ModelJob, hand: int, levels: tuple[float, float], tolerated_rms: float
) -> PerspectiveCentre:
    """Point monocularly at points 1 to 6 at both levels and compute the centre of one photograph.

    hand is 1 for the left-hand photograph, 2 for the right-hand one. A point that does not fit the others is
    struck out and pointed at again; when the rms stays suspicious though no point stands out, a second set
    is observed and the mean of both is taken. Raises DoesNotFit when even then the rms is beyond the tolerated.
    """
    points = [model.standard_points[label] for label in model.points_of_case("A")]
    levels = bench.levels_shown(levels)
    low, high = _one_set(bench, hand, points, levels)
    if float(perspective_centre(low, high, *levels).rms) > SUSPICIOUS_RMS:
        bench.remark(f"{model.name}: the points of the centre fit badly, a second set is observed")
        low_again, high_again = _one_set(bench, hand, points, levels)
        low, high = (low + low_again) / 2.0, (high + high_again) / 2.0
    centre = perspective_centre(low, high, *levels)
    if float(centre.rms) > tolerated_rms:
        raise given_up(
            bench,
            f"{model.name}: the pointings of a perspective centre do not meet: rms {float(centre.rms):.2f}, "
            f"tolerated {tolerated_rms:.2f}",
        )
    return centre


def _one_set(bench: Bench, hand: int, points: Sequence[str], levels: tuple[float, float]) -> tuple[Array, Array]:
    low, high = (bench.point_with(hand, points, level) for level in levels)
    bench.compute()
    for _ in range(MOST_REPETITIONS):
        misread = _misread_point(low, high, levels)
        if misread is None:
            break
        why = "does not agree with the other points at the two levels"
        for pointings, level in zip((low, high), levels, strict=True):
            pointings[:, misread] = bench.point_again(hand, points[misread], level, why)
        bench.compute()
    return low, high


def _misread_point(low: Array, high: Array, levels: tuple[float, float]) -> int | None:
    everywhere: Sequence[int] = range(low.shape[1])
    of_all = float(perspective_centre(low, high, *levels).rms)
    without = [
        float(perspective_centre(np.delete(low, i, axis=1), np.delete(high, i, axis=1), *levels).rms)
        for i in everywhere
    ]
    worst = int(np.argmin(without))
    return worst if of_all > SUSPICIOUS_RMS and of_all > SLIPPED * without[worst] else None
