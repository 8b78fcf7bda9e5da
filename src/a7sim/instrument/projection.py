"""Where projectors stand and where a space rod brings the mark: pure functions, one instrument or many as arrays.

Angles are radians, lengths mm in the instrument frame; vectors have shape ``(3, ...)``.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, length_of, mxm, mxv, rotation, transposed
from a7sim.instrument.local_errors import local_errors


def projection_centre(share: npt.ArrayLike, bx: npt.ArrayLike, by: npt.ArrayLike, bz: npt.ArrayLike) -> Array:
    """Return where a projection centre stands on the main frame ``(3, ...)``: (share bx, -by, bz) (geometry.md).

    `share` tells how the base is laid off: 0 and 1 for the two centres of an A7, -1/2 and 1/2 for those of an A8.
    """
    place = np.asarray(share) * np.asarray(bx), -np.asarray(by), np.asarray(bz)
    return np.array(np.broadcast_arrays(*place) if any(each.ndim for each in place) else place, dtype=float)


def apply_common_tilt(place: Array, common_phi: npt.ArrayLike) -> Array:
    """Return places on the main frame ``(3, ...)`` when the frame is turned by the common Phi about the Y axis."""
    return mxv(rotation(0.0, common_phi, 0.0), place)


class CameraAttitude(NamedTuple):
    """A camera turned about its axes, wherever they meet."""

    rotation: Array
    """``(3, 3, ...)``."""
    axis_offset: Array
    """By how much the axes miss the projection centre, in the camera's axes ``(3, ...)``, mm."""
    rotated_offset: Array
    """The same in the frame's axes: it goes round with the camera."""


def attitude_from_angles(
    omega: npt.ArrayLike, phi: npt.ArrayLike, kappa: npt.ArrayLike, missed: Array
) -> CameraAttitude:
    """Return a camera with these tilts whose axes miss the projection centre by so much ``(3, ...)`` in mm."""
    turned = rotation(omega, phi, kappa)
    return CameraAttitude(turned, missed, mxv(turned, missed))


def pose(camera: CameraAttitude, place: Array, common_phi: npt.ArrayLike | None = None) -> tuple[Array, Array]:
    """Return centre ``(3, ...)`` and rotation ``(3, 3, ...)`` of a camera whose axes meet at a place of the frame.

    The common Phi turns the frame with all that stands on it, `Ry(Phi) R`.
    """
    turned = camera.rotation
    centre = place + camera.rotated_offset - camera.axis_offset
    if common_phi is None:
        return centre, turned
    return apply_common_tilt(centre, common_phi), mxm(rotation(0.0, common_phi, 0.0), turned)


def place_on_carrier(
    mark: Array,
    centre: Array,
    turned: Array,
    c: float | Array,
    principal_point: Array,
    local: Array | None = None,
    rod: Array | None = None,
) -> Array:
    """Return the place ``(2, ...)`` on a carrier where the space rod brings a mark ``(3, ...)``.

    `principal_point` ``(2, ...)`` is by how much the carrier's centre misses the true one, `local` ``(2, k, ...)`` the
    coefficients of local errors, `rod` ``(2, ...)`` the eccentricity of the rod in its cardan (`beside_the_centre`).
    """
    direction = mark - centre
    if rod is None:
        ray = _in_camera(turned, direction)
        image = ray[:2] * (-c / ray[2])
    else:
        beside = eccentric_offset(direction, rod)
        ray, passed = _in_camera(turned, direction - beside), _in_camera(turned, beside)
        image = passed[:2] - ray[:2] * ((c + passed[2]) / ray[2])
    if local is not None:
        image = image + local_errors(local, image)
    return np.asarray(image + principal_point)


def _in_camera(turned: Array, vector: Array) -> Array:
    """Return vectors ``(3, ...)`` of the frame in the camera's axes; one alone by what is quickest for one."""
    return vector @ turned if vector.ndim == 1 else mxv(transposed(turned), vector)


def eccentric_offset(direction: Array, eccentricity: Array) -> Array:
    """Return by how much ``(3, ...)`` a rod of this direction ``(3, ...)``, downwards, passes beside its cardan.

    The outer axis of the cardan lies along X, the inner one goes round with it; `eccentricity` ``(2, ...)`` lies along
    the rod's own two axes, which are X and Y for a rod that hangs plumb, and goes with them.
    """
    x, y, z = direction / length_of(direction)
    outer = np.hypot(y, z)
    along, across = eccentricity[0], eccentricity[1] / outer
    tipped = along * x / outer
    return np.array([along * outer, -across * z - tipped * y, across * y - tipped * z])
