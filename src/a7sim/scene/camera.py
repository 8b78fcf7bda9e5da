"""What a taking camera and the air do to a ray before it is on film."""

import numpy as np

from a7sim.geometry import Array, length_of
from a7sim.scenario.schema import Camera

EARTH_RADIUS_M = 6_370_000.0


def fiducial_places(camera: Camera) -> tuple[tuple[str, ...], Array]:
    """Return the names and calibrated places ``(2, n)`` of the fiducials in mm."""
    names = tuple(fiducial.name for fiducial in camera.fiducials)
    return names, np.array([[f.x for f in camera.fiducials], [f.y for f in camera.fiducials]])


def distorted(camera: Camera, image: Array) -> Array:
    """Return image points ``(2, ...)`` about the principal point, displaced by the lens's radial distortion."""
    r = length_of(image)
    displacement = sum(k * r ** (2 * order) for order, k in enumerate(camera.distortion, start=1))
    return np.asarray(image * (1.0 + displacement))


def lowered_by_curvature(points: Array, nadir: Array) -> Array:
    """Return ground points ``(3, ...)`` in m lowered by d^2 / 2R, d the distance from the nadir ``(3,)``."""
    nadir = nadir.reshape((3,) + (1,) * (points.ndim - 1))
    distance = length_of(points[:2] - nadir[:2])
    return np.array([points[0], points[1], points[2] - distance**2 / (2.0 * EARTH_RADIUS_M)])


def refracted(image: Array, c: float, flying_height_m: float, ground_height_m: float) -> Array:
    """Return image points ``(2, ...)`` displaced outward by refraction in the standard atmosphere.

    Bertram's formula, K (r + r^3/c^2) with
    K = 1e-6 (2410 H / (H^2 - 6H + 250) - 2410 h / (h^2 - 6h + 250) h/H), heights in km.
    """
    H, h = flying_height_m / 1000.0, ground_height_m / 1000.0
    K = 1e-6 * (2410.0 * H / (H * H - 6.0 * H + 250.0) - 2410.0 * h / (h * h - 6.0 * h + 250.0) * h / H)
    r = length_of(image)
    return np.asarray(image * (1.0 + K * (1.0 + r * r / (c * c))))
