"""Rays of a camera: images of points, and intersections of two rays."""

import numpy as np
import numpy.typing as npt

from a7sim.geometry._rotation import Array, mxv, transposed


def ray_of(image: Array, rotation: Array, c: npt.ArrayLike) -> Array:
    """Return the direction ``(3, ...)`` of the rays to image points ``(2, ...)``, in the instrument frame.

    The direction is ``R (x, y, -c)`` and is not normalised: its length is the image distance in mm.
    """
    x, y, z = np.broadcast_arrays(image[0], image[1], -np.asarray(c, dtype=float))
    return mxv(rotation, np.array([x, y, z]))


def image_of(point: Array, centre: Array, rotation: Array, c: npt.ArrayLike) -> Array:
    """Return the image points ``(2, ...)`` in mm of points ``(3, ...)`` seen from a projection centre.

    Points must lie before the camera; behind it the image is that of the ray's opposite.
    """
    x, y, z = mxv(transposed(rotation), point - centre)
    return np.asarray(-np.asarray(c, dtype=float) * np.array([x, y]) / z)


def at_level(centre: Array, direction: Array, level: npt.ArrayLike) -> Array:
    """Return the points ``(3, ...)`` where rays meet the plane Z = level, in mm of the instrument frame."""
    t = (np.asarray(level, dtype=float) - centre[2]) / direction[2]
    return np.asarray(centre + t * direction)


def stereoscopic_intersection(
    centre1: Array, direction1: Array, centre2: Array, direction2: Array
) -> tuple[Array, Array]:
    """Return the model points ``(3, ...)`` and y-parallaxes ``(...)`` of pairs of rays, in closed form.

    As in the plotter, the floating mark is at zero x-parallax: X and Z are common to both rays, Y is the mean of both
    and the parallax is ``p = y1 - y2``.
    """
    base = centre2 - centre1
    determinant = direction1[0] * direction2[2] - direction1[2] * direction2[0]
    t1 = (base[0] * direction2[2] - base[2] * direction2[0]) / determinant
    t2 = (base[0] * direction1[2] - base[2] * direction1[0]) / determinant
    p1 = centre1 + t1 * direction1
    p2 = centre2 + t2 * direction2
    return (p1 + p2) / 2.0, p1[1] - p2[1]
