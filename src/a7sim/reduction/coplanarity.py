"""Rigorous relative orientation: image coordinates to orientation by the coplanarity of rays (paper P 1.1-1.8).

With the X axis along the base, two rays ``a1``, ``a2`` meet when ``y1 z2 - z1 y2 = 0``. A small turn of either camera
changes that by products of their components alone,

    de = x1 y2 dphi1 + x1 z2 dkappa1 - x2 y1 dphi2 - x2 z1 dkappa2 + (y1 y2 + z1 z2) (domega2 - domega1),

for any tilt, when the angles are small turns about the axes of the base. The cameras are therefore turned by
rotations, not by adding to angles; the unknowns an office asks for are taken from them in the end. Each equation
is divided by what it changes by with the four image coordinates, so that s0 is that of one of them.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, angles_of, dots, length_of, mxm, mxv, rotation, transposed
from a7sim.reduction.least_squares import Adjustment, Undetermined, adjusted

Unknowns = Literal["independent", "dependent"]

FEWEST_POINTS = 5
MOST_ITERATIONS = 30
TOLERANCE = 2e-11
"""Radians: iterations end when the next correction, at the rate at which they shrink, would be below it. What is then
left is below 1e-10."""

LARGEST_CONDITION = 3e5
"""Of the scaled normal equations for turns about the axes of the base. Six standard points have some 3e2, the weak pair
of reference 07 has 8e3; points on a line or on a critical surface, measured to 5 um, have 2e6 and more. Beyond 3e5 such
errors turn a camera by half a degree."""

HOPELESS = 10.0
"""Pairs whose first equations are worse than that by as much are refused whatever they come to."""

LARGEST_S0 = 0.005
"""Of c: a solution found from quarter turns that leaves more is none."""

FAR = 3e-4
"""Radians: after a larger correction the same normal equations are solved for what is left, too."""

LARGEST_TURN = 0.4
"""Radians, in one step: farther away the linear equations say nothing."""

DAMPING = 0.5
"""Share of the mean square discrepancy, in radians squared, that stiffens the normal equations far from the end."""

CHORDS = 6
WEAKNESS = 10.0
"""By how much the discrepancies are multiplied in the unknowns, for a guess at what is left to correct."""

STEADY = 0.8
"""A chord step that is not below this share of the step before it is not taken."""

WORKING_SET = 8000
"""Points worked at a time, so that what is computed of them stays in the cache."""

QUARTER_TURNS = ((0, 0), (2, 2), (1, 1), (3, 3), (0, 2), (2, 0), (0, 1), (0, 3), (1, 0), (3, 0))
"""Swings of the two cameras, in quarter turns, from which pairs are tried that do not converge from zero."""


@dataclass(frozen=True)
class RelativePoses:
    """What relative orientation comes to for each pair of a batch ``(...)``, without the statistics of its unknowns.

    Where `converged` is False the pair is not oriented and its other values mean nothing.
    """

    rotations: Array
    """Shape ``(2, 3, 3, ...)``: of both cameras, into the frame with the base along X."""

    s0: Array
    """Standard deviation of one image coordinate in the unit of the images; zero for five points."""

    condition: Array
    iterations: npt.NDArray[np.int64]
    converged: npt.NDArray[np.bool_]
    """Iterations ended by themselves, the condition is sound and all points lie before both cameras."""

    @property
    def rotation(self) -> Array:
        """Rotations ``(3, 3, ...)`` that take the right photograph's vectors into the left photograph's frame."""
        return mxm(transposed(self.rotations[0]), self.rotations[1])

    @property
    def base(self) -> Array:
        """Unit vectors ``(3, ...)`` from the left to the right centre in the left photograph's frame."""
        return np.asarray(self.rotations[0, 0])


