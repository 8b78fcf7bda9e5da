"""What a taking camera and the air do to a ray before it is on film."""

import numpy as np

from a7sim.geometry import Array, dots, lowered_by_curvature, radially_displaced, refracted
from a7sim.scenario.schema import Camera

__all__ = ["distorted", "fall_off", "fiducial_places", "lowered_by_curvature", "refracted"]

FALL_OFF = 1.0
"""Power of the cosine by which a picture grows darker from its middle: what the graded filter of a wide-angle lens
leaves of the fourth power [assumption]."""


def fiducial_places(camera: Camera) -> tuple[tuple[str, ...], Array]:
    """Return the names and calibrated places ``(2, n)`` of the fiducials in mm."""
    names = tuple(fiducial.name for fiducial in camera.fiducials)
    return names, np.array([[f.x for f in camera.fiducials], [f.y for f in camera.fiducials]])


def distorted(camera: Camera, image: Array) -> Array:
    """Return image points ``(2, ...)`` about the principal point, displaced by the lens's radial distortion."""
    return radially_displaced(image, camera.distortion)


def fall_off(camera: Camera, image: Array) -> Array:
    """Return what share of the light gets to image points ``(2, ...)`` about the principal point."""
    return np.asarray((1.0 + dots(image, image) / camera.c**2) ** (-FALL_OFF / 2.0))
