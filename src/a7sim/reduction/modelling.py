"""Model coordinates: by intersection of rays, and from the readings of an A8."""

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, mxm, mxv, ray_of, rotation, stereoscopic_intersection, transposed


def model_coordinates(
    image1: Array, image2: Array, c1: float, c2: float, rotation2: Array, base: Array, base_length: npt.ArrayLike
) -> tuple[Array, Array]:
    """Return model points ``(3, n, ...)`` and y-parallaxes ``(n, ...)`` in mm from image points ``(2, n, ...)`` in mm.

    `rotation2` ``(3, 3, ...)`` takes the right photograph's vectors into the left photograph's frame, `base`
    ``(3, ...)`` is the direction of the base there. Rays are intersected with X along the base and omega of the left
    camera at zero, where x-parallax vanishes and Y is the mean of both rays (paper P 1.9); the points are then turned
    into the left photograph's frame, with the left centre as origin.
    """
    along = base / np.sqrt((base * base).sum(axis=0))
    left = rotation(0.0, np.arcsin(along[2]), np.arctan2(-along[1], along[0]))
    right = mxm(left, rotation2)
    zero = np.zeros_like(along[0]) + 0.0 * np.asarray(base_length, dtype=float)
    centre2 = np.array([zero + base_length, zero, zero])[:, None]
    points, parallaxes = stereoscopic_intersection(
        np.zeros_like(centre2), ray_of(image1, left[:, :, None], c1), centre2, ray_of(image2, right[:, :, None], c2)
    )
    return mxv(transposed(left)[:, :, None], points), parallaxes


def a8_model_coordinates(readings: Array, base: npt.ArrayLike, z_in: float, reference: float = 0.0) -> Array:
    """Return model points ``(3, ...)`` in mm, origin in the left centre, Z up, from readings of an A8 (P 3.1, 3.2).

    `readings` ``(3, ...)`` are those of the X and Y scales (1 unit is 2 mm, base line at Y = 200.00, left centre at X =
    200.00 - B/4) and of the height scale in mm, which increases upwards and reads `reference` where the column reads
    `z_in`. `base` is B as set, in mm.
    """
    x, y, height = readings
    return np.array(
        [2.0 * (x - 200.0 + np.asarray(base, dtype=float) / 4.0), 2.0 * (y - 200.0), height - reference - z_in]
    )