@dataclass(frozen=True)
class RelativeOrientation:
    """A pair of photographs, or a batch of pairs ``(...)``, oriented to each other.

    Its frame is that of the unknowns: independent, X along the base and omega of one camera at zero; dependent, the
    left photograph's own.
    """

    unknowns: tuple[str, ...]
    adjustment: Adjustment
    """Unknowns in radians and mm in the order of `unknowns`; residuals, weights 1, in mm of one image coordinate."""

    angles1: Array
    angles2: Array
    """omega, phi, kappa ``(3, ...)`` in radians."""

    centre2: Array
    """The right centre ``(3, ...)`` in mm from the left one."""

    rotation: Array
    """Shape ``(3, 3, ...)``: takes the right photograph's camera vectors into the left photograph's frame."""

    base: Array
    """Unit vector ``(3, ...)`` from the left to the right centre in the left photograph's frame."""

    corrections1: Array
    corrections2: Array
    """Corrections ``(2, n, ...)`` in mm of the image coordinates, with which the rays meet."""

    iterations: npt.NDArray[np.int64]
    converged: npt.NDArray[np.bool_]

    @property
    def elements(self) -> Mapping[str, Array]:
        """The unknowns by name, radians and mm."""
        return dict(zip(self.unknowns, self.adjustment.unknowns, strict=True))

    @property
    def sigmas(self) -> Mapping[str, Array]:
        """Standard deviations of the unknowns by name, radians and mm."""
        return dict(zip(self.unknowns, self.adjustment.sigmas, strict=True))

    @property
    def s0(self) -> Array:
        """Standard deviation of one image coordinate in mm; zero for five points."""
        return self.adjustment.s0

    @property
    def condition(self) -> Array:
        """Condition number of the scaled normal equations."""
        return self.adjustment.condition

    @property
    def picture_parallaxes(self) -> Array:
        """Residual y-parallaxes ``(n, ...)`` in mm at the scale of the pictures, left minus right."""
        return np.asarray(np.sqrt(2.0) * self.adjustment.residuals)


def relative_orientation(
    image1: Array,
    image2: Array,
    c1: float,
    c2: float,
    unknowns: Unknowns = "independent",
    omega: Literal[1, 2] = 2,
    bx: float = 1.0,
) -> RelativeOrientation:
    """Orient pairs of photographs to each other from image points ``(2, n, ...)`` in mm, for any tilt, from zero.

    `unknowns` are kappa1, kappa2, phi1, phi2 and the omega of camera `omega` ("independent"; P has omega2, the thesis
    omega1), or omega2, phi2, kappa2 and the base components by2, bz2 in mm beside the given bx ("dependent"). Those
    are components of the base, so that by2 counts with Y and not as a by spindle does. An iteration is one set of
    normal equations, formed and reduced; far from the end it is solved for up to six more right-hand sides.

    Raises Undetermined, with the condition number, for fewer than five points, for points on a line or a critical
    surface and for pairs whose rays do not meet before both cameras; in a batch for any of its pairs. Use
    `relative_poses` where single pairs may fail.
    """
    poses = relative_poses(image1, image2, c1, c2)
    if not poses.converged.all():
        raise Undetermined(_why(poses, image1.shape[1]))
    right = np.array([1.0, 0.0, 0.0]).reshape((3, *(1,) * (image1.ndim - 2)))
    if unknowns == "independent":
        names: tuple[str, ...] = ("kappa1", "kappa2", "phi1", "phi2", f"omega{omega}")
        level = rotation(-angles_of(poses.rotations[2 - omega])[0], 0.0, 0.0)
        rotation1, rotation2 = mxm(level, poses.rotations[0]), mxm(level, poses.rotations[1])
        centre2 = np.broadcast_to(bx * right, poses.base.shape)
    else:
        names = ("omega2", "phi2", "kappa2", "by2", "bz2")
        rotation1 = np.broadcast_to(np.eye(3).reshape((3, 3, *right.shape[1:])), poses.rotations[0].shape)
        rotation2 = poses.rotation
        centre2 = poses.base * (bx / np.abs(poses.base[0]))
    return finished(
        (image1, image2), (c1, c2), names, (rotation1, rotation2), centre2, poses.iterations, poses.converged
    )


