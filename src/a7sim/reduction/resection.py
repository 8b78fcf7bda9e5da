"""Space resection: the centre and the tilts of a camera from ground points and their images."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, angles_of, dots, image_of, length_of, mxm, mxv, transposed
from a7sim.reduction.least_squares import Adjustment, Undetermined, solve_least_squares

MIN_POINTS = 3

ELEMENTS = ("omega", "phi", "kappa", "X", "Y", "Z")
"""Order of the unknowns: radians, and the unit of the ground."""

MAX_ITERATIONS = 30
MIN_STEP = 1e-12
"""Of the image points, relative to the principal distance."""

MAX_CONDITION = 1e7
"""Of the scaled normal equations. A wide-angle photograph has some 1e2, a field of four degrees 4e6; by the danger
cylinder images rounded to 1 um have 1e7 and more, and centres that are wrong by a twentieth of the height."""

MIN_TRIANGLE = 1e-6
"""Height over base of the widest triangle of ground points; below it they count as on a line."""

_SAME_IMAGE = 1e-5
"""Three points have the same images in several cameras; candidates closer than this, relative to c, count as equal."""

_ROOT_ROUNDS = 60


@dataclass(frozen=True)
class Resection:
    """A resected camera: centre ``(3, ...)``, angles omega, phi, kappa ``(3, ...)`` and rotation to the ground."""

    centre: Array
    angles: Array
    rotation: Array
    """Shape ``(3, 3, ...)``: takes camera vectors (x, y, -c) into the ground system."""
    adjustment: Adjustment
    """Unknowns in the order of `ELEMENTS`; observations are all x before all y, in mm."""
    iterations: Array
    """Shape ``(...)``: Gauss-Newton iterations until convergence."""

    @property
    def residuals(self) -> Array:
        """Residuals ``(2, n, ...)`` of the image points: computed minus measured."""
        v = self.adjustment.residuals
        return v.reshape((2, v.shape[0] // 2, *v.shape[1:]))

    @property
    def s0(self) -> Array:
        """Standard deviation ``(...)`` of an image coordinate, zero for three points."""
        return self.adjustment.s0

    @property
    def sigma_angles(self) -> Array:
        """Standard deviations ``(3, ...)`` of omega, phi, kappa in radians."""
        return self.adjustment.sigmas[:3]

    @property
    def sigma_centre(self) -> Array:
        """Standard deviations ``(3, ...)`` of the centre."""
        return self.adjustment.sigmas[3:]


def resection(image: Array, ground: Array, c: npt.ArrayLike) -> Resection:
    """Return the camera that imaged ground points ``(3, n, ...)`` at ``(2, n, ...)`` with the principal distance c.

    Image and c ``(...)`` in mm, ground in any unit. The start is Grunert's closed solution of the three points with the
    widest triangle, the candidate that fits all points best; for three points alone, which up to four cameras image
    alike, the most nearly vertical one. Then Gauss-Newton on the collinearity equations. Raises Undetermined for fewer
    than three points, points on a line and a centre on the points' danger cylinder.
    """
    n = image.shape[1]
    if n < MIN_POINTS:
        raise Undetermined(f"expected three ground points or more for a resection, got {n}")
    ground = ground.reshape((*ground.shape, *(1,) * (image.ndim - ground.ndim)))
    ground = np.broadcast_to(ground, (3, *image.shape[1:]))
    c = np.broadcast_to(np.asarray(c, dtype=float), image.shape[2:])
    mean = ground.mean(axis=1)
    unit = np.sqrt(dots(ground - mean[:, None], ground - mean[:, None]).mean(axis=0))
    if not (unit > 0.0).all():
        raise Undetermined("expected three ground points that are not on a line, got points that lie together")
    seen, local = image / c, (ground - mean[:, None]) / unit
    turn, centre = _closed_start(seen, local)
    turn, centre, step, iterations = _refined(seen, local, turn, centre)
    return _with_statistics(turn, centre, step, iterations, c, unit, mean)


def _refined(seen: Array, local: Array, turn: Array, centre: Array) -> tuple[Array, Array, Adjustment, Array]:
    iterations = np.zeros(seen.shape[2:], dtype=int)
    moving = np.ones(seen.shape[2:], dtype=bool)
    for _ in range(MAX_ITERATIONS):
        computed = image_of(local, centre[:, None], turn[:, :, None], 1.0)
        design = _coefficients(local - centre[:, None], computed, turn)
        try:
            step = solve_least_squares(design, np.concatenate([seen[0] - computed[0], seen[1] - computed[1]]))
        except Undetermined as error:
            raise Undetermined(
                f"expected ground points that fix the centre, got {seen.shape[1]} with the centre on or by "
                f"their danger cylinder ({error})"
            ) from error
        turn = mxm(_turned_by(step.unknowns[:3]), turn)
        centre = centre + step.unknowns[3:]
        iterations = iterations + moving
        moving = ~(np.abs(np.einsum("nu...,u...->n...", design, step.unknowns)).max(axis=0) <= MIN_STEP)
        if not moving.any():
            break
    else:
        raise Undetermined(
            f"expected ground points that fix the centre, got {np.count_nonzero(moving)} of {moving.size} resections "
            f"that do not settle in {MAX_ITERATIONS} iterations: a danger cylinder, or images of other points"
        )
    if not (step.condition < MAX_CONDITION).all():
        raise Undetermined(
            f"expected ground points that fix the centre, got {seen.shape[1]} with the centre on or by their danger "
            f"cylinder (condition number {step.condition.max():.1e}, at most {MAX_CONDITION:.0e})"
        )
    return turn, centre, step, iterations


def _coefficients(away: Array, computed: Array, turn: Array) -> Array:
    """Return the derivatives ``(2n, 6, ...)`` of images at c = 1 by small rotations about the ground's axes and by
    shifts.

    A rotation t of the camera moves a point in its frame by ``-t x away``, a shift by its opposite; then ``dx = -(dq_x
    + x dq_z) / q_z`` for q in the camera's frame.
    """
    depth = dots(turn[:, 2, None], away)
    columns = []
    for axis in np.eye(3):
        arm = np.broadcast_to(axis.reshape((3, *(1,) * (away.ndim - 1))), away.shape)
        columns.append(-np.cross(arm, away, axis=0))
    columns += [np.broadcast_to(-axis.reshape((3, *(1,) * (away.ndim - 1))), away.shape) for axis in np.eye(3)]
    moved = np.stack([mxv(transposed(turn)[:, :, None], column) for column in columns], axis=1)
    changes = -(moved[:2] + computed[:, None] * moved[2]) / depth
    return np.concatenate([np.swapaxes(changes[0], 0, 1), np.swapaxes(changes[1], 0, 1)])


def _turned_by(vector: Array) -> Array:
    """Return the rotation ``(3, 3, ...)`` about a vector ``(3, ...)`` by its length in radians (Rodrigues)."""
    x, y, z = vector
    zero = np.zeros_like(x)
    cross = np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]])
    angle = length_of(vector)
    half = np.sinc(angle / (2.0 * np.pi))
    identity = np.eye(3).reshape((3, 3, *(1,) * x.ndim))
    return np.asarray(identity + np.sinc(angle / np.pi) * cross + half**2 / 2.0 * mxm(cross, cross))


def _with_statistics(
    turn: Array, centre: Array, step: Adjustment, iterations: Array, c: Array, unit: Array, mean: Array
) -> Resection:
    """Return the resection with its unknowns as omega, phi, kappa and the centre in the ground's unit."""
    angles = np.array(angles_of(turn))
    omega, phi, _ = angles
    zero = np.zeros_like(omega)
    so, co, sp, cp = np.sin(omega), np.cos(omega), np.sin(phi), np.cos(phi)
    axes = np.array([[zero + 1.0, zero, sp], [zero, co, -so * cp], [zero, so, co * cp]])
    with np.errstate(divide="ignore", invalid="ignore"):
        back = np.array([[zero + 1.0, so * sp / cp, -co * sp / cp], [zero, co, so], [zero, -so / cp, co / cp]])
    jacobian = np.zeros((6, 6, *omega.shape))
    jacobian[:3, :3] = back
    jacobian[(3, 4, 5), (3, 4, 5)] = unit
    turns = np.einsum("nu...,uv...->nv...", step.design[:, :3], axes) * c
    adjustment = Adjustment(
        np.concatenate([angles, mean + unit * centre]),
        np.einsum("au...,uv...,bv...->ab...", jacobian, step.cofactors, jacobian) / c**2,
        step.residuals * c,
        step.redundancy,
        np.asarray(step.s0 * c),
        step.condition,
        np.concatenate([turns, step.design[:, 3:] * (c / unit)], axis=1),
    )
    return Resection(mean + unit * centre, angles, turn, adjustment, iterations)


