"""Spatial similarity ``X = s R x + T`` of two systems of points.

Two solutions on the same points: by iterated linearisation (P 2.1-2.7) and in closed form by the orthogonal 4x4 matrix
(T 2.35-2.39). Both minimise the same sum of squares, that of ``s R x + T - X``.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, angles_of, length_of, mxm, mxv, rotation, transposed
from a7sim.reduction.least_squares import (
    MAX_CONDITION,
    Adjustment,
    Undetermined,
    inverse_of_definite,
    solve_least_squares,
)

MIN_POINTS = 3
SIMILARITY_UNKNOWNS = ("scale", "omega", "phi", "kappa", "TX", "TY", "TZ")
"""Order of the unknowns in the statistics of a similarity; angles in radians."""

MAX_ITERATIONS = 100
MAX_TURN = 0.5
"""Radians per step; beyond it the linearised equations are meaningless."""
SCALE_FOLLOWS = 0.1
"""Radians: while rotations are larger the first scale is kept, because a misaligned fit shrinks it to zero."""
CONVERGED = 1e-12
MEMBERS_AT_A_TIME = 8192
"""Members of a batch in closed form at a time, so that intermediate values stay in the cache and memory below some tens
of MB.
"""


@dataclass(frozen=True)
class Similarity:
    """Similarity ``X = s R x + T`` with the points that determine it.

    Scale ``(...)``, rotation ``(3, 3, ...)``, translation ``(3, ...)``; points and targets ``(3, n, ...)``; weights
    ``(3, n)`` or None; iterations are zero for the closed form. Statistics are computed on demand.
    """

    scale: Array
    rotation: Array
    translation: Array
    points: Array
    targets: Array
    weights: Array | None = None
    iterations: int = 0

    def applied_to(self, points: Array) -> Array:
        """Return the points ``(3, ...)`` or ``(3, n, ...)`` in the system of the targets."""
        batch = self.scale.ndim
        if points.ndim == batch + 1:
            return np.asarray(self.scale * mxv(self.rotation, points) + self.translation)
        turned = np.einsum("ij...,jn...->in...", self.rotation, points)
        return np.asarray(self.scale * turned + self.translation[:, None])

    def inverted(self, points: Array) -> Array:
        """Return points ``(3, n, ...)`` of the targets' system in that of the points."""
        moved = (points - self.translation[:, None]) / self.scale
        return np.asarray(np.einsum("ji...,jn...->in...", self.rotation, moved))

    @cached_property
    def residuals(self) -> Array:
        """Residuals ``(3, n, ...)``, computed minus given; nan without a target."""
        return np.asarray(self.applied_to(self.points) - self.targets)

    @property
    def angles(self) -> Array:
        """Angles omega, phi, kappa ``(3, ...)`` of the rotation, radians."""
        return np.array(angles_of(self.rotation))

    @cached_property
    def adjustment(self) -> Adjustment:
        """Linearised equations at the solution, unknowns `SIMILARITY_UNKNOWNS` ``(7, ...)``.

        Raises Undetermined where phi is a right angle, because omega and kappa then rotate about the same axis.
        """
        return _statistics(self)

    @property
    def sigma_scale(self) -> Array:
        """Standard deviation ``(...)`` of the scale."""
        return np.asarray(self.adjustment.sigmas[0])

    @property
    def sigma_angles(self) -> Array:
        """Standard deviations ``(3, ...)`` of omega, phi, kappa in radians."""
        return self.adjustment.sigmas[1:4]

    @property
    def sigma_translation(self) -> Array:
        """Standard deviations ``(3, ...)`` of the translation."""
        return self.adjustment.sigmas[4:]

    @property
    def s0(self) -> Array:
        """Standard deviation ``(...)`` of unit weight, in the unit of the targets."""
        return self.adjustment.s0


