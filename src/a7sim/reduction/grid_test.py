"""Grid test of a projector: principal distance, principal point and element zeros from a plate at levels of Z.

The plate's crosses are on the carrier, the mark is set on each at one or more levels of Z, and X and Y are read: a
space resection in readings with unknown interior orientation. docs/grid-test.md states what can be separated.
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array, mxv, plane_rotation, rotation, transposed
from a7sim.reduction.interior import picture_placement
from a7sim.reduction.least_squares import Adjustment, Undetermined, solve_least_squares

UNKNOWNS = ("c", "x0", "y0", "omega", "phi", "kappa", "bx", "by", "bz")
"""Order of the unknowns: mm and radians; bx, by and bz move the centre to (bx, -by, bz)."""

HELD_AT_ONE_LEVEL = ("bx", "by", "bz")
"""At one level a shift of the centre looks like one of the principal point, and its height like c."""

MIN_CROSSES = 5

MAX_ITERATIONS = 30
MIN_STEP_MM = 1e-9
"""On the plate, mm."""

MAX_CONDITION = 1e5
"""Of the scaled normal equations. At levels 200 and 400 mm below the centre it is some 2e2, at 300 and 310 mm 2e4."""


@dataclass(frozen=True)
class Elements:
    """Elements of a projector ``(...)``: mm, and radians from their counter zeros; nominally x0 = y0 = 0."""

    c: npt.ArrayLike
    x0: npt.ArrayLike = 0.0
    y0: npt.ArrayLike = 0.0
    omega: npt.ArrayLike = 0.0
    phi: npt.ArrayLike = 0.0
    kappa: npt.ArrayLike = 0.0
    bx: npt.ArrayLike = 0.0
    by: npt.ArrayLike = 0.0
    bz: npt.ArrayLike = 0.0


@dataclass(frozen=True)
class PlatePlacement:
    """Placement of a plate on its carrier ``(...)``: shift in mm and rotation in radians from the collimating marks."""

    dx: Array
    dy: Array
    turn: Array
    sigma_shift: Array
    sigma_turn: Array

    def placed(self, crosses: Array) -> Array:
        """Return crosses ``(2, n)`` of the plate as positions on the carrier ``(2, n, ...)``."""
        turn = np.asarray(self.turn)
        crosses = crosses.reshape((*crosses.shape, *(1,) * turn.ndim))
        return np.asarray(mxv(plane_rotation(turn)[:, :, None], crosses) + np.array([self.dx, self.dy])[:, None])


def plate_placement(displacements: Array, marks: Array) -> PlatePlacement:
    """Return the placement of a plate from displacements ``(2, n, ...)`` of its fiducials at collimating marks ``(2,
    n)``, mm.

    Fiducials registered several times occur as often. Raises Undetermined for one fiducial.
    """
    lie = picture_placement(displacements, marks)
    n = marks.shape[1]
    x, y = (each.reshape((n, *(1,) * (displacements.ndim - 2))) for each in marks)
    fitted = np.array([lie.dx + lie.scale * x - lie.turn * y, lie.dy + lie.scale * y + lie.turn * x])
    sigma = np.sqrt(((displacements - fitted) ** 2).sum(axis=(0, 1)) / max(2 * n - 4, 1))
    return PlatePlacement(lie.dx, lie.dy, lie.turn, sigma / np.sqrt(n), sigma / np.sqrt((marks**2).sum()))


@dataclass(frozen=True)
class ProjectorTest:
    """Result of a grid test: `errors` and `sigmas` ``(...)`` of a projector by names of `UNKNOWNS`, mm and radians.

    An error is the true value minus the counter reading. Elements that are held have none.
    """

    errors: Mapping[str, Array]
    sigmas: Mapping[str, Array]
    """Standard deviations from the pointings and from the placement of the plate."""
    residuals: Array
    """Residuals of the crosses ``(2, k, n, ...)`` at each level, computed minus ruled, mm at photo scale."""
    adjustment: Adjustment
    """Its unknowns are those of `errors`, in their order."""
    iterations: int

    @property
    def s0(self) -> Array:
        """Standard error ``(...)`` of a coordinate at photo scale, mm."""
        return self.adjustment.s0


def grid_test(
    crosses: Array, readings: Array, heights: npt.ArrayLike, counters: Elements, lie: PlatePlacement | None = None
) -> ProjectorTest:
    """Return the errors of a projector from readings ``(2, k, n, ...)`` at n crosses ``(2, n)`` and k levels.

    Readings, and heights ``(k,)`` or ``(k, ...)`` of the levels, in mm of the instrument frame, Z up; crosses in mm
    about the plate's middle, which is on the carrier as `lie` states. At one level bx, by and bz are held. Raises
    Undetermined for fewer than five crosses and for crosses or levels that do not determine the unknowns.
    """
    k, n = readings.shape[1:3]
    if n < MIN_CROSSES:
        raise Undetermined(f"expected {MIN_CROSSES} crosses or more for a grid test, got {n}")
    batch = readings.shape[3:]
    lie = lie or PlatePlacement(*np.zeros((5, *batch)))
    heights = np.asarray(heights, dtype=float)
    of_level = heights.reshape((k, 1, *heights.shape[1:], *(1,) * (len(batch) + 1 - heights.ndim)))
    mark = np.array([readings[0], readings[1], np.broadcast_to(of_level, readings.shape[1:])])
    seen = np.broadcast_to(lie.placed(crosses)[:, None], readings.shape)
    sought = UNKNOWNS if k > 1 else tuple(name for name in UNKNOWNS if name not in HELD_AT_ONE_LEVEL)
    shown = np.array(
        [np.broadcast_to(np.asarray(getattr(counters, f.name), dtype=float), batch) for f in fields(counters)]
    )
    adjustment, now, iterations = _adjusted(seen, mark, shown, [UNKNOWNS.index(name) for name in sought])
    errors = {name: now[i] - shown[i] for i, name in enumerate(UNKNOWNS) if name in sought}
    of_lie = {"x0": lie.sigma_shift, "y0": lie.sigma_shift, "kappa": lie.sigma_turn}
    sigmas = {
        name: np.hypot(sigma, of_lie.get(name, 0.0)) for name, sigma in zip(sought, adjustment.sigmas, strict=True)
    }
    return ProjectorTest(errors, sigmas, adjustment.residuals.reshape(readings.shape), adjustment, iterations)


def _adjusted(seen: Array, mark: Array, start: Array, sought: list[int]) -> tuple[Adjustment, Array, int]:
    now = start.copy()
    for iteration in range(1, MAX_ITERATIONS + 1):
        computed, design = _computed(mark, now)
        observed = (seen - computed).reshape(-1, *seen.shape[3:])
        step = solve_least_squares(design[:, sought], observed)
        if not (step.condition < MAX_CONDITION).all():
            raise Undetermined(
                "expected crosses and levels that tell principal distance, principal point and element zeros apart, "
                f"got a condition number of {step.condition.max():.1e} (at most {MAX_CONDITION:.0e})"
            )
        now[sought] += step.unknowns
        if np.abs(np.einsum("nu...,u...->n...", design[:, sought], step.unknowns)).max() <= MIN_STEP_MM:
            return step, now, iteration
    raise Undetermined(
        f"expected readings of this plate in this projector, got none that fit in {MAX_ITERATIONS} rounds"
    )


def _computed(mark: Array, elements: Array) -> tuple[Array, Array]:
    """Return the position of a mark ``(3, k, n, ...)`` on the carrier ``(2, k, n, ...)``, and its derivatives.

    The derivatives ``(2kn, 9, ...)`` are by `UNKNOWNS`. A rotation t about an axis moves a point q in the camera's
    frame by ``-R' (t x away)``; then ``dx = -(c dq_x + x dq_z) / q_z``.
    """
    c, x0, y0, omega, phi, kappa, bx, by, bz = elements
    turned = rotation(omega, phi, kappa)
    to_camera = transposed(turned)[:, :, None, None]
    away = mark - np.array([bx, -by, bz])[:, None, None]
    q = mxv(to_camera, away)
    unit = -q[:2] / q[2]
    one, zero = np.ones_like(omega), np.zeros_like(omega)
    axes = (
        np.array([one, zero, zero]),
        np.array([zero, np.cos(omega), np.sin(omega)]),
        turned[:, 2],
    )

    def changed(dq: Array) -> Array:
        return np.asarray(-c * (dq[:2] + unit * dq[2]) / q[2])

    def along(x: float, y: float, z: float) -> Array:
        direction = np.array([x, y, z]).reshape((3, *(1,) * (mark.ndim - 1)))
        return mxv(to_camera, np.broadcast_to(direction, mark.shape))

    level = np.ones_like(unit[0])
    columns = [
        unit,
        np.array([level, 0.0 * level]),
        np.array([0.0 * level, level]),
        *(
            changed(-mxv(to_camera, np.cross(np.broadcast_to(axis[:, None, None], mark.shape), away, axis=0)))
            for axis in axes
        ),
        changed(along(-1.0, 0.0, 0.0)),
        changed(along(0.0, 1.0, 0.0)),
        changed(along(0.0, 0.0, -1.0)),
    ]
    design = np.stack([column.reshape(-1, *mark.shape[3:]) for column in columns], axis=1)
    return c * unit + np.array([x0, y0])[:, None, None], design