def _closed_start(seen: Array, local: Array) -> tuple[Array, Array]:
    """Return rotation and centre of the camera, from three of the points, with the best fit to all points."""
    three = _widest_three(local)
    corners = np.take_along_axis(local, np.broadcast_to(three[None], (3, *three.shape)), axis=1)
    rays = np.concatenate([seen, np.full((1, *seen.shape[1:]), -1.0)])
    rays = np.take_along_axis(rays, np.broadcast_to(three[None], (3, *three.shape)), axis=1)
    with np.errstate(all="ignore"):
        turns, centres = _cameras_of_three(rays / length_of(rays), corners)
        candidates = _misfit(seen, local, turns, centres)
    if not np.isfinite(candidates).any(axis=0).all():
        raise Undetermined("expected images that some camera can have of the ground points, got none it could")
    if seen.shape[1] == MIN_POINTS:
        tilt = np.where(candidates <= np.maximum(_SAME_IMAGE, candidates.min(axis=0)), 1.0 - turns[2, 2], np.inf)
        candidates = tilt
    best = candidates.argmin(axis=0)[None]
    turn = np.take_along_axis(turns, np.broadcast_to(best, (3, 3, *best.shape)), axis=2)[:, :, 0]
    centre = np.take_along_axis(centres, np.broadcast_to(best, (3, *best.shape)), axis=1)[:, 0]
    return turn, centre