def relative_poses(image1: Array, image2: Array, c1: float, c2: float, tolerance: float = TOLERANCE) -> RelativePoses:
    """Orient many pairs from image points ``(2, n, ...)`` in mm, without the statistics of the unknowns.

    Pairs are worked in sets that fit the cache. Those that do not converge from zero are tried again from swings of
    quarter turns, and their iterations are added up. Raises Undetermined for fewer than five points.
    """
    n = image1.shape[1]
    if n < FEWEST_POINTS:
        raise Undetermined(f"expected at least {FEWEST_POINTS} points to orient a pair of photographs, got {n}")
    batch = image1.shape[2:]
    if not batch:
        return _resolved(np.array([image1, image2]), c1, c2, tolerance)
    images = image1.reshape((2, n, -1)), image2.reshape((2, n, -1))
    step = max(1, WORKING_SET // n)
    parts = [
        _resolved(np.array([each[..., i : i + step] for each in images]), c1, c2, tolerance)
        for i in range(0, images[0].shape[-1], step)
    ]
    return RelativePoses(
        *(
            np.concatenate([getattr(part, name) for part in parts], axis=-1).reshape((*shape, *batch))
            for name, shape in _SHAPES.items()
        )
    )


_SHAPES = {"rotations": (2, 3, 3), "s0": (), "condition": (), "iterations": (), "converged": ()}


def _resolved(images: Array, c1: float, c2: float, tolerance: float) -> RelativePoses:
    """Orient pairs ``(2, 2, n, ...)`` from zero, and those that refuse from swings of quarter turns."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # singular pairs of a batch
        return _tried(images, c1, c2, tolerance)


def _tried(images: Array, c1: float, c2: float, tolerance: float) -> RelativePoses:
    rays = np.empty((2, 3, *images.shape[2:]))
    rays[:, :2] = images
    rays[0, 2], rays[1, 2] = -c1, -c2
    found = _oriented(rays, (0, 0), tolerance)
    for swings in QUARTER_TURNS[1:]:
        open_ = ~found.converged & ~(found.condition >= LARGEST_CONDITION)
        if not open_.any():
            break
        again = _oriented(rays[..., open_] if rays.ndim > 3 else rays, swings, tolerance)
        again = replace(again, converged=again.converged & (again.s0 < LARGEST_S0 * c1))
        found = _replaced(found, open_, again)
    return found


def _replaced(found: RelativePoses, where: npt.NDArray[np.bool_], again: RelativePoses) -> RelativePoses:
    """Take pairs over from another attempt, adding its iterations to those of the first."""
    if where.ndim == 0:
        return replace(again, iterations=found.iterations + again.iterations) if again.converged else found
    better = where.copy()
    better[where] = again.converged
    values = {name: getattr(found, name).copy() for name in _SHAPES}
    values["iterations"][where] += again.iterations
    for name in ("rotations", "s0", "condition", "converged"):
        values[name][..., better] = getattr(again, name)[..., again.converged]
    return RelativePoses(**values)


def _oriented(rays: Array, swings: tuple[int, int], tolerance: float) -> RelativePoses:
    """Orient pairs of rays ``(2, 3, n, ...)`` in camera frames, from the given quarter turns.

    Of a batch, the pairs that are done are put aside once they are more than half.
    """
    batch = rays.shape[3:]
    turned = np.array([rotation(0.0, 0.0, 0.5 * np.pi * swing) for swing in swings])
    R = np.empty((2, 3, 3, *batch))
    R[:] = turned.reshape((2, 3, 3, *(1,) * len(batch)))
    places = None
    state = _Iteration(R, np.ones(batch, dtype=bool), np.ones(batch), np.zeros(batch, dtype=np.int64))
    for i in range(MOST_ITERATIONS):
        state, equations = _iterated(state, rays, tolerance, level=i == 0 and swings == (0, 0))
        if i == 0:
            first = _condition(equations)
        rest = np.count_nonzero(state.active)
        last = rest == 0 or i == MOST_ITERATIONS - 1
        if last or 2 * rest < state.active.size:
            poses = _assessed(state, equations)
            if places is None:
                done = poses
            else:
                for name in _SHAPES:
                    getattr(done, name)[..., places] = getattr(poses, name)
            if last:
                break
            going = np.flatnonzero(state.active)
            places, rays = going if places is None else places[going], rays[..., going]
            state = _Iteration(
                state.rotations[..., going], state.active[going], state.before[going], state.iterations[going]
            )
    hopeless = first >= HOPELESS * LARGEST_CONDITION
    return replace(
        done, condition=np.where(hopeless, first, done.condition), converged=np.asarray(done.converged & ~hopeless)
    )


@dataclass(frozen=True)
class _Iteration:
    """Where iterations of pairs ``(...)`` stand: rotations, which go on, their last correction, how many there were."""

    rotations: Array
    active: npt.NDArray[np.bool_]
    before: Array
    iterations: npt.NDArray[np.int64]


@dataclass(frozen=True)
class _Equations:
    """Sums of products ``(6, 6, ...)`` of coefficients and discrepancies, the inverse of the normal equations, rays."""

    normal: Array
    inverse: Array
    rays: Array


def _iterated(state: _Iteration, rays: Array, tolerance: float, level: bool) -> tuple[_Iteration, _Equations]:
    """Do one iteration of Gauss-Newton; return also the equations that it solved."""
    active = state.active
    rows, per_mm, a = _level_equations(rays) if level else _equations(state.rotations, rays)
    normal = _products(rows)
    mean_square = normal[5, 5] / (rays.shape[2] * rays[0, 2, 0] * rays[1, 2, 0])
    stiff = normal[:5, :5].copy()
    for i in range(5):
        stiff[i, i] *= 1.0 + DAMPING * mean_square
    inverse = _inverse(stiff)
    corrections = -_times(inverse, normal[:5, 5]) * active
    size = np.abs(corrections).max(axis=0)
    if (size > LARGEST_TURN).any():
        corrections *= np.minimum(1.0, LARGEST_TURN / np.maximum(size, LARGEST_TURN))
    R = _turned(state.rotations, corrections)
    left = size * size / state.before
    far = active & (size > FAR)
    if far.any():
        tried = _Chord(rays, rows[:5] * per_mm, inverse, size)
        R, left = _chords(R, left, np.minimum(size, LARGEST_TURN), far, tried, CHORDS)
    goes_on = active & ~(left < tolerance) & np.isfinite(size)
    before = np.where(active, np.maximum(size, tolerance), state.before)
    return _Iteration(R, goes_on, before, state.iterations + active), _Equations(normal, inverse, a)


@dataclass(frozen=True)
class _Chord:
    """Rays ``(2, 3, n, ...)``, weighted coefficients, inverse and first correction of normal equations used again."""

    rays: Array
    weighted: Array
    inverse: Array
    size: Array

    def of(self, pairs: npt.NDArray[np.int64]) -> "_Chord":
        """Return those of some pairs."""
        return _Chord(self.rays[..., pairs], self.weighted[..., pairs], self.inverse[..., pairs], self.size[pairs])


def _chords(
    R: Array, left: Array, last: Array, far: npt.NDArray[np.bool_], equations: _Chord, most: int
) -> tuple[Array, Array]:
    """Go on from a step of Gauss-Newton with the same normal equations, in the pairs where that leads on.

    Returns the rotations and what is left to correct, in radians. Equations that are not formed anew leave the
    discrepancies' share of the first step.
    """
    if 2 * np.count_nonzero(far) < far.size:
        some = np.flatnonzero(far)
        R[..., some], left[some] = _chords(R[..., some], left[some], last[some], far[some], equations.of(some), most)
        return R, left
    rays = equations.rays
    discrepancies = _discrepancies(_in_base_frame(R[:, 1:], rays))
    corrections = -_times(equations.inverse, _times(equations.weighted, discrepancies))
    size = np.abs(corrections).max(axis=0)
    far = far & (size < STEADY * last)
    R = _turned(R, np.where(far, corrections, 0.0))
    rms = np.sqrt(dots(discrepancies, discrepancies) / rays.shape[2]) / (rays[0, 2, 0] * rays[1, 2, 0])
    left = np.where(far, np.minimum(left, np.maximum(size * size / last, WEAKNESS * equations.size * rms)), left)
    far = far & (size > FAR)
    return _chords(R, left, size, far, equations, most - 1) if most > 1 and far.any() else (R, left)


def _assessed(state: _Iteration, equations: _Equations) -> RelativePoses:
    """Judge where iterations ended, by the equations of the last one."""
    inverse, a = equations.inverse, equations.rays
    n, right = a.shape[2], equations.normal[5, :5]
    condition = _condition(equations)
    if n > FEWEST_POINTS:
        squares = equations.normal[5, 5] - dots(right, _times(inverse, right))
        s0 = np.sqrt(np.maximum(squares, 0.0) / (n - FEWEST_POINTS))
    else:
        s0 = np.zeros_like(condition)
    R, before_both = _facing(state.rotations, a)
    sound = (condition < LARGEST_CONDITION) & np.isfinite(state.before)
    converged = ~state.active & sound & before_both
    return RelativePoses(R, np.asarray(s0), np.asarray(condition), state.iterations, np.asarray(converged))


def _condition(equations: _Equations) -> Array:
    """Return the condition numbers ``(...)`` of the scaled normal equations, in the 1-norm."""
    normal = equations.normal[:5, :5]
    squares = np.einsum("uu...->u...", normal)
    scale = np.sqrt(squares[:, None] * squares)
    largest = (np.abs(normal) / scale).sum(axis=0).max(axis=0)
    condition = largest * (np.abs(equations.inverse) * scale).sum(axis=0).max(axis=0)
    return np.where(np.isfinite(condition), condition, np.inf)


def _times(matrix: Array, vector: Array) -> Array:
    """Multiply as `mxv` does, in less time for a single matrix."""
    return np.asarray(matrix @ vector) if matrix.ndim == 2 else mxv(matrix, vector)


def _in_base_frame(R: Array, rays: Array) -> Array:
    """Turn the rays ``(2, 3, n, ...)`` of both cameras by rows of their rotations ``(2, i, 3, ...)``."""
    return R @ rays if rays.ndim == 3 else np.asarray(np.einsum("kij...,kjn...->kin...", R, rays))


def _discrepancies(across: Array) -> Array:
    """Return ``y1 z2 - z1 y2`` of ray components y, z ``(2, 2, n, ...)``."""
    return np.asarray(across[0, 0] * across[1, 1] - across[0, 1] * across[1, 0])


def _equations(R: Array, rays: Array) -> tuple[Array, Array, Array]:
    """Return coefficients and discrepancies ``(6, n, ...)`` in mm of one image coordinate, and the turned rays.

    In the middle stands what they were multiplied by: one upon what the four image coordinates change them by.
    """
    a = _in_base_frame(R, rays)
    slopes = np.array([[-R[:, 2, 0], R[:, 1, 0]], [-R[:, 2, 1], R[:, 1, 1]]])
    by_image = np.einsum("jik...,kin...->jkn...", slopes, a[::-1, 1:])
    per_mm = 1.0 / np.sqrt(np.einsum("jkn...,jkn...->n...", by_image, by_image))
    rows = _rows(a)
    rows *= per_mm
    return rows, per_mm, a


def _level_equations(rays: Array) -> tuple[Array, Array, Array]:
    """Return what `_equations` does for cameras that stand level."""
    per_mm = 1.0 / np.hypot(rays[0, 2, :1], rays[1, 2, :1])
    rows = _rows(rays)
    rows *= per_mm
    return rows, per_mm, rays


def _rows(a: Array) -> Array:
    """Return the five coefficients and the discrepancy ``(6, n, ...)`` from rays ``(2, 3, n, ...)``."""
    rows = np.empty((6, *a.shape[2:]))
    np.multiply(a[0, 0], a[1, 1:], out=rows[0:2])
    np.multiply(-a[1, 0], a[0, 1:], out=rows[2:4])
    np.einsum("in...,in...->n...", a[0, 1:], a[1, 1:], out=rows[4])
    rows[5] = _discrepancies(a[:, 1:])
    return rows


def _products(rows: Array) -> Array:
    """Return the sums over n of products ``(u, u, ...)`` of rows ``(u, n, ...)``."""
    if rows.ndim == 2:
        return np.asarray(rows @ rows.T)
    products = np.empty((len(rows), len(rows), *rows.shape[2:]))
    for i, row in enumerate(rows):
        np.einsum("n...,vn...->v...", row, rows[i:], out=products[i, i:])
        products[i + 1 :, i] = products[i, i + 1 :]
    return products


def _inverse(matrix: Array) -> Array:
    """Return the inverses of positive definite matrices ``(u, u, ...)``; of singular ones, what is not finite.

    A batch is worked elementwise by exchange of one unknown after the other, a single matrix by LAPACK.
    """
    if matrix.ndim == 2:
        try:
            return np.asarray(np.linalg.inv(matrix))
        except np.linalg.LinAlgError:
            return np.full_like(matrix, np.nan)
    inverse, product = matrix.copy(), np.empty_like(matrix)
    for j in range(len(matrix)):
        reciprocal = 1.0 / inverse[j, j]
        column, row = inverse[:, j] * reciprocal, inverse[j].copy()
        np.multiply(column[:, None], row, out=product)
        inverse -= product
        np.multiply(row, reciprocal, out=inverse[j])
        np.negative(column, out=inverse[:, j])
        inverse[j, j] = reciprocal
    return inverse


def _turned(R: Array, turns: Array) -> Array:
    """Turn both cameras ``(2, 3, 3, ...)`` about the axes of the base by the unknowns of the equations, radians.

    Only the difference of the omegas is determined; each camera takes half.
    """
    if R.ndim == 3:  # one pair: the same in few calls
        half = (_HALF_TURNS @ turns).reshape(2, 3, 3)
        along = half @ R
        return np.asarray(
            R + (along + half @ along) * (2.0 / (1.0 + 0.5 * (half * half).sum(axis=(1, 2), keepdims=True)))
        )
    phi1, kappa1, phi2, kappa2, omega = turns
    half = 0.5 * omega
    turn = turn_about(np.array([[-half, half], [phi1, phi2], [kappa1, kappa2]]))
    return np.asarray(np.einsum("ijk...,kjl...->kil...", turn, R))


def _half_turns() -> Array:
    """Return, by the five unknowns, the skew matrices of half the turns of both cameras, ``(18, 5)``."""
    half = np.zeros((2, 3, 3, 5))
    for camera, axis, unknown, share in (
        (0, 0, 4, -0.25), (0, 1, 0, 0.5), (0, 2, 1, 0.5), (1, 0, 4, 0.25), (1, 1, 2, 0.5), (1, 2, 3, 0.5),
    ):  # fmt: skip
        half[camera, (axis + 2) % 3, (axis + 1) % 3, unknown] = share
        half[camera, (axis + 1) % 3, (axis + 2) % 3, unknown] = -share
    return half.reshape(18, 5)


_HALF_TURNS = _half_turns()


def turn_about(turns: Array) -> Array:
    """Return rotations ``(3, 3, ...)`` about axes ``(3, ...)`` whose length is twice the tangent of half the angle.

    For a small turn that is the angle in radians.
    """
    half = 0.5 * turns
    xx, yy, zz = half * half
    share = 2.0 / (1.0 + xx + yy + zz)
    turn = np.empty((3, 3, *turns.shape[1:]))
    for i, others in enumerate((yy + zz, zz + xx, xx + yy)):
        turn[i, i] = 1.0 - share * others
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        product, along = half[i] * half[j] * share, half[k] * share
        turn[i, j] = product - along
        turn[j, i] = product + along
    return turn


def _facing(R: Array, a: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Return the pose with the points before both cameras, and whether all of them are.

    The rays ``(2, 3, n, ...)`` of four poses are coplanar: the right camera may be turned over about the base, and
    the base reversed.
    """
    ahead = _distances(a)
    meets = ahead > 0.0
    if meets.all():
        return R, np.ones(a.shape[3:], dtype=bool)
    over = (meets[0] != meets[1]).mean(axis=0) > 0.5
    sign = np.where(over, -1.0, 1.0)
    meets = _distances(np.array([a[0], [a[1, 0], sign * a[1, 1], sign * a[1, 2]]])) > 0.0
    reversed_ = meets[0].mean(axis=0) < 0.5
    R = R.copy()
    R[1, 1:] *= sign
    R[:, :2] *= np.where(reversed_, -1.0, 1.0)
    return R, np.asarray((meets != reversed_).all(axis=(0, 1)))


def _distances(a: Array) -> Array:
    """Return how far along rays ``(2, 3, n, ...)`` they meet, ``(2, n, ...)``, in an arbitrary positive unit."""
    (x1, y1, z1), (x2, y2, z2) = a
    normal_y, normal_z = z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
    return np.array([y2 * normal_z - z2 * normal_y, y1 * normal_z - z1 * normal_y])


def _why(poses: RelativePoses, n: int) -> str:
    """Say why the first pair that is not oriented is not."""
    first = int(np.flatnonzero(~poses.converged)[0])
    which = "" if poses.converged.ndim == 0 else f" of pair {first}"
    condition = float(poses.condition.flat[first])
    if not condition < LARGEST_CONDITION:
        return (
            f"the {n} points{which} leave the relative orientation open: they lie on a line or a critical surface, "
            f"or on one nearly (condition number {condition:.1e}, at most {LARGEST_CONDITION:.0e})"
        )
    return (
        f"no relative orientation brings the rays of all {n} points{which} together before both cameras "
        f"(condition number {condition:.1e}, {poses.iterations.flat[first]} iterations)"
    )


@dataclass(frozen=True)
class Coplanarity:
    """The coplanarity condition of pairs of rays ``(n, ...)`` and how it changes, in the unit of the images cubed.

    `by_turn1` and `by_turn2` ``(3, n, ...)`` are for small turns of the cameras about the axes of the frame, `by_base`
    for a shift of the right centre, `by_image1` and `by_image2` ``(2, n, ...)`` for the image coordinates.
    """

    discrepancies: Array
    by_turn1: Array
    by_turn2: Array
    by_base: Array
    by_image1: Array
    by_image2: Array
    ahead: Array
    """How far along both rays ``(2, n, ...)`` they meet, in an arbitrary positive unit."""

    @property
    def steepness(self) -> Array:
        """What all four image coordinates of a point change the condition by, in mm squared."""
        return np.sqrt(dots(self.by_image1, self.by_image1) + dots(self.by_image2, self.by_image2))


def coplanarity(rays1: Array, rays2: Array, rotation1: Array, rotation2: Array, centre2: Array) -> Coplanarity:
    """Return the condition ``b . (a2 x a1) = 0`` for rays ``(3, n, ...)`` in their cameras' frames.

    It is positive where the y-parallax, left minus right, of a vertical pair is.
    """
    a1, a2 = mxv(rotation1[:, :, None], rays1), mxv(rotation2[:, :, None], rays2)
    b = centre2[:, None]
    normal, plane1, plane2 = cross(a2, a1), cross(a1, b), cross(b, a2)
    return Coplanarity(
        discrepancies=dots(b, normal),
        by_turn1=cross(a1, plane2),
        by_turn2=cross(a2, plane1),
        by_base=normal,
        by_image1=mxv(transposed(rotation1)[:2, :, None], plane2),
        by_image2=mxv(transposed(rotation2)[:2, :, None], plane1),
        ahead=np.array([-dots(plane2, normal), dots(plane1, normal)]),
    )


def cross(u: Array, v: Array) -> Array:
    """Return the vector products of vectors ``(3, ...)``."""
    return np.array([u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]])


