"""Corrections of measured image coordinates: the effects of lens, air and earth curvature are removed.

The order is principal point, distortion, refraction, curvature, the reverse of the order in which they arise.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from a7sim.geometry import EARTH_RADIUS_M, Array, image_of, length_of, ray_of, refraction_constant
from a7sim.reduction.least_squares import Undetermined

MAX_ITERATIONS = 20
MIN_STEP_MM = 1e-12


def about_principal_point(image: Array, principal_point: npt.ArrayLike) -> Array:
    """Return image points ``(2, ...)`` in mm from the principal point ``(2,)`` instead of the fiducial centre."""
    principal_point = np.asarray(principal_point, dtype=float)
    return np.asarray(image - principal_point.reshape((2, *(1,) * (image.ndim - 1))))


def without_distortion(image: Array, coefficients: Sequence[npt.ArrayLike]) -> Array:
    """Return image points ``(2, ...)`` about the principal point without the lens's radial distortion.

    `coefficients` are k1, k2, ... of the outward displacement k1 r^3 + k2 r^5 + ..., r in mm. Exact inverse of
    `a7sim.geometry.radially_displaced`. Raises Undetermined beyond the radius to which the lens can image.
    """
    return _drawn_in(image, np.asarray(1.0), coefficients)


def without_refraction(
    image: Array, c: npt.ArrayLike, flying_height_m: npt.ArrayLike, ground_height_m: npt.ArrayLike = 0.0
) -> Array:
    """Return image points ``(2, ...)`` without the refraction of the standard atmosphere; heights above the sea.

    Exact inverse of `a7sim.geometry.refracted` (Bertram), for near-vertical photographs.
    """
    K = refraction_constant(flying_height_m, ground_height_m)
    return _drawn_in(image, 1.0 + K, [K / np.square(c)])


def without_curvature(
    image: Array,
    c: npt.ArrayLike,
    flying_height_m: npt.ArrayLike,
    ground_height_m: npt.ArrayLike = 0.0,
    rotation: Array | None = None,
) -> Array:
    """Return image points ``(2, ...)`` as they would be on a flat earth, for a ground system with Z up at the nadir.

    `ground_height_m` is that of the points, one mean height or one each; ten per cent wrong in the height of
    flight above them is ten per cent wrong in the correction. `rotation` ``(3, 3)`` takes camera vectors to the
    ground and is needed for tilted photographs only. For a vertical the correction is H r^3 / (2 R c^2)
    outward. Inverse of `a7sim.geometry.lowered_by_curvature`.
    """
    turn = np.eye(3) if rotation is None else rotation
    turn = turn.reshape((*turn.shape, *(1,) * (image.ndim + 1 - turn.ndim)))
    ray = ray_of(image, turn, c)
    above = np.asarray(flying_height_m, dtype=float) - np.asarray(ground_height_m, dtype=float)
    # The ray meets the lowered ground where above + t ray_z + (t d)^2 / 2R vanishes, d its length in plan.
    fall = length_of(ray[:2]) ** 2 / (2.0 * EARTH_RADIUS_M)
    reach = 2.0 * above / (-ray[2] + np.sqrt(ray[2] ** 2 - 4.0 * fall * above))
    point = np.array([reach * ray[0], reach * ray[1], np.broadcast_to(-above, reach.shape)])
    return image_of(point, np.zeros((3, *(1,) * reach.ndim)), turn, c)


def corrected_image(
    image: Array,
    c: npt.ArrayLike,
    *,
    principal_point: npt.ArrayLike = (0.0, 0.0),
    distortion: Sequence[npt.ArrayLike] = (),
    flying_height_m: npt.ArrayLike | None = None,
    ground_height_m: npt.ArrayLike = 0.0,
    refraction: bool = False,
    curvature: bool = False,
    rotation: Array | None = None,
) -> Array:
    """Return image points ``(2, ...)`` in mm from the fiducial centre as imaged by a faultless camera on a flat earth.

    Parameters are those of the single corrections. Raises ValueError if refraction or curvature is requested without a
    flying height.
    """
    image = without_distortion(about_principal_point(image, principal_point), distortion)
    if not (refraction or curvature):
        return image
    if flying_height_m is None:
        raise ValueError("expected a flying height in m for the corrections of refraction and curvature, got none")
    if refraction:
        image = without_refraction(image, c, flying_height_m, ground_height_m)
    return without_curvature(image, c, flying_height_m, ground_height_m, rotation) if curvature else image


def _drawn_in(image: Array, first: Array, coefficients: Sequence[npt.ArrayLike]) -> Array:
    """Return the points whose radius r satisfies ``r (first + k1 r^2 + k2 r^4 + ...) = r of the image``, by Newton."""
    outer = length_of(image)
    r = outer / first
    for _ in range(MAX_ITERATIONS):
        value, slope = r * first, np.broadcast_to(first, r.shape).copy()
        for order, k in enumerate(coefficients, start=1):
            value = value + np.asarray(k) * r ** (2 * order + 1)
            slope = slope + (2 * order + 1) * np.asarray(k) * r ** (2 * order)
        if not (slope > 0.0).all():
            break
        step = (value - outer) / slope
        r = r - step
        if np.abs(step).max(initial=0.0) <= MIN_STEP_MM:
            return np.asarray(image * np.where(outer > 0.0, r / np.where(outer > 0.0, outer, 1.0), 1.0))
    raise Undetermined(
        f"expected image points within the radius that the distortion can reach, got one at {outer.max():.1f} mm"
    )
