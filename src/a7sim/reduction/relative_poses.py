"""Relative orientation of a batch of pairs: iterations from zero, from far, and from quarter turns.

Cameras are rotated by matrices, not by adding to angles (`coplanarity` has the equations). An iteration is one set of
normal equations, which far from convergence is solved for further right-hand sides, too.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, dots, mxm, rotation, transposed
from a7sim.reduction.batched_rotations import aligned_array, rotate_by
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.normal_equations import (
    MAX_CONDITION,
    Workspace,
    compute_discrepancies,
    condition_numbers,
    fast_all,
    fast_any,
    fast_mxv,
    form_equations,
    form_level_equations,
    form_products,
    invert,
    rotate_to_base,
    solve,
    symmetrize,
)

MIN_POINTS = 5
MAX_ITERATIONS = 30
TOLERANCE = 1e-10
"""Radians:

iterations end when the next correction would be smaller; its estimate is the square of the last one times the rms
discrepancy. The remaining error of perfect images is below 1e-10, of measured ones below 1e-9.
"""

NEAR_ITERATIONS = 3
"""Iterations sufficient for pairs near zero; pairs that need more start again with the others."""

HOPELESS = 10.0
"""Ratio of the condition of the first equations to the limit above which a pair is rejected at once."""

MAX_S0 = 0.005
"""Relative to c: a solution from quarter turns with a larger s0 is rejected."""

FAR = 0.055
FAR_LATER = 0.002
NEAR = 3e-4
"""Radians:

in pairs whose first correction is larger than FAR, or a later one than FAR_LATER, the same normal equations are also
solved for the remaining discrepancies until corrections are smaller than NEAR.
"""

MAX_TURN = 0.4
"""Radians per step: beyond it the linear equations are meaningless."""

DAMPING = 0.5
"""Share of the mean square discrepancy, in radians squared, that damps the normal equations far from convergence."""

CHORDS = 6
WEAKNESS = 10.0
"""Factor from discrepancies to unknowns, for an estimate of the remaining corrections."""

STEADY = 0.8
"""A chord step is rejected unless it is below this share of the step before it."""

WORKING_SET = 16000
"""Points processed at a time, so that their intermediate values stay in the cache."""

QUARTER_TURNS = ((0, 0), (2, 2), (1, 1), (3, 3), (0, 2), (2, 0), (0, 1), (0, 3), (1, 0), (3, 0))
"""Swings of the two cameras, in quarter turns, that are tried for pairs that do not converge from zero."""


@dataclass(frozen=True)
class RelativePoses:
    """Result of relative orientation for each pair of a batch ``(...)``, without the statistics of its unknowns.

    Where `converged` is False the pair is not oriented and its other values are meaningless.
    """

    rotations: Array
    """Shape ``(2, 3, 3, ...)``: of both cameras, into the frame with the base along X."""

    s0: Array
    """Standard deviation of one image coordinate in the unit of the images; zero for five points."""

    condition: Array
    """Condition number of the scaled normal equations; an upper bound of it where that is below `LARGEST_CONDITION`."""

    iterations: npt.NDArray[np.int64]
    converged: npt.NDArray[np.bool_]
    """The iterations converged, the condition is sound and all points are in front of both cameras."""

    @property
    def rotation(self) -> Array:
        """Rotations ``(3, 3, ...)`` that take the right photograph's vectors into the left photograph's frame."""
        return mxm(transposed(self.rotations[0]), self.rotations[1])

    @property
    def base(self) -> Array:
        """Unit vectors ``(3, ...)`` from the left to the right centre in the left photograph's frame."""
        return np.asarray(self.rotations[0, 0])


