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
from functools import cached_property
from math import prod
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, angles_of, dots, length_of, mxm, mxv, rotation, transposed
from a7sim.reduction.least_squares import Adjustment, Undetermined, adjusted

Unknowns = Literal["independent", "dependent"]

FEWEST_POINTS = 5
MOST_ITERATIONS = 30
TOLERANCE = 1e-10
"""Radians: iterations end when the next correction would be below it: the product of the last one with itself and with
the rms discrepancy. What is then left of perfect images is below 1e-10, of measured ones below 1e-9."""

LARGEST_CONDITION = 3e5
"""Of the scaled normal equations for turns about the axes of the base. Six standard points have some 3e2, the weak pair
of reference 07 has 8e3; points on a line or on a critical surface, measured to 5 um, have 2e6 and more. Beyond 3e5 such
errors turn a camera by half a degree."""

CONDITION_BY_DETERMINANT = 5.0 * 5.0**0.5 * 1.25**4
"""Of five scaled equations: the 1-norm is at most 5 and root 5 times the spectral norm of the inverse, whose
eigenvalues add up to 5 before they are inverted."""

NEAR_ITERATIONS = 3
"""So many are enough for pairs from near; those that need more begin again with the others."""

HOPELESS = 10.0
"""Pairs whose first equations are worse than that by as much are refused whatever they come to."""

LARGEST_S0 = 0.005
"""Of c: a solution found from quarter turns that leaves more is none."""

FAR = 0.055
FAR_LATER = 0.002
NEAR = 3e-4
"""Radians: in pairs whose first correction is larger than FAR, or a later one than FAR_LATER, the same normal equations
are solved for what is left, too, until corrections are smaller than NEAR."""

LARGEST_TURN = 0.4
"""Radians, in one step: farther away the linear equations say nothing."""

DAMPING = 0.5
"""Share of the mean square discrepancy, in radians squared, that stiffens the normal equations far from the end."""

CHORDS = 6
WEAKNESS = 10.0
"""By how much the discrepancies are multiplied in the unknowns, for a guess at what is left to correct."""

STEADY = 0.8
"""A chord step that is not below this share of the step before it is not taken."""