def similarity_by_quaternion(points: Array, targets: Array, weights: Array | None = None) -> Similarity:
    """Return the similarity of points ``(3, n, ...)`` to targets ``(3, n, ...)`` in closed form.

    With both systems reduced to their centroids, ``X' q = q x`` is linear in the four elements (d; a, b, c) of the
    orthogonal matrix (T 2.35-2.39; q as a quaternion); its least-squares solution of unit length is the eigenvector of
    a symmetric 4x4 matrix. `weights` ``(n,)`` are multiplicities of points. Raises Undetermined for fewer than three
    points or points in a line.
    """
    points, targets = _of_one_shape(points, targets)
    shape = points.shape[2:]
    if points.ndim == 2:
        scale, turn, translation = _in_closed_form(points, targets, weights)
    else:
        members = int(np.prod(shape))
        flat_points = points.reshape((*points.shape[:2], members))
        flat_targets = targets.reshape((*targets.shape[:2], members))
        scale, turn, translation = np.empty(members), np.empty((3, 3, members)), np.empty((3, members))
        for first in range(0, members, MEMBERS_AT_A_TIME):
            part = slice(first, first + MEMBERS_AT_A_TIME)
            scale[part], turn[:, :, part], translation[:, part] = _in_closed_form(
                flat_points[:, :, part], flat_targets[:, :, part], weights
            )
        scale, turn, translation = (a.reshape((*a.shape[:-1], *shape)) for a in (scale, turn, translation))
    each = None if weights is None else np.broadcast_to(weights, points.shape[:2])
    return Similarity(np.asarray(scale), turn, translation, points, targets, each)


def similarity_by_iteration(
    points: Array, targets: Array, weights: Array | None = None, start: Array | None = None
) -> Similarity:
    """Return the similarity of points ``(3, n, ...)`` to targets ``(3, n, ...)`` by iterated linearisation.

    Seven unknowns, three equations a point (P 2.3-2.4), corrections multiplied onto the rotation (S); the first
    approximation is a rotation in plan (P 2.7) unless `start`, a rotation ``(3, 3, ...)``, is given. `weights` ``(n,)``
    or ``(3, n)``: a zero leaves the coordinate out, whatever its target. Raises Undetermined when the coordinates do
    not determine seven unknowns or the iteration does not converge.
    """
    points, targets = _of_one_shape(points, targets)
    n = points.shape[1]
    each = None if weights is None else np.broadcast_to(weights, (3, n))
    present = np.ones((3, n), dtype=bool) if each is None else each > 0.0
    known = present.reshape((3, n, *(1,) * (points.ndim - 2)))
    given = np.where(known, targets, 0.0)
    used = present.any(axis=0)
    centre_x = points[:, used].mean(axis=1) if used.any() else points.mean(axis=1)
    centre_X = given.sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    x, X = points - centre_x[:, None], np.where(known, given - centre_X[:, None], 0.0)
    first_scale, turn = _first_approximation(x, X, known, start)
    scale = first_scale
    shift = np.zeros_like(centre_X)
    rows = present.reshape(-1)
    row_weights = None if each is None else each.reshape(-1)[rows]
    if row_weights is not None:
        row_weights = row_weights.reshape((-1, *(1,) * (points.ndim - 2)))
    extent = np.sqrt((X**2).sum(axis=(0, 1)) / max(int(rows.sum()), 1))
    kicks, full = 0, bool(present.all())
    for iteration in range(1, MAX_ITERATIONS + 1):
        turned = np.einsum("ij...,jn...->in...", turn, x)
        discrepancies = np.where(known, X - scale * turned - shift[:, None], 0.0)
        design = similarity_columns(turned, scale, np.eye(3))
        step = solve_least_squares(
            _rows(design, rows), _rows(discrepancies[:, :, None], rows)[:, 0], weights=row_weights
        ).unknowns
        angle = length_of(step[1:4])
        damping = np.minimum(1.0, MAX_TURN / np.maximum(angle, 1e-300))
        near = angle < (SCALE_FOLLOWS if full else MAX_TURN)
        turn = mxm(rotation_from_vector(step[1:4] * damping), turn)
        scale = np.where(near, np.maximum(scale + step[0], scale / 3.0), first_scale if full else scale)
        shift = shift + step[4:]
        relative = np.maximum(np.abs(step[0] / scale), (np.abs(step[4:]) / extent).max(axis=0))
        if (np.maximum(angle, relative) < CONVERGED).all():
            on_a_saddle = _turned_over(turn, x, X, each) if full else np.zeros_like(near)
            if not on_a_saddle.any():
                translation = centre_X + shift - scale * mxv(turn, centre_x)
                return Similarity(np.asarray(scale), turn, translation, points, targets, each, iteration - kicks)
            kicks += 1
            off = rotation_from_vector(
                np.where(on_a_saddle, 1.0, 0.0) * np.array([0.3, 0.6, 0.9]).reshape((3, *(1,) * near.ndim))
            )
            turn = mxm(off, turn)
    raise Undetermined(f"the similarity of {n} points does not converge in {MAX_ITERATIONS} iterations")


