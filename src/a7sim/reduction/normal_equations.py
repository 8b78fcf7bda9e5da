"""Normal equations of coplanarity, formed and solved for a batch of pairs in reused arrays."""

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, mxv
from a7sim.reduction.batched_rotations import RotationWorkspace, aligned_array

MAX_CONDITION = 3e5
"""Of the scaled normal equations for turns about the axes of the base. Six standard points have some 3e2, the weak pair
of reference 07 has 8e3; points on a line or on a critical surface, measured to 5 um, have 2e6 and more. Beyond 3e5 such
errors turn a camera by half a degree."""

CONDITION_BY_DETERMINANT = 5.0 * 5.0**0.5 * 1.25**4
"""Of five scaled equations: the 1-norm is at most 5 and root 5 times the spectral norm of the inverse, whose
eigenvalues add up to 5 before they are inverted."""


class Workspace(RotationWorkspace):
    """Work arrays of the steps of an iteration, of pairs ``(...)`` with n points.

    They are aligned to cache lines: numpy takes half the time of arrays at arbitrary addresses.
    """

    def __init__(self, n: int, batch: tuple[int, ...]) -> None:
        super().__init__(batch)
        self.shape = (n, *batch)
        empty = aligned_array if batch else np.empty
        self.rays = empty((2, 3, n, *batch))
        self.turned = empty((2, 3, n, *batch))
        self.spare = empty((6, n, *batch))
        self.rows = empty((6, n, *batch))
        self.steepness = empty((n, *batch))
        self.normal = empty((6, 6, *batch))
        self.reduced = empty((6, 6, *batch))
        self.product = empty((5, 5, *batch))
        self.shares = empty((5, *batch))


def fast_all(mask: npt.NDArray[np.bool_]) -> bool:
    """Return `mask.all()`, faster for a single pair."""
    return bool(mask.all() if mask.ndim else mask)


def fast_any(mask: npt.NDArray[np.bool_]) -> bool:
    """Return `mask.any()`, faster for a single pair."""
    return bool(mask.any() if mask.ndim else mask)


def condition_numbers(work: Workspace) -> Array:
    """Return the condition numbers ``(...)`` of the scaled normal equations, in the 1-norm, or small bounds of them.

    Their determinant bounds them, so that an inverse is rarely needed.
    """
    normal, pivots = work.normal[:5, :5], work.reduced[:5, :5].diagonal().T
    shares = np.divide(pivots, normal.diagonal().T, out=work.shares)
    bound = np.array(CONDITION_BY_DETERMINANT / shares.prod(axis=0))
    doubtful = ~((bound > 0.0) & (bound < MAX_CONDITION))
    if fast_any(doubtful):
        bound[doubtful] = _condition(normal[..., doubtful]) if normal.ndim > 2 else _condition(normal)
    return bound


def symmetrize(normal: Array) -> Array:
    """Return the full symmetric normal equations from those on and above the diagonal."""
    full = normal.copy()
    for i in range(len(full) - 1):
        full[i + 1 :, i] = full[i, i + 1 :]
    return full


def _condition(normal: Array) -> Array:
    """Return the condition numbers ``(...)`` of normal equations ``(5, 5, ...)`` when scaled, in the 1-norm."""
    spread = np.sqrt(normal.diagonal().T)
    scaled = symmetrize(normal) / (spread[:, None] * spread)
    condition = np.abs(scaled).sum(axis=0).max(axis=0) * np.abs(invert(scaled)).sum(axis=0).max(axis=0)
    return np.where(np.isfinite(condition), condition, np.inf)


def fast_mxv(matrix: Array, vector: Array) -> Array:
    """Return `mxv`, faster for a single matrix."""
    return np.asarray(matrix @ vector) if matrix.ndim == 2 else mxv(matrix, vector)


def rotate_to_base(R: Array, rays: Array) -> Array:
    """Rotate the rays ``(2, 3, n, ...)`` of both cameras by rows of their rotations ``(2, i, 3, ...)``."""
    return R @ rays if rays.ndim == 3 else np.asarray(np.einsum("kij...,kjn...->kin...", R, rays))


def compute_discrepancies(across: Array) -> Array:
    """Return ``y1 z2 - z1 y2`` of ray components y, z ``(2, 2, n, ...)``."""
    return np.asarray(across[0, 0] * across[1, 1] - across[0, 1] * across[1, 0])


def form_equations(R: Array, rays: Array, work: Workspace) -> None:
    """Form the equations in mm of one image coordinate, in `work.rows`, of rotated rays.

    The left rays are divided by the change of the condition with the four image coordinates: that is ``(0, -z, y)`` of
    the other ray without its component along the axis of the camera.
    """
    a, steepness = work.turned, work.steepness
    spare = work.spare.reshape(a.shape)
    if rays.ndim == 3:
        np.matmul(R, rays, out=a)
    else:
        np.multiply(R[:, :, 0, None], rays[:, None, 0], out=a)
        np.multiply(R[:, :, 1, None], rays[:, None, 1], out=spare)
        a += spare
        a += (R[:, :, 2] * rays[:, 2:, 0])[:, :, None]
    one, other = spare.reshape((3, 2, *work.shape))[:2]
    np.multiply(a[0, 1:], a[0, 1:], out=one)
    np.multiply(a[1, 1:], a[1, 1:], out=other)
    one += other
    np.add(one[0], one[1], out=steepness)
    np.multiply(R[::-1, 1, 2, None], a[:, 2], out=one)
    np.multiply(R[::-1, 2, 2, None], a[:, 1], out=other)
    one -= other
    one *= one
    steepness -= one[0]
    steepness -= one[1]
    np.sqrt(steepness, out=steepness)
    a[0] /= steepness
    _form_rows(a, work)


