"""Numerical relative orientation from y-parallaxes (thesis 2.33, 2.34)."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import PARALLAX_ELEMENTS, Array, parallax_coefficients
from a7sim.reduction.least_squares import Adjustment, solve_least_squares


@dataclass(frozen=True)
class ProjectorPose:
    """Pose of a projector: centre ``(3, ...)`` in mm, angles omega, phi, kappa ``(3, ...)`` in radians."""

    centre: Array
    angles: Array


def element_corrections(
    parallaxes: Array, points: Array, left: ProjectorPose, right: ProjectorPose, unknowns: Sequence[str]
) -> Adjustment:
    """Return the corrections, radians and mm, that clear y-parallaxes in the least-squares sense.

    `parallaxes` has shape ``(n, ...)`` in mm, `points` ``(3, n, ...)`` in the frame of the projectors. `unknowns` are
    names of `PARALLAX_ELEMENTS`, 1 for the left-hand photograph. The coefficients are those of thesis 2.32, generalised
    to the present tilts of the projectors. Raises Undetermined for points that do not determine the unknowns.
    """
    coefficients = parallax_coefficients(
        points, points, left.centre[:, None], right.centre[:, None], left.angles, right.angles
    )
    rows = [PARALLAX_ELEMENTS.index(name) for name in unknowns]
    return solve_least_squares(np.swapaxes(coefficients[rows], 0, 1), -parallaxes)