def _of_one_shape(points: Array, targets: Array) -> tuple[Array, Array]:
    points, targets = np.asarray(points, dtype=float), np.asarray(targets, dtype=float)
    if points.ndim < targets.ndim:
        points = points.reshape((*points.shape, *(1,) * (targets.ndim - points.ndim)))
    if targets.ndim < points.ndim:
        targets = targets.reshape((*targets.shape, *(1,) * (points.ndim - targets.ndim)))
    points, targets = np.broadcast_arrays(points, targets)
    if points.shape[1] < 1:
        raise Undetermined("expected common points, got none")
    return points, targets


def _first_approximation(x: Array, X: Array, known: Array, start: Array | None) -> tuple[Array, Array]:
    """Return the scale and the rotation from the plan of the points."""
    plan = known[0] & known[1]
    count = np.maximum(plan.sum(axis=0), 1)
    px, py, PX, PY = (np.where(plan, a - np.where(plan, a, 0.0).sum(axis=0) / count, 0.0) for a in (*x[:2], *X[:2]))
    across, along = (px * PY - py * PX).sum(axis=0), (px * PX + py * PY).sum(axis=0)
    if known.all():
        size, reach = (x**2).sum(axis=(0, 1)), (X**2).sum(axis=(0, 1))
    else:
        size, reach = (px**2 + py**2).sum(axis=0), (PX**2 + PY**2).sum(axis=0)
    if not ((size > 0.0) & (reach > 0.0)).all():
        raise Undetermined("expected points apart from each other in plan, got all in one place")
    scale = np.sqrt(reach / size)
    if start is not None:
        return scale, np.broadcast_to(start, (3, 3, *scale.shape)) if start.ndim == 2 + scale.ndim else np.asarray(
            np.broadcast_to(start.reshape((3, 3, *(1,) * scale.ndim)), (3, 3, *scale.shape))
        )
    zero = np.zeros_like(scale)
    return scale, rotation(zero, zero, np.arctan2(across, along))


def similarity_columns(turned: Array, scale: Array, axes: Array) -> Array:
    """Return the derivatives ``(3, n, 7, ...)`` by scale, by turns about three axes and by translation."""
    n = turned.shape[1]
    columns = np.zeros((3, n, 7, *turned.shape[2:]))
    columns[:, :, 0] = turned
    for k in range(3):
        axis = axes[:, k]
        axis = axis.reshape((3, 1, *axis.shape[1:], *(1,) * (turned.ndim - 1 - axis.ndim)))
        a = np.broadcast_to(axis, (3, 1, *turned.shape[2:]))
        columns[0, :, 1 + k] = scale * (a[1] * turned[2] - a[2] * turned[1])
        columns[1, :, 1 + k] = scale * (a[2] * turned[0] - a[0] * turned[2])
        columns[2, :, 1 + k] = scale * (a[0] * turned[1] - a[1] * turned[0])
        columns[k, :, 4 + k] = 1.0
    return columns


