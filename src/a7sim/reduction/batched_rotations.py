"""Small rotations of both cameras about the axes of the base, for a batch of pairs."""

from math import prod

import numpy as np

from a7sim.geometry import Array


class RotationWorkspace:
    """Work arrays of pairs ``(...)`` for the rotation of cameras, filled anew in each call."""

    def __init__(self, batch: tuple[int, ...]) -> None:
        empty = aligned_array if batch else np.empty
        self.halves = empty((2, 3, *batch))
        self.turn = empty((2, 3, 3, *batch))
        self.rotations = empty((2, 2, 3, 3, *batch))
        self.turning = empty((2, 3, 3, *batch))


def aligned_array(shape: tuple[int, ...]) -> Array:
    """Return an array that starts at a multiple of 64 bytes."""
    size = prod(shape)
    room = np.empty(size + 8)
    first = -room.ctypes.data % 64 // 8
    return room[first : first + size].reshape(shape)


def rotate_by(R: Array, turns: Array, work: RotationWorkspace | None = None, level: bool = False) -> Array:
    """Rotate both cameras ``(2, 3, 3, ...)`` about the axes of the base by the unknowns of the equations, radians.

    Only the difference of the omegas is determined; each camera takes half.
    """
    if R.ndim == 3:  # one pair: the same in few calls
        half = (_HALF_TURNS @ turns).reshape(2, 3, 3)
        along = half @ R
        return np.asarray(
            R + (along + half @ along) * (2.0 / (1.0 + 0.5 * (half * half).sum(axis=(1, 2), keepdims=True)))
        )
    work = work or RotationWorkspace(R.shape[3:])
    halves = work.halves
    np.multiply(turns[:2], 0.5, out=halves[0, 1:])
    np.multiply(turns[2:4], -0.5, out=halves[1, 1:])
    np.multiply(turns[4], 0.25, out=halves[1, 0])
    np.negative(halves[1, 0], out=halves[0, 0])
    result = work.rotations[1 if np.may_share_memory(R, work.rotations[0]) else 0]
    if level:
        return _turn_by_halves(halves, result)
    turn, product = _turn_by_halves(halves, work.turn), work.turning
    np.multiply(turn[:, :, 0, None], R[:, None, 0], out=result)
    for j in (1, 2):
        np.multiply(turn[:, :, j, None], R[:, None, j], out=product)
        result += product
    return np.asarray(result)


def _half_turns() -> Array:
    """Return, for the five unknowns, the skew matrices of half the rotations of both cameras, ``(18, 5)``."""
    half = np.zeros((2, 3, 3, 5))
    for camera, axis, unknown, share in (
        (0, 0, 4, -0.25), (0, 1, 0, 0.5), (0, 2, 1, 0.5), (1, 0, 4, 0.25), (1, 1, 2, -0.5), (1, 2, 3, -0.5),
    ):  # fmt: skip
        half[camera, (axis + 2) % 3, (axis + 1) % 3, unknown] = share
        half[camera, (axis + 1) % 3, (axis + 2) % 3, unknown] = -share
    return half.reshape(18, 5)


_HALF_TURNS = _half_turns()


def rotation_about(turns: Array) -> Array:
    """Return rotations ``(3, 3, ...)`` about axes ``(3, ...)`` whose length is twice the tangent of half the angle.

    For a small rotation that is the angle in radians.
    """
    return np.asarray(_turn_by_halves(0.5 * turns[None], np.empty((1, 3, *turns.shape)))[0])


def _turn_by_halves(half: Array, turn: Array) -> Array:
    """Fill rotations ``(k, 3, 3, ...)`` about axes ``(k, 3, ...)`` whose length is the tangent of half the angle."""
    np.multiply(half[:, :, None], half[:, None], out=turn)
    square = turn[:, 0, 0] + turn[:, 1, 1] + turn[:, 2, 2]
    share = 2.0 / (1.0 + square)
    turn *= share[:, None, None]
    along = half * share[:, None]
    rest = 1.0 - share * square
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        turn[:, i, i] += rest
        turn[:, i, j] -= along[:, k]
        turn[:, j, i] += along[:, k]
    return turn
