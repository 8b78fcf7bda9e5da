"""What a photograph shows: texture of the ground and signals, evaluated where a place's ray meets the ground."""

from collections.abc import Callable, Sequence

import numpy as np

from a7sim.geometry import Array, length_of, ray_of
from a7sim.scene.lines import GroundLine, with_lines
from a7sim.scene.photograph import Marks
from a7sim.scene.terrain import Ground

SIGNAL_MM = 0.12
"""Half the arm of a signal on film."""

WATER_TONE = 0.2
"""Grey of still water from above, without any detail [assumption]."""

_OCTAVES_M = (160.0, 47.0, 13.0, 3.7, 1.1)


def ground_texture(east: Array, north: Array) -> Array:
    """Return grey values 0..1 of the ground in several octaves, the same for every photograph."""
    grey: Array = np.full(np.shape(east), 0.5)
    for octave, length in enumerate(_OCTAVES_M):
        grey += 0.28 * 0.72**octave * _value_noise(east / length, north / length, octave)
    return np.asarray(np.clip(grey, 0.0, 1.0))


def _value_noise(x: Array, y: Array, salt: int) -> Array:
    x0, y0 = np.floor(x), np.floor(y)
    fx, fy = x - x0, y - y0
    wx, wy = fx * fx * (3.0 - 2.0 * fx), fy * fy * (3.0 - 2.0 * fy)
    corner = _corners(x0, y0, salt)
    low = corner[0][0] * (1.0 - wx) + corner[1][0] * wx
    high = corner[0][1] * (1.0 - wx) + corner[1][1] * wx
    return np.asarray(low * (1.0 - wy) + high * wy)


def _corners(x0: Array, y0: Array, salt: int) -> list[list[Array]]:
    """Return the values at the four corners of every place's cell, by x and y; each knot is hashed but once."""
    low_x, low_y = x0.min(initial=np.inf), y0.min(initial=np.inf)
    across, up = (int(at.max(initial=low) - low) + 2 for at, low in ((x0, low_x), (y0, low_y)))
    if not x0.size or across * up > x0.size:
        return [[_hashed(x0 + i, y0 + j, salt) for j in (0, 1)] for i in (0, 1)]
    knots = _hashed(low_x + np.arange(across)[:, None], low_y + np.arange(up), salt).ravel()
    at = ((x0 - low_x) * up + (y0 - low_y)).astype(np.intp)
    return [[knots[at + (i * up + j)] for j in (0, 1)] for i in (0, 1)]


def _hashed(i: Array, j: Array, salt: int) -> Array:
    mixed = (
        i.astype(np.int64).astype(np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        ^ j.astype(np.int64).astype(np.uint64) * np.uint64(0xC2B2AE3D27D4EB4F)
        ^ np.uint64(0x165667B19E3779F9 * (salt + 1) & 0xFFFFFFFFFFFFFFFF)
    )
    mixed ^= mixed >> np.uint64(29)
    mixed *= np.uint64(0xBF58476D1CE4E5B9)
    mixed ^= mixed >> np.uint64(32)
    return np.asarray(mixed >> np.uint64(40)) / float(1 << 23) - 1.0


def signals(points: Marks) -> Callable[[Array], Array]:
    """Return a function that tells, 0..1, how much of a place ``(2, ...)`` is covered by a white cross."""

    def covered(xy: Array) -> Array:
        cover = np.zeros(xy.shape[1:])
        places = xy.reshape(2, -1)
        low, high = places.min(axis=1)[:, None] - SIGNAL_MM, places.max(axis=1)[:, None] + SIGNAL_MM
        for i in np.flatnonzero(((points.xy > low) & (points.xy < high)).all(axis=0)):
            offset = np.abs(xy - points.xy[:, i].reshape((2,) + (1,) * (xy.ndim - 1)))
            near = (offset.max(axis=0) < SIGNAL_MM) & (offset.min(axis=0) < SIGNAL_MM / 4.0)
            cover[near & (length_of(offset) > SIGNAL_MM / 4.0)] = 1.0
        return cover

    return covered


def picture_of_ground(
    ground: Ground,
    centre: Array,
    rotation: Array,
    c: float,
    to_film: Array,
    points: Marks,
    imaging: Callable[[Array], Array],
    lines: Sequence[GroundLine] = (),
) -> Callable[[Array], Array]:
    """Return the picture of the ground from a station.

    `to_film` is the film's affine deformation ``(2, 2)``, `imaging` what air and lens make of perspective images.
    """
    from_film = np.linalg.inv(to_film)
    covered = signals(points)

    def content(xy: Array) -> Array:
        perspective = _undone(imaging, np.einsum("ij,j...->i...", from_film, xy))
        met = ground.met_by(centre, ray_of(perspective, rotation, c))
        grey = with_lines(lines, met[:2], ground_texture(met[0], met[1]))
        if ground.shores:
            grey = np.where(ground.under_water(met[:2]), WATER_TONE, grey)
        return np.maximum(grey, covered(xy))

    return content


def _undone(imaging: Callable[[Array], Array], imaged: Array) -> Array:
    """Return the images that `imaging` brings to the given places, by repeated substitution."""
    image = imaged
    for _ in range(4):
        image = image + (imaged - imaging(image))
    return image


def picture_of_marks(points: Marks) -> Callable[[Array], Array]:
    """Return the picture of measured points: signals on grey."""
    covered = signals(points)
    return lambda xy: np.maximum(0.45, covered(xy))
