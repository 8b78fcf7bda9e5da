"""Value noise: grey that varies smoothly between hashed values at the knots of a grid."""

import numpy as np

from a7sim.geometry import Array


def value_noise(x: Array, y: Array, stream: int) -> Array:
    """Return values -1..1 at positions of any shape; knots are one apart, and `stream` selects the noise."""
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = x - x0, y - y0
    wx, wy = fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy)
    corner = _corners(x0, y0, stream)
    low = corner[0][0] * (1.0 - wx) + corner[1][0] * wx
    high = corner[0][1] * (1.0 - wx) + corner[1][1] * wx
    return np.asarray(low * (1.0 - wy) + high * wy)


def _corners(x0: Array, y0: Array, stream: int) -> list[list[Array]]:
    """Return the values at the four corners of the cell of each position, by x and y; each knot is hashed once."""
    low_x, low_y = x0.min(initial=np.inf), y0.min(initial=np.inf)
    across, up = (int(at.max(initial=low) - low) + 2 for at, low in ((x0, low_x), (y0, low_y)))
    if not x0.size or across * up > x0.size:
        return [[_hashed(x0 + i, y0 + j, stream) for j in (0, 1)] for i in (0, 1)]
    knots = _hashed(low_x + np.arange(across)[:, None], low_y + np.arange(up), stream).ravel()
    at = ((x0 - low_x) * up + (y0 - low_y)).astype(np.intp)
    return [[knots.take(at + (i * up + j)) for j in (0, 1)] for i in (0, 1)]


def _hashed(i: Array, j: Array, stream: int) -> Array:
    mixed = (
        i.astype(np.int64).astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        ^ j.astype(np.int64).astype(np.uint64) * np.uint64(0xC2B2AE3D27D4EB4F)
        ^ np.uint64(0x165667B19E3779F9 * (stream + 1) & 0xFFFFFFFFFFFFFFFF)
    )
    mixed ^= mixed >> np.uint64(29)
    mixed *= np.uint64(0xBF58476D1CE4E5B9)
    mixed ^= mixed >> np.uint64(32)
    return np.asarray(mixed >> np.uint64(40)) / float(1 << 23) - 1.0
