"""Perspective centres from pointings at two levels (thesis 2.4, 3.6, 4.2)."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.reduction.least_squares import adjusted

FEWEST_POINTS = 2


@dataclass(frozen=True)
class PerspectiveCentre:
    """A centre in counter units, T0, their standard deviations and the rms of the observation equations.

    All lines through the pairs of pointings meet in it at ``P1 + T0 (P2 - P1)``.
    """

    X0: Array
    Y0: Array
    Z0: Array
    T0: Array
    sigma_X0: Array
    sigma_Y0: Array
    sigma_Z0: Array
    sigma_T0: Array
    rms: Array
    residuals: Array
    """Shape ``(3, n, ...)``: of the X, Y and Z equations of every point."""


def perspective_centre(low: Array, high: Array, level_low: float, level_high: float) -> PerspectiveCentre:
    """Return the centre from pointings ``(2, n, ...)`` at two counter levels of Z.

    3n equations ``X0 - T0 (X2 - X1) = X1``, the same in Y, and ``Z0 - T0 (Z2 - Z1) = Z1`` (thesis 2.4). The n
    equations in Z are one and the same condition between settings, no observations: 2n observations against
    three free unknowns leave a redundancy of 2n - 3. Raises Undetermined for fewer than two points or
    pointings that do not move between the levels.
    """
    n = low.shape[1]
    shift = high - low
    zero, one = np.zeros_like(low[0]), np.ones_like(low[0])
    dz = np.full_like(zero, level_high - level_low)
    design = np.concatenate(
        [
            np.array([one, zero, zero, -shift[0]]),
            np.array([zero, one, zero, -shift[1]]),
            np.array([zero, zero, one, -dz]),
        ],
        axis=1,
    )
    observed = np.concatenate([low[0], low[1], np.full_like(zero, level_low)])
    solution = adjusted(np.swapaxes(design, 0, 1), observed, redundancy=2 * n - 3)
    residuals = solution.residuals.reshape((3, n, *low.shape[2:]))
    X0, Y0, Z0, T0 = solution.unknowns
    sigma_X0, sigma_Y0, sigma_Z0, sigma_T0 = solution.sigmas
    return PerspectiveCentre(X0, Y0, Z0, T0, sigma_X0, sigma_Y0, sigma_Z0, sigma_T0, solution.s0, residuals)
