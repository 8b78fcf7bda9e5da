"""The y-parallax of a model point and its derivatives by the orientation elements."""

import numpy as np
import numpy.typing as npt

from a7sim.geometry._rays import at_level, ray_of
from a7sim.geometry._rotation import Array, rotation

PARALLAX_ELEMENTS = (
    "kappa1", "kappa2", "phi1", "phi2", "omega1", "omega2", "by1", "by2", "bz1", "bz2",
)  # fmt: skip
"""Order of the coefficients; 1 is the left-hand photograph of the model, 2 the right-hand one."""


def y_parallax(
    image1: Array,
    image2: Array,
    centre1: Array,
    centre2: Array,
    rotation1: Array,
    rotation2: Array,
    c1: npt.ArrayLike,
    c2: npt.ArrayLike,
    level: npt.ArrayLike,
) -> Array:
    """Return ``p = y1 - y2`` in mm where the rays of two image points meet the plane Z = level."""
    y1 = at_level(centre1, ray_of(image1, rotation1, c1), level)[1]
    y2 = at_level(centre2, ray_of(image2, rotation2, c2), level)[1]
    return np.asarray(y1 - y2)


def parallax_coefficients(
    point1: Array, point2: Array, centre1: Array, centre2: Array, angles1: Array, angles2: Array
) -> Array:
    """Return the derivatives of `y_parallax` by the ten elements, shape ``(10, ...)``, for any tilt.

    Points ``(3, ...)`` are where the two rays meet the plane Z = level, one point where they intersect; angles
    ``(3, ...)`` are omega, phi, kappa in radians. A small turn about the axis a through the centre moves the
    ray's point r, seen from there, by a x r, and the ray leaves the plane at
    ``dy = (a x r)_y - (r_y / r_z) (a x r)_z``; near the vertical that is `near_vertical_parallax_coefficients`.
    """
    left = _changes_of_y(point1 - centre1, angles1)
    right = _changes_of_y(point2 - centre2, angles2)
    return np.asarray(np.stack([left, -right], axis=1).reshape((10, *left.shape[1:])))


def _changes_of_y(r: Array, angles: Array) -> Array:
    """Return the derivatives of y by kappa, phi, omega, by and bz, shape ``(5, ...)``."""
    omega, phi, kappa = angles
    slope = r[1] / r[2]
    about_kappa = rotation(omega, phi, kappa)[:, 2]
    about_phi = rotation(omega, 0.0, 0.0)[:, 1]
    about_omega = np.array([1.0, 0.0, 0.0])

    def turn(axis: Array) -> Array:
        x, y, z = axis.reshape((3, *(1,) * (r.ndim - axis.ndim), *axis.shape[1:]))
        return np.asarray((z * r[0] - x * r[2]) - slope * (x * r[1] - y * r[0]))

    return np.array([turn(about_kappa), turn(about_phi), turn(about_omega), np.full_like(slope, -1.0), -slope])


def near_vertical_parallax_coefficients(
    x: npt.ArrayLike, y: npt.ArrayLike, z: npt.ArrayLike, b: npt.ArrayLike
) -> Array:
    """Return the coefficients of thesis 2.32, shape ``(10, ...)``, in mm per radian or mm per mm.

    x and y are counted from the left-hand centre in mm, z is the distance below the centres, b the base. This is the
    equation as printed in the thesis, a test of `parallax_coefficients`, which the plotter's own tilts require.
    """
    x, y, z, b = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (x, y, z, b)))
    across = z * (1.0 + y**2 / z**2)
    one = np.ones_like(x)
    return np.array(
        [
            x, -(x - b), -x * y / z, (x - b) * y / z, across, -across, -one, one, y / z, -y / z,
        ]
    )  # fmt: skip