def _misfit(seen: Array, local: Array, turns: Array, centres: Array) -> Array:
    """Return the rms ``(k, ...)`` of the images of k cameras; infinite where one has a point behind it."""
    away = local[:, :, None] - centres[:, None]
    q = mxv(transposed(turns)[:, :, None], away)
    off = -q[:2] / q[2] - seen[:, :, None]
    rms = np.sqrt((off**2).sum(axis=0).mean(axis=0))
    return np.where((q[2] < 0.0).all(axis=0) & np.isfinite(rms), rms, np.inf)


def _widest_three(local: Array) -> Array:
    """Return the indices ``(3, ...)`` of the points farthest from the middle, from that one and from their line."""

    def at(i: Array) -> Array:
        return np.take_along_axis(local, np.broadcast_to(i[None, None], (3, 1, *i.shape)), axis=1)

    first = dots(local, local).argmax(axis=0)
    arms = local - at(first)
    second = dots(arms, arms).argmax(axis=0)
    base = at(second) - at(first)
    off = np.cross(arms, np.broadcast_to(base, arms.shape), axis=0)
    off = length_of(off) / dots(base, base)
    third = off.argmax(axis=0)
    if not (off.max(axis=0) > MIN_TRIANGLE).all():
        raise Undetermined("expected three ground points that are not on a line, got points on a line")
    return np.array([first, second, third])


