"""Poses of projectors and projection by the space rod: pure functions of one instrument or of a batch as arrays.

Angles are radians, lengths mm in the instrument frame; vectors have shape ``(3, ...)``.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, length_of, mxm, mxv, rotation, transposed
from a7sim.instrument.local_errors import local_errors


def projection_centre(share: npt.ArrayLike, bx: npt.ArrayLike, by: npt.ArrayLike, bz: npt.ArrayLike) -> Array:
    """Return the position of a projection centre on the main frame ``(3, ...)``: (share bx, -by, bz) (geometry.md).

    `share` gives the layout of the base: 0 and 1 for the two centres of an A7, -1/2 and 1/2 for those of an A8.
    """
    place = np.asarray(share) * np.asarray(bx), -np.asarray(by), np.asarray(bz)
    return np.array(np.broadcast_arrays(*place) if any(each.ndim for each in place) else place, dtype=float)


def apply_common_tilt(place: Array, common_phi: npt.ArrayLike) -> Array:
    """Return positions on the main frame ``(3, ...)`` after its rotation by the common Phi about the Y axis."""
    return mxv(rotation(0.0, common_phi, 0.0), place)


class CameraAttitude(NamedTuple):
    """Attitude of a camera rotated about its axes, which need not meet in its centre."""

    rotation: Array
    """``(3, 3, ...)``."""
    axis_offset: Array
    """Distance of the axes from the projection centre, in the camera's axes ``(3, ...)``, mm."""
    rotated_offset: Array
    """The same in the frame's axes: it rotates with the camera."""


def attitude_from_angles(
    omega: npt.ArrayLike, phi: npt.ArrayLike, kappa: npt.ArrayLike, missed: Array
) -> CameraAttitude:
    """Return a camera with these tilts and this distance ``(3, ...)`` in mm of its axes from the projection centre."""
    turned = rotation(omega, phi, kappa)
    return CameraAttitude(turned, missed, mxv(turned, missed))


def pose(camera: CameraAttitude, place: Array, common_phi: npt.ArrayLike | None = None) -> tuple[Array, Array]:
    """Return centre ``(3, ...)`` and rotation ``(3, 3, ...)`` of a camera whose axes meet at a position of the frame.

    The common Phi rotates the frame with all its parts, `Ry(Phi) R`.
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
    """Return the position ``(2, ...)`` on a carrier to which the space rod projects a mark ``(3, ...)``.

    `principal_point` ``(2, ...)`` is the offset of the carrier's centre from the true one, `local` ``(2, k, ...)`` the
    coefficients of local errors, `rod` ``(2, ...)`` the eccentricity of the rod in its gimbal (`eccentric_offset`).
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
    """Return vectors ``(3, ...)`` of the frame in the camera's axes, with a fast path for one vector."""
    return vector @ turned if vector.ndim == 1 else mxv(transposed(turned), vector)


def eccentric_offset(direction: Array, eccentricity: Array) -> Array:
    """Return the distance vector ``(3, ...)`` of a rod with direction ``(3, ...)``, downwards, from its gimbal centre.

    The outer axis of the gimbal is along X, the inner one rotates with it; `eccentricity` ``(2, ...)`` is along the
    rod's own two axes, which are X and Y for a plumb rod, and rotates with them.
    """
    x, y, z = direction / length_of(direction)
    outer = np.hypot(y, z)
    along, across = eccentricity[0], eccentricity[1] / outer
    tipped = along * x / outer
    return np.array([along * outer, -across * z - tipped * y, across * y - tipped * z])