def _rows(columns: Array, keep: npt.NDArray[np.bool_]) -> Array:
    """Return ``(3, n, u, ...)`` as the kept rows ``(3n, u, ...)``."""
    flat = columns.reshape((columns.shape[0] * columns.shape[1], *columns.shape[2:]))
    return flat if keep.all() else flat[keep]


def rotation_from_vector(vector: Array) -> Array:
    """Return the rotation ``(3, 3, ...)`` about a vector ``(3, ...)`` by its length in radians."""
    angle = length_of(vector)
    half = np.sinc(angle / (2.0 * np.pi)) / 2.0  # sin(angle / 2) / angle
    return _rotation_of(np.array([np.cos(angle / 2.0), *(half * vector)]))


def _rotation_of(q: Array) -> Array:
    """Return the rotation ``(3, 3, ...)`` of a quaternion ``(4, ...)`` of any length, scalar d first (T 2.35)."""
    d, a, b, c = q / np.sqrt((q * q).sum(axis=0))
    return np.array(
        [
            [d * d + a * a - b * b - c * c, 2.0 * (a * b - c * d), 2.0 * (a * c + b * d)],
            [2.0 * (a * b + c * d), d * d - a * a + b * b - c * c, 2.0 * (b * c - a * d)],
            [2.0 * (a * c - b * d), 2.0 * (b * c + a * d), d * d - a * a - b * b + c * c],
        ]
    )


def _turned_over(turn: Array, x: Array, X: Array, weights: Array | None) -> Array:
    """Return where a stationary rotation is no minimum: half a turn about some axis is closer."""
    weighted = X if weights is None else X * weights.reshape((*weights.shape, *(1,) * (X.ndim - 2)))
    k = mxm(transposed(turn), np.einsum("in...,jn...->ij...", weighted, x))
    inverse = inverse_of_definite(_curvature(k))
    return np.asarray(~np.isfinite(inverse).all(axis=(0, 1)))


def _curvature(k: Array) -> Array:
    """Return ``tr(K) I - K``, the second derivative of the fit by small turns, of ``K`` made symmetric."""
    trace = k[0, 0] + k[1, 1] + k[2, 2]
    result = -(k + transposed(k)) / 2.0
    for i in range(3):
        result[i, i] += trace
    return np.asarray(result)


def _in_closed_form(points: Array, targets: Array, weights: Array | None) -> tuple[Array, Array, Array]:
    n = points.shape[1]
    if n < MIN_POINTS:
        raise Undetermined(f"expected at least {MIN_POINTS} common points, got {n}")
    if weights is None:
        centre_x, centre_X = points.sum(axis=1) / n, targets.sum(axis=1) / n
        x, X = points - centre_x[:, None], targets - centre_X[:, None]
        weighted = x
    else:
        share = (weights / weights.sum()).reshape((n, *(1,) * (points.ndim - 2)))
        centre_x, centre_X = (share * points).sum(axis=1), (share * targets).sum(axis=1)
        x, X = points - centre_x[:, None], targets - centre_X[:, None]
        weighted = share * x
    size = (weighted * x).sum(axis=(0, 1))
    reach = (X**2 if weights is None else share * X**2).sum(axis=(0, 1))
    norm = np.sqrt(size * reach)
    if not (norm > 0.0).all():
        raise Undetermined("expected points apart from each other, got all in one place")
    if points.ndim == 2:
        h = X @ weighted.T / norm
    else:
        h = np.array([[(X[i] * weighted[j]).sum(axis=0) for j in range(3)] for i in range(3)]) / norm
    q = _largest_eigenvector(_symmetric_4x4(h), h)
    turn = _rotation_of(q)
    k = mxm(transposed(turn), h)
    curvature = _curvature(k)
    inverse = inverse_of_definite(curvature)
    condition = np.abs(curvature).sum(axis=0).max(axis=0) * np.abs(inverse).sum(axis=0).max(axis=0)
    if not (condition < MAX_CONDITION).all():
        raise Undetermined(f"the {n} points lie in a line: the turn about it is open")
    w = mxv(inverse, np.array([k[2, 1] - k[1, 2], k[0, 2] - k[2, 0], k[1, 0] - k[0, 1]])) / 2.0
    d, a, b, c = q  # q (1, w): one step of Newton makes good what the characteristic equation lost
    q = np.array(
        [
            d - a * w[0] - b * w[1] - c * w[2],
            a + d * w[0] + b * w[2] - c * w[1],
            b + d * w[1] + c * w[0] - a * w[2],
            c + d * w[2] + a * w[1] - b * w[0],
        ]
    )
    turn = _rotation_of(q)
    scale = (turn * h).sum(axis=(0, 1)) * norm / size
    return np.asarray(scale), turn, np.asarray(centre_X - scale * mxv(turn, centre_x))