def form_level_equations(rays: Array, work: Workspace) -> None:
    """Form the equations of `form_equations` for level cameras."""
    work.steepness[:] = np.hypot(rays[0, 2].flat[0], rays[1, 2].flat[0])
    work.turned[:] = rays
    work.turned[0] /= work.steepness
    _form_rows(work.turned, work)


def _form_rows(a: Array, work: Workspace) -> None:
    """Form the five coefficients and the discrepancy ``(6, n, ...)`` from rays ``(2, 3, n, ...)``.

    The coefficients of the right camera are for the opposite rotations.
    """
    rows, products = work.rows, work.spare[:2]
    (x1, y1, z1), (x2, y2, z2) = a
    np.multiply(x1, a[1, 1:], out=rows[0:2])
    np.multiply(x2, a[0, 1:], out=rows[2:4])
    np.multiply(y1, a[1, 1:], out=rows[4:6])
    np.multiply(z1, z2, out=products[0])
    np.multiply(z1, y2, out=products[1])
    rows[4] += products[0]
    rows[5] -= products[1]


def form_products(work: Workspace) -> None:
    """Form the sums over n of products ``(6, 6, ...)`` of the rows; in a batch, on the diagonal and above."""
    rows, normal = work.rows, work.normal
    if rows.ndim == 2:
        np.matmul(rows, rows.T, out=normal)
        return
    for i, row in enumerate(rows):
        np.einsum("n...,vn...->v...", row, rows[i:], out=normal[i, i:])


def solve(work: Workspace, stiffness: Array) -> Array:
    """Return the corrections ``(5, ...)`` of the normal equations, damped by a share of their diagonal.

    `work.reduced` contains the result of the elimination: the pivots and, last, the sum of squared residuals.
    """
    if work.normal.ndim == 2:
        return _solved_alone(work, float(stiffness))
    reduced, shares, product = work.reduced, work.shares, work.product[0]
    for i in range(6):
        reduced[i, i:] = work.normal[i, i:]
    stiffer = 1.0 + stiffness
    for i in range(5):
        reduced[i, i] *= stiffer
    for i in range(5):
        row = reduced[i]
        np.divide(row[i + 1 :], row[i], out=shares[i:])
        for j in range(i + 1, 6):
            np.multiply(row[j], shares[j - 1 :], out=product[j - 1 :])
            reduced[j, j:] -= product[j - 1 :]
        row[i + 1 :] = shares[i:]
    corrections = -reduced[:5, 5]
    for i in range(4, 0, -1):
        corrections[:i] -= reduced[:i, i] * corrections[i]
    return corrections


def _solved_alone(work: Workspace, stiffness: float) -> Array:
    """Return the result of `solve` for one pair with Python numbers, which are faster than arrays of one number."""
    rows = work.normal.tolist()
    for i in range(5):
        rows[i][i] *= 1.0 + stiffness
    try:
        for i in range(5):
            row = rows[i]
            for j in range(i + 1, 6):
                share = row[j] / row[i]
                for k in range(j, 6):
                    rows[j][k] -= share * row[k]
            row[i + 1 :] = [value / row[i] for value in row[i + 1 :]]
    except ZeroDivisionError:
        work.reduced[:] = np.nan
        return np.full(5, np.nan)
    work.reduced[:] = rows
    corrections = [-row[5] for row in rows[:5]]
    for i in range(4, 0, -1):
        for j in range(i):
            corrections[j] -= rows[j][i] * corrections[i]
    return np.array(corrections)


def invert(matrix: Array) -> Array:
    """Return the inverses of positive definite matrices ``(u, u, ...)``; not finite for singular ones.

    A batch is computed elementwise by exchange of one unknown after the other, a single matrix by LAPACK.
    """
    if matrix.ndim == 2:
        try:
            return np.asarray(np.linalg.inv(matrix))
        except np.linalg.LinAlgError:
            return np.full_like(matrix, np.nan)
    inverse, product = aligned_array(matrix.shape), aligned_array(matrix.shape)
    inverse[:] = matrix
    for j in range(len(matrix)):
        reciprocal = 1.0 / inverse[j, j]
        column, row = inverse[:, j] * reciprocal, inverse[j].copy()
        np.multiply(column[:, None], row, out=product)
        inverse -= product
        np.multiply(row, reciprocal, out=inverse[j])
        np.negative(column, out=inverse[:, j])
        inverse[j, j] = reciprocal
    return inverse
