"""Effects of lens, air and earth curvature on a ray between the ground and the film.

The scene applies them, the reductions remove them; the formulas are only here.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from a7sim.geometry._rotation import Array, length_of

EARTH_RADIUS_M = 6_370_000.0


def radially_displaced(image: Array, coefficients: Sequence[npt.ArrayLike]) -> Array:
    """Return image points ``(2, ...)`` displaced outward by ``k1 r^3 + k2 r^5 + ...``, r in mm about the origin."""
    r = length_of(image)
    displacement = sum(np.asarray(k) * r ** (2 * order) for order, k in enumerate(coefficients, start=1))
    return np.asarray(image * (1.0 + displacement))


def refraction_constant(flying_height_m: npt.ArrayLike, ground_height_m: npt.ArrayLike) -> Array:
    """Return the angle K in radians of refraction in the standard atmosphere.

    Bertram: K = 1e-6 (2410 H / (H^2 - 6H + 250) - 2410 h / (h^2 - 6h + 250) h/H), heights above the sea in km.
    """
    H, h = np.asarray(flying_height_m) / 1000.0, np.asarray(ground_height_m) / 1000.0
    return np.asarray(1e-6 * (2410.0 * H / (H * H - 6.0 * H + 250.0) - 2410.0 * h / (h * h - 6.0 * h + 250.0) * h / H))


def refracted(image: Array, c: npt.ArrayLike, flying_height_m: npt.ArrayLike, ground_height_m: npt.ArrayLike) -> Array:
    """Return image points ``(2, ...)`` displaced outward by refraction: K (r + r^3/c^2), for near-verticals."""
    K = refraction_constant(flying_height_m, ground_height_m)
    r = length_of(image)
    return np.asarray(image * (1.0 + K * (1.0 + r * r / np.square(c))))


def lowered_by_curvature(points: Array, nadir: Array) -> Array:
    """Return ground points ``(3, ...)`` in m lowered by d^2 / 2R, d the distance from the nadir ``(3,)``."""
    nadir = nadir.reshape((3,) + (1,) * (points.ndim - 1))
    distance = length_of(points[:2] - nadir[:2])
    return np.array([points[0], points[1], points[2] - distance**2 / (2.0 * EARTH_RADIUS_M)])