def _symmetric_4x4(h: Array) -> Array:
    """Return the matrix ``(4, 4, ...)`` whose largest eigenvector is the quaternion, of ``H = sum X x^T``."""
    xx, yy, zz = h[0, 0], h[1, 1], h[2, 2]
    p, q, r = h[2, 1] - h[1, 2], h[0, 2] - h[2, 0], h[1, 0] - h[0, 1]
    u, v, w = h[1, 0] + h[0, 1], h[0, 2] + h[2, 0], h[2, 1] + h[1, 2]
    return np.array(
        [[xx + yy + zz, p, q, r], [p, xx - yy - zz, u, v], [q, u, yy - xx - zz, w], [r, v, w, zz - xx - yy]]
    )


def _largest_eigenvector(n: Array, h: Array) -> Array:
    """Return the eigenvectors ``(4, ...)`` of the largest eigenvalues of traceless ``(4, 4, ...)``.

    A batch by Newton on the characteristic equation, from above the largest root, and by the cofactors; each member
    stops separately, so that its digits do not depend on the other members.
    """
    if n.ndim == 2:
        return np.asarray(np.linalg.eigh(n)[1][:, 3])
    det_h = (
        h[0, 0] * (h[1, 1] * h[2, 2] - h[1, 2] * h[2, 1])
        - h[0, 1] * (h[1, 0] * h[2, 2] - h[1, 2] * h[2, 0])
        + h[0, 2] * (h[1, 0] * h[2, 1] - h[1, 1] * h[2, 0])
    )
    c2, c1 = -2.0 * (h * h).sum(axis=(0, 1)), -8.0 * det_h
    adjoint = _cofactors_4x4(n)
    c0 = sum((n[0, i] * adjoint[0, i] for i in range(1, 4)), n[0, 0] * adjoint[0, 0])
    root, moving = np.ones_like(c0), np.ones(c0.shape, dtype=bool)
    for _ in range(60):
        square = root * root
        slope = 4.0 * square * root + 2.0 * c2 * root + c1
        value = (square + c2) * square + c1 * root + c0
        step = np.where(slope > 0.0, value / np.where(slope > 0.0, slope, 1.0), 0.0)
        root = root - np.where(moving, step, 0.0)
        moving &= np.abs(step) >= 1e-13
        if not moving.any():
            break
    shifted = n.copy()
    for i in range(4):
        shifted[i, i] -= root
    adjoint = _cofactors_4x4(shifted)
    largest = np.abs(np.array([adjoint[i, i] for i in range(4)])).argmax(axis=0)
    vector = np.take_along_axis(adjoint, largest[None, None], axis=1)[:, 0]
    size = np.sqrt((vector * vector).sum(axis=0))
    return np.asarray(vector / np.where(size > 0.0, size, 1.0) + np.where(size > 0.0, 0.0, 1.0))


