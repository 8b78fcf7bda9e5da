"""Effects of a taking camera on a ray: distortion and fall-off of light."""

import numpy as np

from a7sim.geometry import Array, dots, lowered_by_curvature, radially_displaced, refracted
from a7sim.scenario.schema import Camera

__all__ = ["distorted", "fall_off", "fiducial_places", "lowered_by_curvature", "refracted"]

FALL_OFF = 1.0
"""Power of the cosine of the fall-off of light:

the remainder of the fourth power behind the graded filter of a wide-angle lens [assumption].
"""


def fiducial_places(camera: Camera) -> tuple[tuple[str, ...], Array]:
    """Return the names and calibrated positions ``(2, n)`` of the fiducials in mm."""
    names = tuple(fiducial.name for fiducial in camera.fiducials)
    return names, np.array([[f.x for f in camera.fiducials], [f.y for f in camera.fiducials]])


def distorted(camera: Camera, image: Array) -> Array:
    """Return image points ``(2, ...)`` about the principal point, displaced by the radial distortion of the lens."""
    return radially_displaced(image, camera.distortion)


def fall_off(camera: Camera, image: Array) -> Array:
    """Return the share of the light at image points ``(2, ...)`` about the principal point."""
    return np.asarray((1.0 + dots(image, image) / camera.c**2) ** (-FALL_OFF / 2.0))