def relative_poses(image1: Array, image2: Array, c1: float, c2: float, tolerance: float = TOLERANCE) -> RelativePoses:
    """Orient a batch of pairs from image points ``(2, n, ...)`` in mm, without the statistics of the unknowns.

    Pairs are processed in sets that fit the cache. Those that do not converge from zero are tried again from quarter
    turns of swing, and their iterations are added. Raises Undetermined for fewer than five points.
    """
    n = image1.shape[1]
    if n < MIN_POINTS:
        raise Undetermined(f"expected at least {MIN_POINTS} points to orient a pair of photographs, got {n}")
    batch = image1.shape[2:]
    if not batch:
        return _resolved((image1, image2), c1, c2, tolerance, Workspace(n, ()))
    flat1, flat2 = image1.reshape((2, n, -1)), image2.reshape((2, n, -1))
    pairs, step = flat1.shape[-1], 8 * max(1, WORKING_SET // (8 * n))
    found: dict[str, npt.NDArray[Any]] = {
        name: np.empty((*shape, pairs), dtype) for name, (shape, dtype) in _SHAPES.items()
    }
    work = Workspace(n, (min(step, pairs),))
    for i in range(0, pairs, step):
        some = slice(i, min(i + step, pairs))
        if work.shape[1] != some.stop - i:
            work = Workspace(n, (some.stop - i,))
        poses = _oriented_from_near((flat1[..., some], flat2[..., some]), c1, c2, tolerance, work)
        for name, values in found.items():
            values[..., some] = getattr(poses, name)
    others = np.flatnonzero(~found["converged"])
    for i in range(0, others.size, step):
        rest = others[i : i + step]
        poses = _resolved((flat1[..., rest], flat2[..., rest]), c1, c2, tolerance, Workspace(n, rest.shape))
        for name, values in found.items():
            values[..., rest] = getattr(poses, name)
    return RelativePoses(**{name: values.reshape((*values.shape[:-1], *batch)) for name, values in found.items()})


_SHAPES: Mapping[str, tuple[tuple[int, ...], type]] = {
    "rotations": ((2, 3, 3), float),
    "s0": ((), float),
    "condition": ((), float),
    "iterations": ((), np.int64),
    "converged": ((), bool),
}


def _oriented_from_near(
    images: tuple[Array, Array], c1: float, c2: float, tolerance: float, work: Workspace
) -> RelativePoses:
    """Orient the pairs ``(2, n, ...)`` of a batch that are near zero; the others are not `converged`.

    All are iterated to the end: with few iterations, that is faster than removing finished pairs.
    """
    rays, state = _loaded(images, c1, c2, work), _start((0, 0), images[0].shape[2:])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for i in range(NEAR_ITERATIONS):
            state = _iterated(state, rays, tolerance, work, level=i == 0, chords=False)
            if i == 0:
                sound = condition_numbers(work) < HOPELESS * MAX_CONDITION
            if not (state.active & ~state.far).any():
                break
        poses = _assessed(state, work)
    return replace(poses, converged=poses.converged & sound & ~state.far)


def _loaded(images: tuple[Array, Array], c1: float, c2: float, work: Workspace) -> Array:
    """Return the rays ``(2, 3, n, ...)`` of image points ``(2, n, ...)``, in their cameras' frames."""
    rays = work.rays
    rays[0, :2], rays[1, :2] = images
    rays[0, 2], rays[1, 2] = -c1, -c2
    return rays


def _resolved(images: tuple[Array, Array], c1: float, c2: float, tolerance: float, work: Workspace) -> RelativePoses:
    """Orient pairs ``(2, n, ...)`` from zero, and those that do not converge from quarter turns of swing."""
    rays = _loaded(images, c1, c2, work)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # singular pairs of a batch
        found = _oriented(rays, (0, 0), tolerance, work)
        if fast_all(found.converged):
            return found
        return _tried_again(found, rays, tolerance)


def _tried_again(found: RelativePoses, rays: Array, tolerance: float) -> RelativePoses:
    """Try pairs that did not converge from quarter turns of swing."""
    for swings in QUARTER_TURNS[1:]:
        open_ = ~found.converged & ~(found.condition >= MAX_CONDITION)
        if not open_.any():
            break
        some = rays[..., open_] if rays.ndim > 3 else rays
        again = _oriented(some, swings, tolerance, Workspace(some.shape[2], some.shape[3:]))
        again = replace(again, converged=again.converged & (again.s0 < MAX_S0 * -rays[0, 2].flat[0]))
        found = _replaced(found, open_, again)
    return found


def _replaced(found: RelativePoses, where: npt.NDArray[np.bool_], again: RelativePoses) -> RelativePoses:
    """Replace pairs by those of another attempt, adding its iterations to those of the first."""
    if where.ndim == 0:
        return replace(again, iterations=found.iterations + again.iterations) if again.converged else found
    better = where.copy()
    better[where] = again.converged
    values = {name: getattr(found, name).copy() for name in _SHAPES}
    values["iterations"][where] += again.iterations
    for name in ("rotations", "s0", "condition", "converged"):
        values[name][..., better] = getattr(again, name)[..., again.converged]
    return RelativePoses(**values)


def _oriented(rays: Array, swings: tuple[int, int], tolerance: float, work: Workspace) -> RelativePoses:
    """Orient pairs of rays ``(2, 3, n, ...)`` in camera frames, from the given quarter turns.

    In a batch, finished pairs are removed once they are more than half.
    """
    batch = rays.shape[3:]
    level = swings == (0, 0)
    state = _start(swings, batch)
    places = None
    for i in range(MAX_ITERATIONS):
        state = _iterated(state, rays, tolerance, work, level=level and i == 0)
        if i == 0:
            first = condition_numbers(work)
        rest = np.count_nonzero(state.active)
        last = rest == 0 or i == MAX_ITERATIONS - 1
        if last or 2 * rest < state.active.size:
            poses = _assessed(state, work)
            if places is None:
                done = poses
            else:
                for name in _SHAPES:
                    getattr(done, name)[..., places] = getattr(poses, name)
            if last:
                break
            going = np.flatnonzero(state.active)
            places, rays = going if places is None else places[going], rays[..., going]
            state, work = state.of(going), Workspace(rays.shape[2], going.shape)
    hopeless = first >= HOPELESS * MAX_CONDITION
    if not fast_any(hopeless):
        return done
    condition = np.where(hopeless, first, done.condition)
    return replace(done, condition=condition, converged=np.asarray(done.converged & ~hopeless))


def _swung(swings: tuple[int, int], batch: tuple[int, ...]) -> Array:
    """Return rotations ``(2, 3, 3, ...)`` of level cameras with swings of quarter turns."""
    turned = np.eye(3)[None].repeat(2, axis=0)
    for camera, swing in enumerate(swings):
        if swing:
            turned[camera] = rotation(0.0, 0.0, 0.5 * np.pi * swing)
    if not batch:
        return turned
    R = aligned_array((2, 3, 3, *batch))
    R[:] = turned.reshape((2, 3, 3, *(1,) * len(batch)))
    return R


@dataclass(frozen=True)
class _Iteration:
    """State of the iterations of pairs ``(...)``:

    rotations, masks of active pairs and of pairs from far, last correction.
    """

    rotations: Array
    active: npt.NDArray[np.bool_]
    far: npt.NDArray[np.bool_]
    before: Array
    iterations: npt.NDArray[np.int64]

    def of(self, pairs: npt.NDArray[np.int64]) -> "_Iteration":
        """Return the state of selected pairs."""
        return _Iteration(
            self.rotations[..., pairs],
            self.active[pairs],
            self.far[pairs],
            self.before[pairs],
            self.iterations[pairs],
        )


def _start(swings: tuple[int, int], batch: tuple[int, ...]) -> _Iteration:
    """Return the start of the iterations: level cameras with swings of quarter turns."""
    zero = np.zeros(batch)
    return _Iteration(_swung(swings, batch), zero == 0.0, zero > 0.0, zero, zero.astype(np.int64))


def _iterated(
    state: _Iteration, rays: Array, tolerance: float, work: Workspace, level: bool, chords: bool = True
) -> _Iteration:
    """Do one Gauss-Newton iteration; `work` then contains the equations that it solved."""
    active = state.active
    if level:
        form_level_equations(rays, work)
    else:
        form_equations(state.rotations, rays, work)
    form_products(work)
    per_square = 1.0 / (rays.shape[2] * rays[0, 2].flat[0] * rays[1, 2].flat[0])
    corrections = solve(work, (DAMPING * per_square) * work.normal[5, 5])
    size = np.abs(corrections).max(axis=0)
    all_active = fast_all(active)
    if not all_active:
        corrections *= active
    if fast_any(size > MAX_TURN):
        corrections *= np.minimum(1.0, MAX_TURN / np.maximum(size, MAX_TURN))
    R = rotate_by(state.rotations, corrections, work, level)
    left = size * (2.0 * size + np.sqrt(per_square * np.abs(work.reduced[5, 5])))
    from_far = state.far | (size > (FAR if level else FAR_LATER))
    far = active & from_far & (size > NEAR)
    if chords and fast_any(far):
        R, left = _chords(R, left, np.minimum(size, MAX_TURN), far, _Chord.of_all(rays, work, size), CHORDS)
    goes_on = active & ~(left < tolerance) & np.isfinite(size)
    before = size if all_active else np.where(active, size, state.before)
    return _Iteration(R, goes_on, from_far, before, state.iterations + active)


@dataclass(frozen=True)
class _Chord:
    """Rays ``(2, 3, n, ...)``, weighted coefficients, inverse and first correction of reused normal equations."""

    rays: Array
    rows: Array
    steepness: Array
    normal: Array
    size: Array

    @classmethod
    def of_all(cls, rays: Array, work: Workspace, size: Array) -> "_Chord":
        """Return the chord of all pairs."""
        return cls(rays, work.rows[:5], work.steepness, work.normal[:5, :5], size)

    def of(self, pairs: npt.NDArray[np.int64]) -> "_Chord":
        """Return the chord of selected pairs."""
        return _Chord(
            self.rays[..., pairs],
            self.rows[..., pairs],
            self.steepness[..., pairs],
            self.normal[..., pairs],
            self.size[pairs],
        )

    @cached_property
    def weighted(self) -> Array:
        """Coefficients ``(5, n, ...)`` that multiply unweighted discrepancies."""
        return np.asarray(self.rows / self.steepness)

    @cached_property
    def inverse(self) -> Array:
        """Inverse ``(5, 5, ...)`` of the normal equations."""
        return invert(symmetrize(self.normal))


def _chords(
    R: Array, left: Array, last: Array, far: npt.NDArray[np.bool_], equations: _Chord, most: int
) -> tuple[Array, Array]:
    """Continue from a Gauss-Newton step with the same normal equations, in the pairs where that converges.

    Returns the rotations and the remaining corrections, in radians. Equations that are not formed anew keep the
    discrepancies' share of the first step.
    """
    if 2 * np.count_nonzero(far) < far.size:
        some = np.flatnonzero(far)
        R[..., some], left[some] = _chords(R[..., some], left[some], last[some], far[some], equations.of(some), most)
        return R, left
    rays = equations.rays
    discrepancies = compute_discrepancies(rotate_to_base(R[:, 1:], rays))
    corrections = -fast_mxv(equations.inverse, fast_mxv(equations.weighted, discrepancies))
    size = np.abs(corrections).max(axis=0)
    far = far & (size < STEADY * last)
    R = rotate_by(R, np.where(far, corrections, 0.0))
    rms = np.sqrt(dots(discrepancies, discrepancies) / rays.shape[2]) / (rays[0, 2, 0] * rays[1, 2, 0])
    left = np.where(far, np.minimum(left, np.maximum(size * size / last, WEAKNESS * equations.size * rms)), left)
    far = far & (size > NEAR)
    return _chords(R, left, size, far, equations, most - 1) if most > 1 and far.any() else (R, left)


def _assessed(state: _Iteration, work: Workspace) -> RelativePoses:
    """Return the assessment of the final state, by the equations of the last iteration."""
    n = work.shape[0]
    condition = condition_numbers(work)
    squares = work.reduced[5, 5]
    s0 = np.sqrt(np.maximum(squares, 0.0) / (n - MIN_POINTS)) if n > MIN_POINTS else np.zeros_like(condition)
    R, before_both = (state.rotations, True) if _all_ahead(work) else _facing(state.rotations, work.turned)
    sound = (condition < MAX_CONDITION) & np.isfinite(state.before)
    converged = ~state.active & sound & before_both
    return RelativePoses(R, np.asarray(s0), np.asarray(condition), state.iterations, np.asarray(converged))


def _all_ahead(work: Workspace) -> bool:
    """Return whether all rays ``(2, 3, n, ...)`` of all pairs meet in front of both cameras.

    They do if the planes through the base that contain them have one direction, and the left ray leans further along
    it.
    """
    (x1, y1, z1), (x2, _, _) = work.turned
    together = work.rows[4]
    left, right, square = work.spare[:3]
    np.multiply(y1, y1, out=right)
    np.multiply(z1, z1, out=square)
    right += square
    right *= x2
    np.multiply(x1, together, out=left)
    return bool(together.min() > 0.0 and (left > right).all())


def _facing(R: Array, a: Array) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Return the pose with the points in front of both cameras, and whether all of them are.

    The rays ``(2, 3, n, ...)`` of four poses are coplanar: the right camera may be rotated by half a turn about the
    base, and the base reversed.
    """
    meets = _distances(a) > 0.0
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
    """Return the distances along rays ``(2, 3, n, ...)`` to their intersection, ``(2, n, ...)``, in an arbitrary
    positive unit.
    """
    (x1, y1, z1), (x2, y2, z2) = a
    normal_y, normal_z = z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
    return np.array([y2 * normal_z - z2 * normal_y, y1 * normal_z - z1 * normal_y])