WORKING_SET = 16000
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
    """Condition number of the scaled normal equations; an upper bound of it where that is below `LARGEST_CONDITION`."""

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
        return _resolved((image1, image2), c1, c2, tolerance, _Work(n, ()))
    flat1, flat2 = image1.reshape((2, n, -1)), image2.reshape((2, n, -1))
    pairs, step = flat1.shape[-1], 8 * max(1, WORKING_SET // (8 * n))
    found: dict[str, npt.NDArray[Any]] = {
        name: np.empty((*shape, pairs), dtype) for name, (shape, dtype) in _SHAPES.items()
    }
    work = _Work(n, (min(step, pairs),))
    for i in range(0, pairs, step):
        some = slice(i, min(i + step, pairs))
        if work.shape[1] != some.stop - i:
            work = _Work(n, (some.stop - i,))
        poses = _oriented_from_near((flat1[..., some], flat2[..., some]), c1, c2, tolerance, work)
        for name, values in found.items():
            values[..., some] = getattr(poses, name)
    others = np.flatnonzero(~found["converged"])
    for i in range(0, others.size, step):
        rest = others[i : i + step]
        poses = _resolved((flat1[..., rest], flat2[..., rest]), c1, c2, tolerance, _Work(n, rest.shape))
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


class _TurningWork:
    """Arrays of pairs ``(...)`` that are filled anew when cameras are turned."""

    def __init__(self, batch: tuple[int, ...]) -> None:
        empty = _aligned if batch else np.empty
        self.halves = empty((2, 3, *batch))
        self.turn = empty((2, 3, 3, *batch))
        self.rotations = empty((2, 2, 3, 3, *batch))
        self.turning = empty((2, 3, 3, *batch))


class _Work(_TurningWork):
    """Arrays that the steps of an iteration fill anew, of pairs ``(...)`` with n points.

    They begin at lines of the cache: numpy takes half the time for them that it takes for arrays where malloc puts
    them.
    """

    def __init__(self, n: int, batch: tuple[int, ...]) -> None:
        super().__init__(batch)
        self.shape = (n, *batch)
        empty = _aligned if batch else np.empty
        self.rays = empty((2, 3, n, *batch))
        self.turned = empty((2, 3, n, *batch))
        self.spare = empty((6, n, *batch))
        self.rows = empty((6, n, *batch))
        self.steepness = empty((n, *batch))
        self.normal = empty((6, 6, *batch))
        self.reduced = empty((6, 6, *batch))
        self.product = empty((5, 5, *batch))
        self.shares = empty((5, *batch))


def _aligned(shape: tuple[int, ...]) -> Array:
    """Return an array that begins at a line of 64 bytes."""
    size = prod(shape)
    room = np.empty(size + 8)
    first = -room.ctypes.data % 64 // 8
    return room[first : first + size].reshape(shape)


def _oriented_from_near(
    images: tuple[Array, Array], c1: float, c2: float, tolerance: float, work: _Work
) -> RelativePoses:
    """Orient those of many pairs ``(2, n, ...)`` that are near zero; the others are not `converged`.

    They are worked together to the end: with few iterations, that is faster than to put aside those that are done.
    """
    rays, state = _loaded(images, c1, c2, work), _start((0, 0), images[0].shape[2:])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for i in range(NEAR_ITERATIONS):
            state = _iterated(state, rays, tolerance, work, level=i == 0, chords=False)
            if i == 0:
                sound = _conditions(work) < HOPELESS * LARGEST_CONDITION
            if not (state.active & ~state.far).any():
                break
        poses = _assessed(state, work)
    return replace(poses, converged=poses.converged & sound & ~state.far)


def _loaded(images: tuple[Array, Array], c1: float, c2: float, work: _Work) -> Array:
    """Return the rays ``(2, 3, n, ...)`` of image points ``(2, n, ...)``, in their cameras' frames."""
    rays = work.rays
    rays[0, :2], rays[1, :2] = images
    rays[0, 2], rays[1, 2] = -c1, -c2
    return rays


def _resolved(images: tuple[Array, Array], c1: float, c2: float, tolerance: float, work: _Work) -> RelativePoses:
    """Orient pairs ``(2, n, ...)`` from zero, and those that refuse from swings of quarter turns."""
    rays = _loaded(images, c1, c2, work)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):  # singular pairs of a batch
        found = _oriented(rays, (0, 0), tolerance, work)
        if found.converged.all():
            return found
        return _tried_again(found, rays, tolerance)


def _tried_again(found: RelativePoses, rays: Array, tolerance: float) -> RelativePoses:
    """Try pairs that refused from swings of quarter turns."""
    for swings in QUARTER_TURNS[1:]:
        open_ = ~found.converged & ~(found.condition >= LARGEST_CONDITION)
        if not open_.any():
            break
        some = rays[..., open_] if rays.ndim > 3 else rays
        again = _oriented(some, swings, tolerance, _Work(some.shape[2], some.shape[3:]))
        again = replace(again, converged=again.converged & (again.s0 < LARGEST_S0 * -rays[0, 2].flat[0]))
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


