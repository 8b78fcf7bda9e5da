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
from a7sim.reduction.least_squares import Adjustment, Undetermined, solve_least_squares
from a7sim.reduction.normal_equations import MAX_CONDITION
from a7sim.reduction.relative_poses import RelativePoses, relative_poses
from a7sim.text import pluralize

Unknowns = Literal["independent", "dependent"]


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
    return finish_orientation(
        (image1, image2), (c1, c2), names, (rotation1, rotation2), centre2, poses.iterations, poses.converged
    )


def _why(poses: RelativePoses, n: int) -> str:
    """Return the reason why the first pair that is not oriented is not."""
    first = int(np.flatnonzero(~poses.converged)[0])
    which = "" if poses.converged.ndim == 0 else f" of pair {first}"
    condition = float(poses.condition.flat[first])
    if not condition < MAX_CONDITION:
        return (
            f"the {n} points{which} leave the relative orientation open: they lie on a line or a critical surface, "
            f"or on one nearly (condition number {condition:.1e}, at most {MAX_CONDITION:.0e})"
        )
    return (
        f"no relative orientation brings the rays of all {n} points{which} together before both cameras "
        f"(condition number {condition:.1e}, {pluralize(int(poses.iterations.flat[first]), 'iteration')})"
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


def finish_orientation(
    images: tuple[Array, Array],
    c: tuple[float, float],
    unknowns: tuple[str, ...],
    rotations: tuple[Array, Array],
    centre2: Array,
    iterations: npt.NDArray[np.int64],
    converged: npt.NDArray[np.bool_],
    unit: Array | None = None,
) -> RelativeOrientation:
    """Return the orientation from the result of the iterations, with the statistics of its unknowns.

    `unit` ``(n, ...)`` is the divisor of each condition; without it that is its steepness, so that all have the weight
    of their image coordinates. Raises Undetermined for singular normal equations.
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
    adjustment = solve_least_squares(design, -condition.discrepancies / unit)
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
    """Return the axes ``(3, ...)`` of the rotations omega, phi and kappa of a camera."""
    omega = angles[0]
    zero, one = np.zeros_like(omega), np.ones_like(omega)
    return np.array([one, zero, zero]), np.array([zero, np.cos(omega), np.sin(omega)]), m[:, 2]