def _cofactors_4x4(m: Array) -> Array:
    """Return the cofactors ``(4, 4, ...)`` of symmetric matrices, by the minors of their halves."""

    def minor(i: int, j: int, k: int) -> Array:
        return np.asarray(m[i, j] * m[i + 1, k] - m[i, k] * m[i + 1, j])

    s0, s1, s2, s3, s4 = (minor(0, j, k) for j, k in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3)))
    c0, c1, c2, c3, c4, c5 = (minor(2, j, k) for j, k in ((0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)))
    a01 = -m[1, 0] * c5 + m[1, 2] * c2 - m[1, 3] * c1
    a02 = m[1, 0] * c4 - m[1, 1] * c2 + m[1, 3] * c0
    a03 = -m[1, 0] * c3 + m[1, 1] * c1 - m[1, 2] * c0
    a12 = -m[0, 0] * c4 + m[0, 1] * c2 - m[0, 3] * c0
    a13 = m[0, 0] * c3 - m[0, 1] * c1 + m[0, 2] * c0
    a23 = -m[3, 0] * s3 + m[3, 1] * s1 - m[3, 2] * s0
    a00 = m[1, 1] * c5 - m[1, 2] * c4 + m[1, 3] * c3
    a11 = m[0, 0] * c5 - m[0, 2] * c2 + m[0, 3] * c1
    a22 = m[3, 0] * s4 - m[3, 1] * s2 + m[3, 3] * s0
    a33 = m[2, 0] * s3 - m[2, 1] * s1 + m[2, 2] * s0
    return np.array([[a00, a01, a02, a03], [a01, a11, a12, a13], [a02, a12, a22, a23], [a03, a13, a23, a33]])


def _statistics(found: Similarity) -> Adjustment:
    """Return the linearised equations at the solution, with the covariance transformed to the origin of the points."""
    n = found.points.shape[1]
    keep = np.ones(3 * n, dtype=bool) if found.weights is None else (found.weights > 0.0).reshape(-1)
    weights = None if found.weights is None else found.weights.reshape(-1)[keep]
    if weights is not None:
        weights = weights.reshape((-1, *(1,) * (found.points.ndim - 2)))
    omega = found.angles[0]
    zero = np.zeros_like(omega)
    about_omega = np.array([zero + 1.0, zero, zero])
    axes = np.stack([about_omega, rotation(omega, zero, zero)[:, 1], found.rotation[:, 2]], axis=1)
    centre = found.points.mean(axis=1)
    turned = np.einsum("ij...,jn...->in...", found.rotation, found.points - centre[:, None])
    design = _rows(similarity_columns(turned, found.scale, axes), keep)
    observed = -_rows(found.residuals[:, :, None], keep)[:, 0]
    local = solve_least_squares(design, observed, weights=weights)
    at_centre = similarity_columns(mxv(found.rotation, centre)[:, None], found.scale, axes)[:, 0]
    carry = np.zeros_like(local.cofactors)
    for i in range(7):
        carry[i, i] = 1.0
    carry[4:, :4] = -at_centre[:, :4]
    cofactors = np.einsum("ij...,jk...,lk...->il...", carry, local.cofactors, carry)
    back = carry.copy()
    back[4:, :4] = at_centre[:, :4]
    unknowns = np.array([found.scale, *found.angles, *found.translation])
    residuals = -observed
    degrees = local.redundancy
    squares = (residuals**2 if weights is None else weights * residuals**2).sum(axis=0)
    s0 = np.sqrt(squares / degrees) if degrees > 0 else np.zeros_like(found.scale)
    design = np.einsum("nu...,uv...->nv...", design, back)
    return replace(local, unknowns=unknowns, cofactors=cofactors, residuals=residuals, s0=np.asarray(s0), design=design)