def _oriented(rays: Array, swings: tuple[int, int], tolerance: float, work: _Work) -> RelativePoses:
    """Orient pairs of rays ``(2, 3, n, ...)`` in camera frames, from the given quarter turns.

    Of a batch, the pairs that are done are put aside once they are more than half.
    """
    batch = rays.shape[3:]
    level = swings == (0, 0)
    state = _start(swings, batch)
    places = None
    for i in range(MOST_ITERATIONS):
        state = _iterated(state, rays, tolerance, work, level=level and i == 0)
        if i == 0:
            first = _conditions(work)
        rest = np.count_nonzero(state.active)
        last = rest == 0 or i == MOST_ITERATIONS - 1
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
            state, work = state.of(going), _Work(rays.shape[2], going.shape)
    hopeless = first >= HOPELESS * LARGEST_CONDITION
    if not hopeless.any():
        return done
    condition = np.where(hopeless, first, done.condition)
    return replace(done, condition=condition, converged=np.asarray(done.converged & ~hopeless))


def _swung(swings: tuple[int, int], batch: tuple[int, ...]) -> Array:
    """Return rotations ``(2, 3, 3, ...)`` of cameras that are level but swung by quarter turns."""
    turned = np.eye(3)[None].repeat(2, axis=0)
    for camera, swing in enumerate(swings):
        if swing:
            turned[camera] = rotation(0.0, 0.0, 0.5 * np.pi * swing)
    if not batch:
        return turned
    R = _aligned((2, 3, 3, *batch))
    R[:] = turned.reshape((2, 3, 3, *(1,) * len(batch)))
    return R


@dataclass(frozen=True)
class _Iteration:
    """Where iterations of pairs ``(...)`` stand: rotations, which go on or have come from far, last correction."""

    rotations: Array
    active: npt.NDArray[np.bool_]
    far: npt.NDArray[np.bool_]
    before: Array
    iterations: npt.NDArray[np.int64]

    def of(self, pairs: npt.NDArray[np.int64]) -> "_Iteration":
        """Return those of some pairs."""
        return _Iteration(
            self.rotations[..., pairs],
            self.active[pairs],
            self.far[pairs],
            self.before[pairs],
            self.iterations[pairs],
        )


def _start(swings: tuple[int, int], batch: tuple[int, ...]) -> _Iteration:
    """Return where iterations begin: cameras level but swung by quarter turns."""
    zero = np.zeros(batch)
    return _Iteration(_swung(swings, batch), zero == 0.0, zero > 0.0, zero, zero.astype(np.int64))


def _iterated(
    state: _Iteration, rays: Array, tolerance: float, work: _Work, level: bool, chords: bool = True
) -> _Iteration:
    """Do one iteration of Gauss-Newton, leaving in `work` the equations that it solved."""
    active = state.active
    if level:
        _level_equations(rays, work)
    else:
        _equations(state.rotations, rays, work)
    _form_products(work)
    per_square = 1.0 / (rays.shape[2] * rays[0, 2].flat[0] * rays[1, 2].flat[0])
    corrections = _solved(work, (DAMPING * per_square) * work.normal[5, 5])
    size = np.abs(corrections).max(axis=0)
    if active.ndim and not active.all():
        corrections *= active
    if size.max() > LARGEST_TURN:
        corrections *= np.minimum(1.0, LARGEST_TURN / np.maximum(size, LARGEST_TURN))
    R = _turned(state.rotations, corrections, work, level)
    left = size * (2.0 * size + np.sqrt(per_square * np.abs(work.reduced[5, 5])))
    from_far = state.far | (size > (FAR if level else FAR_LATER))
    far = active & from_far & (size > NEAR)
    if chords and far.any():
        R, left = _chords(R, left, np.minimum(size, LARGEST_TURN), far, _Chord.of_all(rays, work, size), CHORDS)
    goes_on = active & ~(left < tolerance) & np.isfinite(size)
    return _Iteration(R, goes_on, from_far, np.where(active, size, state.before), state.iterations + active)