def rays_of(image: Array, c: float) -> Array:
    """Return the camera vectors ``(3, n, ...)`` of image points ``(2, n, ...)``."""
    return np.concatenate([image, np.full_like(image[:1], -c)])


def finished(
    images: tuple[Array, Array],
    c: tuple[float, float],
    unknowns: tuple[str, ...],
    rotations: tuple[Array, Array],
    centre2: Array,
    iterations: npt.NDArray[np.int64],
    converged: npt.NDArray[np.bool_],
    unit: Array | None = None,
) -> RelativeOrientation:
    """Return the orientation that iterations came to, with the statistics of its unknowns.

    `unit` ``(n, ...)`` is what each condition is divided by; without it that is its steepness, so that all weigh as
    their image coordinates do. Raises Undetermined for singular normal equations.
    """
    rotation1, rotation2 = rotations
    condition = coplanarity(rays_of(images[0], c[0]), rays_of(images[1], c[1]), rotation1, rotation2, centre2)
    steepness = condition.steepness
    by_base = condition.by_base
    if unit is None:  # the steepness grows with the base, so that a longer base alone changes nothing
        unit = steepness
        by_base = by_base - centre2[:, None] * condition.discrepancies / dots(centre2, centre2)
    angles1, angles2 = np.array(angles_of(rotation1)), np.array(angles_of(rotation2))
    values, columns = [], []
    for name in unknowns:
        kind, number = name[:-1], name[-1]
        if kind in ("by", "bz"):
            axis = ("bx", "by", "bz").index(kind)
            values.append(centre2[axis])
            columns.append(by_base[axis])
            continue
        angles, m, by_turn = (
            (angles1, rotation1, condition.by_turn1) if number == "1" else (angles2, rotation2, condition.by_turn2)
        )
        axis = ("omega", "phi", "kappa").index(kind)
        values.append(angles[axis])
        columns.append(dots(_axes(angles, m)[axis][:, None], by_turn))
    design = np.swapaxes(np.array(columns) / unit, 0, 1)
    adjustment = adjusted(design, -condition.discrepancies / unit)
    per_coordinate = -condition.discrepancies / steepness**2
    return RelativeOrientation(
        unknowns=unknowns,
        adjustment=replace(adjustment, unknowns=np.array(values)),
        angles1=angles1,
        angles2=angles2,
        centre2=np.asarray(centre2),
        rotation=mxm(transposed(rotation1), rotation2),
        base=mxv(transposed(rotation1), centre2 / length_of(centre2)),
        corrections1=condition.by_image1 * per_coordinate,
        corrections2=condition.by_image2 * per_coordinate,
        iterations=iterations,
        converged=converged,
    )


def _axes(angles: Array, m: Array) -> tuple[Array, Array, Array]:
    """Return the axes ``(3, ...)`` about which omega, phi and kappa of a camera turn it."""
    omega = angles[0]
    zero, one = np.zeros_like(omega), np.ones_like(omega)
    return np.array([one, zero, zero]), np.array([zero, np.cos(omega), np.sin(omega)]), m[:, 2]