def _cameras_of_three(rays: Array, corners: Array) -> tuple[Array, Array]:
    """Return rotations ``(3, 3, 8, ...)`` and centres ``(3, 8, ...)`` from unit rays and points ``(3, 3, ...)``.

    Grunert (1841), as in Haralick et al., "Review and analysis of solutions of the three point perspective pose
    estimation problem" (1994): the distances are s1, u s1, v s1, v the root of a quartic. Of u both roots of the
    quadratic in it are taken, which holds where Grunert's own expression for u is 0/0.
    """
    cos_a, cos_b, cos_g = (dots(rays[:, i], rays[:, j]) for i, j in ((1, 2), (0, 2), (0, 1)))
    aa, bb, cc = (
        dots(corners[:, i] - corners[:, j], corners[:, i] - corners[:, j]) for i, j in ((1, 2), (0, 2), (0, 1))
    )
    less, more = (aa - cc) / bb, (aa + cc) / bb
    quartic = np.array(
        [
            (less - 1.0) ** 2 - 4.0 * cc / bb * cos_a**2,
            4.0 * (less * (1.0 - less) * cos_b - (1.0 - more) * cos_a * cos_g + 2.0 * cc / bb * cos_a**2 * cos_b),
            2.0
            * (
                less**2
                - 1.0
                + 2.0 * less**2 * cos_b**2
                + 2.0 * (bb - cc) / bb * cos_a**2
                - 4.0 * more * cos_a * cos_b * cos_g
                + 2.0 * (bb - aa) / bb * cos_g**2
            ),
            4.0 * (-less * (1.0 + less) * cos_b + 2.0 * aa / bb * cos_g**2 * cos_b - (1.0 - more) * cos_a * cos_g),
            (1.0 + less) ** 2 - 4.0 * aa / bb * cos_g**2,
        ]
    )
    v = np.repeat(_real_parts_of_roots(quartic), 2, axis=0)
    sign = np.array([1.0, -1.0] * 4).reshape((8, *(1,) * cos_b.ndim))
    s1 = np.sqrt(bb / (1.0 + v**2 - 2.0 * v * cos_b))
    # Near a double root noise makes the root of u imaginary: the real part is where both would meet.
    u = cos_g + sign * np.sqrt(np.maximum(cos_g**2 - 1.0 + cc / s1**2, 0.0))
    distances = np.where((u > 0.0) & (v > 0.0), np.array([s1, u * s1, v * s1]), np.nan)
    seen_from_camera = rays[:, :, None] * distances
    turns = mxm(_triad(corners)[:, :, None], transposed(_triad(seen_from_camera)))
    return turns, corners[:, 0, None] - mxv(turns, seen_from_camera[:, 0])


def _triad(corners: Array) -> Array:
    """Return right-handed unit axes ``(3, 3, ...)``, in columns, along triangles ``(3, 3, ...)``."""
    along = corners[:, 1] - corners[:, 0]
    along = along / length_of(along)
    across = np.cross(along, corners[:, 2] - corners[:, 0], axis=0)
    across = across / length_of(across)
    return np.stack([along, across, np.cross(along, across, axis=0)], axis=1)


def _real_parts_of_roots(quartic: Array) -> Array:
    """Return the real parts ``(4, ...)`` of the roots of quartics ``(5, ...)``, highest power first (Durand-Kerner)."""
    # A leading coefficient of zero is a root at infinity, which is no camera; a trace of it keeps the others.
    size = np.abs(quartic).max(axis=0)
    lead = np.where(np.abs(quartic[0]) < 1e-14 * size, 1e-14 * size, quartic[0])
    coefficients = quartic[1:] / lead
    start = (0.4 + 0.9j) ** np.arange(4)
    roots = np.broadcast_to(start.reshape((4, *(1,) * lead.ndim)), (4, *lead.shape)).copy()
    with_itself = np.eye(4).reshape((4, 4, *(1,) * lead.ndim))
    for _ in range(_ROOT_ROUNDS):
        value = roots + coefficients[0]
        for coefficient in coefficients[1:]:
            value = value * roots + coefficient
        others = (roots[:, None] - roots + with_itself).prod(axis=1)
        step = value / np.where(others == 0.0, 1e-300, others)
        step = np.where(np.isfinite(step), step, 0.0)
        roots -= step
        if (np.abs(step) <= 1e-14 * np.maximum(np.abs(roots), 1e-3)).all():
            break
    return np.asarray(roots.real)