@dataclass(frozen=True)
class _Chord:
    """Rays ``(2, 3, n, ...)``, weighted coefficients, inverse and first correction of normal equations used again."""

    rays: Array
    rows: Array
    steepness: Array
    normal: Array
    size: Array

    @classmethod
    def of_all(cls, rays: Array, work: _Work, size: Array) -> "_Chord":
        """Return those of all pairs."""
        return cls(rays, work.rows[:5], work.steepness, work.normal[:5, :5], size)

    def of(self, pairs: npt.NDArray[np.int64]) -> "_Chord":
        """Return those of some pairs."""
        return _Chord(
            self.rays[..., pairs],
            self.rows[..., pairs],
            self.steepness[..., pairs],
            self.normal[..., pairs],
            self.size[pairs],
        )

    @cached_property
    def weighted(self) -> Array:
        """Coefficients ``(5, n, ...)`` by which unweighted discrepancies are multiplied."""
        return np.asarray(self.rows / self.steepness)

    @cached_property
    def inverse(self) -> Array:
        """Inverse ``(5, 5, ...)`` of the normal equations."""
        return _inverse(_symmetric(self.normal))


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
    far = far & (size > NEAR)
    return _chords(R, left, size, far, equations, most - 1) if most > 1 and far.any() else (R, left)


def _assessed(state: _Iteration, work: _Work) -> RelativePoses:
    """Judge where iterations ended, by the equations of the last one."""
    n = work.shape[0]
    condition = _conditions(work)
    squares = work.reduced[5, 5]
    s0 = np.sqrt(np.maximum(squares, 0.0) / (n - FEWEST_POINTS)) if n > FEWEST_POINTS else np.zeros_like(condition)
    R, before_both = (state.rotations, True) if _all_ahead(work) else _facing(state.rotations, work.turned)
    sound = (condition < LARGEST_CONDITION) & np.isfinite(state.before)
    converged = ~state.active & sound & before_both
    return RelativePoses(R, np.asarray(s0), np.asarray(condition), state.iterations, np.asarray(converged))


def _conditions(work: _Work) -> Array:
    """Return the condition numbers ``(...)`` of the scaled normal equations, in the 1-norm, or small bounds of them.

    Their determinant bounds them, so that hardly any inverse is needed.
    """
    normal, pivots = work.normal[:5, :5], work.reduced[:5, :5].diagonal().T
    shares = np.divide(pivots, normal.diagonal().T, out=work.shares)
    bound = np.array(CONDITION_BY_DETERMINANT / shares.prod(axis=0))
    doubtful = ~((bound > 0.0) & (bound < LARGEST_CONDITION))
    if doubtful.any():
        bound[doubtful] = _condition(normal[..., doubtful]) if normal.ndim > 2 else _condition(normal)
    return bound


def _symmetric(normal: Array) -> Array:
    """Return normal equations that stand above the diagonal in full."""
    full = normal.copy()
    for i in range(len(full) - 1):
        full[i + 1 :, i] = full[i, i + 1 :]
    return full


def _condition(normal: Array) -> Array:
    """Return the condition numbers ``(...)`` of normal equations ``(5, 5, ...)`` when scaled, in the 1-norm."""
    spread = np.sqrt(normal.diagonal().T)
    scaled = _symmetric(normal) / (spread[:, None] * spread)
    condition = np.abs(scaled).sum(axis=0).max(axis=0) * np.abs(_inverse(scaled)).sum(axis=0).max(axis=0)
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


def _equations(R: Array, rays: Array, work: _Work) -> None:
    """Form the equations in mm of one image coordinate, in `work.rows`, of turned rays.

    The left rays are divided by what the four image coordinates change the condition by: that is the whole of
    ``(0, -z, y)`` of the other ray but for its component along the axis of the camera.
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


def _level_equations(rays: Array, work: _Work) -> None:
    """Form what `_equations` does for cameras that stand level."""
    work.steepness[:] = np.hypot(rays[0, 2].flat[0], rays[1, 2].flat[0])
    work.turned[:] = rays
    work.turned[0] /= work.steepness
    _form_rows(work.turned, work)


def _form_rows(a: Array, work: _Work) -> None:
    """Form the five coefficients and the discrepancy ``(6, n, ...)`` from rays ``(2, 3, n, ...)``.

    Those of the right camera are for turns the other way.
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


