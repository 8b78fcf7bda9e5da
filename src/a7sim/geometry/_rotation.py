"""Rotations of a camera in the instrument frame."""

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

GON = np.pi / 200.0
"""One gon (grad, 400 to the circle) in radians."""


def dots(u: Array, v: Array) -> Array:
    """Return the scalar products of vectors of shape ``(n, ...)``."""
    return np.asarray((u * v).sum(axis=0))


def length_of(v: Array) -> Array:
    """Return the lengths of vectors of shape ``(n, ...)``."""
    return np.sqrt(dots(v, v))


def mxv(m: Array, v: Array) -> Array:
    """Multiply matrices ``(n, m, ...)`` by vectors ``(m, ...)``."""
    return np.asarray(np.einsum("ij...,j...->i...", m, v))


def mxm(m: Array, n: Array) -> Array:
    """Multiply matrices ``(n, m, ...)`` by matrices ``(m, k, ...)``."""
    return np.asarray(np.einsum("ij...,jk...->ik...", m, n))


def transposed(m: Array) -> Array:
    """Transpose matrices of shape ``(n, m, ...)``."""
    return np.swapaxes(m, 0, 1)


def rotation(omega: npt.ArrayLike, phi: npt.ArrayLike, kappa: npt.ArrayLike) -> Array:
    """Return ``Rx(omega) Ry(phi) Rz(kappa)``, shape ``(3, 3, ...)``, from angles in radians.

    It takes a camera vector into the instrument frame; omega is the primary axis, along the base, and each
    angle counts anticlockwise seen from the positive end of its axis (thesis 2.2-2.3).
    """
    omega, phi, kappa = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in (omega, phi, kappa)))
    so, co = np.sin(omega), np.cos(omega)
    sp, cp = np.sin(phi), np.cos(phi)
    sk, ck = np.sin(kappa), np.cos(kappa)
    return np.array(
        [
            [cp * ck, -cp * sk, sp],
            [co * sk + so * sp * ck, co * ck - so * sp * sk, -so * cp],
            [so * sk - co * sp * ck, so * ck + co * sp * sk, co * cp],
        ]
    )


def angles_of(m: Array) -> tuple[Array, Array, Array]:
    """Return omega, phi, kappa in radians of rotations ``(3, 3, ...)``; phi within a quarter turn of zero."""
    omega = np.arctan2(-m[1, 2], m[2, 2])
    phi = np.arctan2(m[0, 2], np.hypot(m[0, 0], m[0, 1]))
    kappa = np.arctan2(-m[0, 1], m[0, 0])
    return omega, phi, kappa


def turn_of(m: Array) -> Array:
    """Return the angle in radians, 0 to pi, of rotations ``(3, 3, ...)``."""
    axis = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    return np.asarray(np.arctan2(length_of(axis), m[0, 0] + m[1, 1] + m[2, 2] - 1.0))


def angle_between(u: Array, v: Array) -> Array:
    """Return the angle in radians between vectors of shape ``(3, ...)``, accurate for small ones too."""
    return np.asarray(np.arctan2(length_of(np.cross(u, v, axis=0)), dots(u, v)))


def plane_rotation(angle: npt.ArrayLike) -> Array:
    """Return the rotation ``(2, 2, ...)`` of the picture plane, anticlockwise, from radians."""
    angle = np.asarray(angle, dtype=float)
    s, c = np.sin(angle), np.cos(angle)
    return np.array([[c, -s], [s, c]])
