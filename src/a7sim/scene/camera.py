"""What a taking camera and the air do to a ray before it is on film."""

import numpy as np

from a7sim.geometry import Array, lowered_by_curvature, radially_displaced, refracted
from a7sim.scenario.schema import Camera

__all__ = ["distorted", "fiducial_places", "lowered_by_curvature", "refracted"]


def fiducial_places(camera: Camera) -> tuple[tuple[str, ...], Array]:
    """Return the names and calibrated places ``(2, n)`` of the fiducials in mm."""
    names = tuple(fiducial.name for fiducial in camera.fiducials)
    return names, np.array([[f.x for f in camera.fiducials], [f.y for f in camera.fiducials]])


def distorted(camera: Camera, image: Array) -> Array:
    """Return image points ``(2, ...)`` about the principal point, displaced by the lens's radial distortion."""
    return radially_displaced(image, camera.distortion)
