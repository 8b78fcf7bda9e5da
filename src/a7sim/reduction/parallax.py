"""Numerical relative orientation from y-parallaxes (thesis 2.33, 2.34)."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from a7sim.geometry import PARALLAX_ELEMENTS, Array, near_vertical_parallax_coefficients
from a7sim.reduction.least_squares import Adjustment, adjusted

FEWEST_POINTS = 5


def element_corrections(parallaxes: Array, points: Array, base: npt.ArrayLike, unknowns: Sequence[str]) -> Adjustment:
    """Return the corrections, radians and mm, that make y-parallaxes vanish in the least-squares sense.

    `parallaxes` has shape ``(n, ...)`` in mm, `points` ``(3, n, ...)``: x from the left-hand centre, y, and
    z below the centres, in mm. `unknowns` are names of `PARALLAX_ELEMENTS`, 1 for the left-hand
    photograph. Raises Undetermined for points that do not determine them.
    """
    rows = [PARALLAX_ELEMENTS.index(name) for name in unknowns]
    coefficients = near_vertical_parallax_coefficients(points[0], points[1], points[2], base)
    return adjusted(np.swapaxes(coefficients[rows], 0, 1), -parallaxes)
