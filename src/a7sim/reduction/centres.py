"""Perspective centres: from pointings at two levels or more, from a grid plate, and from the A8's base scale.

Thesis 2.4, 3.6, 4.2; for the A8 *Triangulation with Independent Models*, 3.1 and 3.2.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array
from a7sim.reduction.least_squares import Undetermined, solve_least_squares
from a7sim.reduction.resection import Resection, resection

MIN_POINTS = 2

A8_MIDDLE = 200.0
"""Reading of the A8's X and Y scales at the middle of the base; they count one unit to 2 mm."""

A8_MM_PER_UNIT = 2.0


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
    pointing_rms: Array | None = None
    """Standard deviation ``(...)`` of a pointing about its line, from three levels or more."""


def perspective_centre(low: Array, high: Array, level_low: float, level_high: float) -> PerspectiveCentre:
    """Return the centre from pointings ``(2, n, ...)`` at two counter levels of Z.

    3n equations ``X0 - T0 (X2 - X1) = X1``, the same in Y, and ``Z0 - T0 (Z2 - Z1) = Z1`` (thesis 2.4). The n
    equations in Z are one and the same condition between settings, no observations: 2n observations against
    three free unknowns leave a redundancy of 2n - 3. Raises Undetermined for fewer than two points or
    pointings that do not move between the levels.
    """
    n = low.shape[1]
    if n < MIN_POINTS:
        raise Undetermined(f"expected two points or more for a perspective centre, got {n}")
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
    solution = solve_least_squares(np.swapaxes(design, 0, 1), observed, redundancy=2 * n - 3)
    residuals = solution.residuals.reshape((3, n, *low.shape[2:]))
    X0, Y0, Z0, T0 = solution.unknowns
    sigma_X0, sigma_Y0, sigma_Z0, sigma_T0 = solution.sigmas
    return PerspectiveCentre(X0, Y0, Z0, T0, sigma_X0, sigma_Y0, sigma_Z0, sigma_T0, solution.s0, residuals)


def perspective_centre_of_levels(pointings: Array, levels: npt.ArrayLike) -> PerspectiveCentre:
    """Return the centre from pointings ``(2, k, n, ...)`` at k counter levels of Z, two or more in any order.

    A straight line is fitted to every point's pointings and taken at the lowest and the highest level, whence
    `perspective_centre`: of two levels the lines are the pointings, and of more they carry the smaller error
    that sigma, rms and T0 (between the outermost levels) then show. Raises Undetermined for one level and as
    `perspective_centre` does.
    """
    levels = np.asarray(levels, dtype=float)
    k, n = pointings.shape[1:3]
    if levels.shape != (k,):
        raise ValueError(f"expected a level for each of {k} rows of pointings, got levels of shape {levels.shape}")
    lowest, highest = float(levels.min(initial=np.inf)), float(levels.max(initial=-np.inf))
    if not highest > lowest:
        raise Undetermined(f"expected pointings at two levels of Z or more, got {min(k, 1)}")
    off = levels - levels.mean()
    mean = pointings.mean(axis=1)
    slope = np.einsum("k,ckn...->cn...", off, pointings) / (off @ off)
    low, high = (mean + slope * (level - levels.mean()) for level in (lowest, highest))
    centre = perspective_centre(low, high, lowest, highest)
    if k == MIN_POINTS:
        return centre
    lines = mean[:, None] + slope[:, None] * off.reshape((k, *(1,) * (pointings.ndim - 2)))
    squares = ((pointings - lines) ** 2).sum(axis=(0, 1, 2))
    return replace(centre, pointing_rms=np.asarray(np.sqrt(squares / (2 * n * (k - 2)))))


def grid_plate_centre(grid: Array, readings: Array, level: npt.ArrayLike, c: npt.ArrayLike) -> Resection:
    """Return the centre, and the projector's tilts, by resection of a grid plate measured at model scale.

    `grid` ``(2, n)`` or ``(2, n, ...)`` are the plate's crosses in mm about the principal point, `readings` ``(2, n,
    ...)`` the X and Y readings at them in mm, `level` the height of each reading in mm, one or ``(n, ...)``; the gear
    converts the units of the height counter to mm. `c` is the projector's principal distance. s0 and residuals are at
    the plate's scale. Raises Undetermined as `resection` does.
    """
    grid = np.broadcast_to(grid.reshape((*grid.shape, *(1,) * (readings.ndim - grid.ndim))), readings.shape)
    height = np.broadcast_to(np.asarray(level, dtype=float), readings.shape[1:])
    return resection(grid, np.array([readings[0], readings[1], height]), c)


def a8_centres(base: npt.ArrayLike, column: npt.ArrayLike, height_reading: npt.ArrayLike = 0.0) -> tuple[Array, Array]:
    """Return the left and the right centre ``(3, ...)`` of an A8 in its own readings, from the base scale.

    `base` in mm as the base scale reads; `column` is Zin, the reading in mm of the vertical column to which
    `height_reading` of the glass scale 1:10 000 was tied. X and Y are in scale units of 2 mm, Z in mm, upwards:
    ``(200 -+ B/4, 200, height_reading + Zin)`` (P 3.1, 3.2). No measurement goes into it, so it has no
    statistics; a grid plate or two levels check it. Raises ValueError for a base that is not above zero.
    """
    base, column, tied = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (base, column, height_reading)))
    if not (base > 0.0).all():
        raise ValueError(f"expected a base above 0 mm, got {float(base.min()):g}")
    aside = base / (2.0 * A8_MM_PER_UNIT)
    middle = np.full_like(base, A8_MIDDLE)
    return np.array([middle - aside, middle, tied + column]), np.array([middle + aside, middle, tied + column])
