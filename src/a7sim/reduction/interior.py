"""Interior orientation: placement of a picture on its carrier, and measured image points in the calibrated system."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, mxm
from a7sim.reduction.least_squares import Adjustment, Undetermined, solve_least_squares

UNKNOWNS = {
    "conformal": ("a", "b", "tx", "ty"),
    "affine": ("a", "b", "c", "d", "tx", "ty"),
    "projective": ("a", "b", "c", "d", "tx", "ty", "e", "f"),
}
"""Kinds of fit and their unknowns: x' = (a x + b y + tx) / (e x + f y + 1), y' = (c x + d y + ty) / (e x + f y + 1).

Affine without e and f; conformal x' = a x - b y + tx, y' = b x + a y + ty.
"""

MIN_FIDUCIALS = {"conformal": 2, "affine": 3, "projective": 4}

_PLACES = {"a": (0, 0), "b": (0, 1), "c": (1, 0), "d": (1, 1), "tx": (0, 2), "ty": (1, 2), "e": (2, 0), "f": (2, 1)}

MAX_ITERATIONS = 30
MIN_STEP = 1e-12
"""Of the fitted places, relative to the spread of the fiducials."""


@dataclass(frozen=True)
class PicturePlacement:
    """Shift in mm, turn in radians and change of scale ``(...)`` of a picture against its collimating marks."""

    dx: Array
    dy: Array
    turn: Array
    scale: Array
    """Relative change: 1e-4 for a picture that is too large by that factor."""


def picture_placement(displacements: Array, marks: Array) -> PicturePlacement:
    """Return the placement of a picture from its fiducials' displacements ``(2, n, ...)`` at collimating marks ``(2,
    n)``, mm.

    Small-angle similarity ``d = t + (scale, turn) x`` by least squares. Raises Undetermined for one fiducial.
    """
    x, y = marks
    one, zero = np.ones_like(x), np.zeros_like(x)
    design = np.array([np.concatenate(pair) for pair in ((one, zero), (zero, one), (-y, x), (x, y))]).T
    design = design.reshape((*design.shape, *(1,) * (displacements.ndim - 2)))
    return PicturePlacement(*solve_least_squares(design, np.concatenate([displacements[0], displacements[1]])).unknowns)


@dataclass(frozen=True)
class PlaneFit:
    """A fit of measured fiducials to calibrated ones; `unknowns` are those of `UNKNOWNS`, in that order.

    The matrix ``(3, 3, ...)`` takes homogeneous measured coordinates to calibrated ones. The calibrated
    coordinates count as the observations, all x before all y, so that residuals and s0 are in their unit.
    """

    kind: str
    matrix: Array
    adjustment: Adjustment
    iterations: Array
    """Shape ``(...)``: Gauss-Newton iterations until convergence; one for the linear fits."""

    @property
    def unknowns(self) -> dict[str, Array]:
        """The unknowns ``(...)`` by name."""
        return dict(zip(UNKNOWNS[self.kind], self.adjustment.unknowns, strict=True))

    @property
    def sigmas(self) -> dict[str, Array]:
        """Standard deviations ``(...)`` of the unknowns by name."""
        return dict(zip(UNKNOWNS[self.kind], self.adjustment.sigmas, strict=True))

    @property
    def residuals(self) -> Array:
        """Residuals ``(2, n, ...)`` of the fiducials: fitted minus calibrated."""
        v = self.adjustment.residuals
        return v.reshape((2, v.shape[0] // 2, *v.shape[1:]))

    def calibrated(self, measured: Array) -> Array:
        """Return measured image points ``(2, m, ...)`` in the calibrated system."""
        return _carried(self.matrix, measured)

    def measured(self, calibrated: Array) -> Array:
        """Return points ``(2, m, ...)`` of the calibrated system in the measured system."""
        return _carried(_adjugate(self.matrix), calibrated)

    @property
    def film_scale(self) -> Array:
        """Size ``(...)`` of the picture at its centre against the calibrated one, from measurements in mm.

        Below one for film that has shrunk; of an affine or projective fit the mean of both directions, by area.
        """
        m = self.matrix
        back = _adjugate(m) / _determinant(m)
        return np.asarray(np.sqrt(np.abs(1.0 / (_determinant(m) * back[2, 2] ** 3))))


def plane_fit(measured: Array, calibrated: Array, kind: str = "affine") -> PlaneFit:
    """Return the conformal, affine or projective fit of measured fiducials ``(2, n, ...)`` to calibrated ones.

    Measured in any unit, calibrated in mm, one set ``(2, n)`` for a whole batch or one each; the fit minimises
    residuals of the calibrated coordinates, as Noobeed does. Raises Undetermined for too few fiducials and for
    fiducials on a line.
    """
    if kind not in UNKNOWNS:
        raise ValueError(f"expected one of {', '.join(UNKNOWNS)}, got {kind!r}")
    n = measured.shape[1]
    if n < MIN_FIDUCIALS[kind]:
        raise Undetermined(f"expected {MIN_FIDUCIALS[kind]} fiducials or more for a fit that is {kind}, got {n}")
    calibrated = calibrated.reshape((*calibrated.shape, *(1,) * (measured.ndim - calibrated.ndim)))
    measured, calibrated = np.broadcast_arrays(measured, calibrated)
    from_measured, source = _normalised(measured)
    from_calibrated, target = _normalised(calibrated)
    basis = _basis(kind)
    try:
        # Multiplied out by the denominator the equations are linear: a start for the projective fit, else the fit.
        start = solve_least_squares(*_linear_equations(source, target, basis))
        solution, iterations = start, np.ones(measured.shape[2:], dtype=int)
        if kind == "projective":
            solution, iterations = _refined(start.unknowns, source, target, basis)
    except Undetermined as error:
        raise Undetermined(
            f"expected fiducials that determine a {kind} fit, got {n} on a line, together or confused ({error})"
        ) from error
    matrix = _homogeneous(solution.unknowns, basis)
    to_calibrated = _inverse_of_normalising(from_calibrated)
    return _in_given_units(kind, matrix, basis, solution, from_measured, to_calibrated, measured, iterations)


def principal_distance_for_film(c: npt.ArrayLike, fit: PlaneFit) -> Array:
    """Return the principal distance in mm to set in the plotter:

    film shrinkage shortens the camera's c by the same factor.
    """
    return np.asarray(np.asarray(c, dtype=float) * fit.film_scale)


def _normalised(points: Array) -> tuple[Array, Array]:
    """Return scale and shift ``(3, ...)`` that bring points ``(2, n, ...)`` about the origin at unit spread."""
    mean = points.mean(axis=1)
    centred = points - mean[:, None]
    spread = np.sqrt((centred**2).sum(axis=0).mean(axis=0))
    scale = 1.0 / np.where(spread > 0.0, spread, 1.0)
    return np.array([scale, -scale * mean[0], -scale * mean[1]]), centred * scale


def _normalising_matrix(scale_and_shift: Array) -> Array:
    scale, dx, dy = scale_and_shift
    zero, one = np.zeros_like(scale), np.ones_like(scale)
    return np.array([[scale, zero, dx], [zero, scale, dy], [zero, zero, one]])


def _inverse_of_normalising(scale_and_shift: Array) -> Array:
    scale, dx, dy = scale_and_shift
    return _normalising_matrix(np.array([1.0 / scale, -dx / scale, -dy / scale]))


def _basis(kind: str) -> Array:
    """Return the coefficients ``(3, 3, u)`` of the unknowns in the matrix."""
    basis = np.zeros((3, 3, len(UNKNOWNS[kind])))
    for i, name in enumerate(UNKNOWNS[kind]):
        if kind == "conformal" and name in "ab":
            basis[:2, :2, i] = ((1.0, 0.0), (0.0, 1.0)) if name == "a" else ((0.0, -1.0), (1.0, 0.0))
        else:
            basis[(*_PLACES[name], i)] = 1.0
    return basis


def _picked(kind: str, matrix: Array) -> Array:
    """Return the unknowns ``(u, ...)`` of a matrix ``(3, 3, ...)`` with a last element of one."""
    places = [(1, 0) if kind == "conformal" and name == "b" else _PLACES[name] for name in UNKNOWNS[kind]]
    return np.array([matrix[place] for place in places])


def _homogeneous(unknowns: Array, basis: Array) -> Array:
    matrix = np.asarray(np.einsum("iju,u...->ij...", basis, unknowns))
    matrix[2, 2] += 1.0
    return matrix


def _with_one(points: Array) -> Array:
    return np.array([points[0], points[1], np.ones_like(points[0])])


def _carried(matrix: Array, points: Array) -> Array:
    u, v, w = np.einsum("ij...,j...->i...", matrix[:, :, None], _with_one(points))
    return np.asarray(np.array([u, v]) / w)


def _linear_equations(source: Array, target: Array, basis: Array) -> tuple[Array, Array]:
    """Return design and observations of ``u - x' (w - 1) = x'``, likewise y."""
    shares = np.einsum("iju,jn...->iun...", basis, _with_one(source))
    design = [shares[k] - target[k] * shares[2] for k in (0, 1)]
    return np.concatenate([np.swapaxes(d, 0, 1) for d in design]), np.concatenate([target[0], target[1]])


def _refined(unknowns: Array, source: Array, target: Array, basis: Array) -> tuple[Adjustment, Array]:
    """Return the projective fit by Gauss-Newton on the positions themselves."""
    homogeneous = _with_one(source)
    shares = np.einsum("iju,jn...->iun...", basis, homogeneous)
    iterations = np.zeros(source.shape[2:], dtype=int)
    moving = np.ones(source.shape[2:], dtype=bool)
    for _ in range(MAX_ITERATIONS):
        u, v, w = np.einsum("ij...,jn...->in...", _homogeneous(unknowns, basis), homogeneous)
        if not (w > 0.0).all():
            raise Undetermined("the fitted vanishing line passes between them")
        fitted = np.array([u, v]) / w
        design = np.concatenate([np.swapaxes((shares[k] - fitted[k] * shares[2]) / w, 0, 1) for k in (0, 1)])
        step = solve_least_squares(design, np.concatenate([target[0] - fitted[0], target[1] - fitted[1]]))
        unknowns = unknowns + step.unknowns
        iterations = iterations + moving
        moving = np.abs(np.einsum("nu...,u...->n...", design, step.unknowns)).max(axis=0) > MIN_STEP
        if not moving.any():
            break
    else:
        raise Undetermined(f"the fit does not settle in {MAX_ITERATIONS} iterations")
    return Adjustment(
        unknowns, step.cofactors, step.residuals, step.redundancy, step.s0, step.condition, design
    ), iterations


def _in_given_units(
    kind: str,
    matrix: Array,
    basis: Array,
    solution: Adjustment,
    from_measured: Array,
    to_calibrated: Array,
    measured: Array,
    iterations: Array,
) -> PlaneFit:
    """Return the fit of normalised positions as a fit of the given ones, with transformed cofactors."""
    into = _normalising_matrix(from_measured)
    whole = mxm(to_calibrated, mxm(matrix, into))
    last = whole[2, 2]
    share = np.einsum("ik...,klu,lj...->iju...", to_calibrated, basis, into)
    share = (share - whole[:, :, None] / last * share[2, 2]) / last
    whole = whole / last
    unit = to_calibrated[0, 0]
    jacobian = _picked(kind, share) / unit
    adjustment = Adjustment(
        _picked(kind, whole),
        np.einsum("au...,uv...,bv...->ab...", jacobian, solution.cofactors, jacobian),
        solution.residuals * unit,
        solution.redundancy,
        np.asarray(solution.s0 * unit),
        solution.condition,
        _design(whole, basis, measured),
    )
    return PlaneFit(kind, whole, adjustment, iterations)


def _design(matrix: Array, basis: Array, measured: Array) -> Array:
    homogeneous = _with_one(measured)
    u, v, w = np.einsum("ij...,jn...->in...", matrix, homogeneous)
    shares = np.einsum("iju,jn...->iun...", basis, homogeneous)
    return np.concatenate([np.swapaxes((shares[k] - each / w * shares[2]) / w, 0, 1) for k, each in ((0, u), (1, v))])


def _determinant(m: Array) -> Array:
    return np.asarray((m[0] * np.cross(m[1], m[2], axis=0)).sum(axis=0))


def _adjugate(m: Array) -> Array:
    """Return the inverse ``(3, 3, ...)`` times the determinant: the same map of homogeneous coordinates."""
    rows = [np.cross(m[(i + 1) % 3], m[(i + 2) % 3], axis=0) for i in range(3)]
    return np.swapaxes(np.array(rows), 0, 1)