def _form_products(work: _Work) -> None:
    """Form the sums over n of products ``(6, 6, ...)`` of the rows; in a batch, on the diagonal and above."""
    rows, normal = work.rows, work.normal
    if rows.ndim == 2:
        np.matmul(rows, rows.T, out=normal)
        return
    for i, row in enumerate(rows):
        np.einsum("n...,vn...->v...", row, rows[i:], out=normal[i, i:])


def _solved(work: _Work, stiffness: Array) -> Array:
    """Return the corrections ``(5, ...)`` of the normal equations, stiffened by a share of their diagonal.

    What elimination leaves stands in `work.reduced`: the pivots and, last of all, the sum of squared residuals.
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


def _solved_alone(work: _Work, stiffness: float) -> Array:
    """Do what `_solved` does for one pair, with the numbers of Python, which are quicker than arrays of one number."""
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


def _inverse(matrix: Array) -> Array:
    """Return the inverses of positive definite matrices ``(u, u, ...)``; of singular ones, what is not finite.

    A batch is worked elementwise by exchange of one unknown after the other, a single matrix by LAPACK.
    """
    if matrix.ndim == 2:
        try:
            return np.asarray(np.linalg.inv(matrix))
        except np.linalg.LinAlgError:
            return np.full_like(matrix, np.nan)
    inverse, product = _aligned(matrix.shape), _aligned(matrix.shape)
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


def _turned(R: Array, turns: Array, work: _TurningWork | None = None, level: bool = False) -> Array:
    """Turn both cameras ``(2, 3, 3, ...)`` about the axes of the base by the unknowns of the equations, radians.

    Only the difference of the omegas is determined; each camera takes half.
    """
    if R.ndim == 3:  # one pair: the same in few calls
        half = (_HALF_TURNS @ turns).reshape(2, 3, 3)
        along = half @ R
        return np.asarray(
            R + (along + half @ along) * (2.0 / (1.0 + 0.5 * (half * half).sum(axis=(1, 2), keepdims=True)))
        )
    work = work or _TurningWork(R.shape[3:])
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
    """Return, by the five unknowns, the skew matrices of half the turns of both cameras, ``(18, 5)``."""
    half = np.zeros((2, 3, 3, 5))
    for camera, axis, unknown, share in (
        (0, 0, 4, -0.25), (0, 1, 0, 0.5), (0, 2, 1, 0.5), (1, 0, 4, 0.25), (1, 1, 2, -0.5), (1, 2, 3, -0.5),
    ):  # fmt: skip
        half[camera, (axis + 2) % 3, (axis + 1) % 3, unknown] = share
        half[camera, (axis + 1) % 3, (axis + 2) % 3, unknown] = -share
    return half.reshape(18, 5)


_HALF_TURNS = _half_turns()


def turn_about(turns: Array) -> Array:
    """Return rotations ``(3, 3, ...)`` about axes ``(3, ...)`` whose length is twice the tangent of half the angle.

    For a small turn that is the angle in radians.
    """
    return np.asarray(_turn_by_halves(0.5 * turns[None], np.empty((1, 3, *turns.shape)))[0])


def _turn_by_halves(half: Array, turn: Array) -> Array:
    """Fill rotations ``(k, 3, 3, ...)`` about axes ``(k, 3, ...)`` as long as the tangent of half the angle."""
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


def _all_ahead(work: _Work) -> bool:
    """Tell whether all rays ``(2, 3, n, ...)`` of all pairs meet before both cameras.

    They do where the planes with the base that hold them have one direction, and the left ray leans further along it.
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
    """Return the pose with the points before both cameras, and whether all of them are.

    The rays ``(2, 3, n, ...)`` of four poses are coplanar: the right camera may be turned over about the base, and
    the base reversed.
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
