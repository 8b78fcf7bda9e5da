"""Adjustment of strips by polynomials of the second and third degree, conformal in plan (P; Schut, N.R.C.).

In axes along the strip, x and y counted from its middle, with z = x + i y and unknowns a (complex) and b:

    dX + i dY = a0 + a1 z + a2 z^2 (+ a3 z^3)
    dZ = b0 + b1 x + b2 y + b3 x^2 + b4 x y (+ b5 x^3 + b6 x^2 y)

The plan keeps its angles whatever the coefficients; heights bend along the strip and twist about it.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.reduction.absolute import Ground, GroundFit
from a7sim.reduction.least_squares import Adjustment, Undetermined, solve_least_squares
from a7sim.reduction.strips import Model, is_centre

Degree = Literal[2, 3]


@dataclass(frozen=True)
class StripAxis:
    """Axes along a strip: its middle ``(2, ...)``, unit vector along it ``(2, ...)`` and half its length ``(...)``."""

    middle: Array
    along: Array
    half_length: Array

    def plan(self, coordinates: Array) -> Array:
        """Return x + i y ``(n, ...)`` of ground coordinates ``(3, n, ...)``, in half lengths."""
        dx, dy = coordinates[0] - self.middle[0], coordinates[1] - self.middle[1]
        along, across = self.along
        return np.asarray(((dx * along + dy * across) + 1j * (dy * along - dx * across)) / self.half_length)


@dataclass(frozen=True)
class StripDeformation:
    """Deformation of the strip by the polynomial, after subtraction of the ground's shape, shape ``(...)`` each, at its
    middle.

    Positive scale drift: the strip grows along its axis. Positive horizontal bow: it bends to the left. Positive
    vertical bow: its ends are too high. Positive twist: its left side rises along the strip. Sags are those of the
    whole length.
    """

    scale_drift: Array
    """Change of scale per unit of length along the strip."""
    horizontal_bow: Array
    """Change of azimuth, radians per unit of length."""
    vertical_bow: Array
    """Change of longitudinal tilt, radians per unit of length."""
    twist: Array
    """Change of cross tilt, radians per unit of length."""
    horizontal_sag: Array
    """Offset in plan of the ends against the middle, in the unit of the ground."""
    vertical_sag: Array
    """Height of the ends against the middle, in the unit of the ground."""


@dataclass(frozen=True)
class StripAdjustment:
    """A strip adjusted by polynomials, with the statistics of both, in axes along the strip and half lengths.

    Unknowns of `plan`: Re a0, Im a0, Re a1, ... in the unit of the ground; of `height`: b0 to b4 or b6. Residuals of
    `fit` are computed minus given after the adjustment, of `before` those before it.
    """

    degree: int
    axis: StripAxis
    plan: Adjustment
    height: Adjustment
    model: Model
    fit: GroundFit
    before: GroundFit

    @property
    def deformation(self) -> StripDeformation:
        """Bow, twist and scale drift of the strip, which the polynomials take away."""
        a, b, unit = self.plan.unknowns, self.height.unknowns, self.axis.half_length
        return StripDeformation(
            scale_drift=-2.0 * a[4] / unit**2,
            horizontal_bow=-2.0 * a[5] / unit**2,
            vertical_bow=-2.0 * b[3] / unit**2,
            twist=-b[4] / unit**2,
            horizontal_sag=-a[5],
            vertical_sag=-b[3],
        )

    def corrected(self, coordinates: Array) -> Array:
        """Return points ``(3, n, ...)`` of the strip, in the system of the ground, adjusted."""
        return corrected(coordinates, self.axis, self.plan.unknowns, self.height.unknowns)


def strip_axis(model: Model, along: Array | None = None) -> StripAxis:
    """Return the axis of a strip in the ground system:

    along its centres, or along its points if there are fewer than two.

    `along` ``(2, ...)`` gives another direction in plan. The middle is that of the points' extent along the axis.
    """
    if along is None:
        centres = sorted(name for name in model.points if is_centre(name))
        named = model.at(centres) if len(centres) > 1 else model.coordinates
        plan = named[:2] - named[:2].mean(axis=1)[:, None]
        xx, yy, xy = (plan[0] ** 2).sum(axis=0), (plan[1] ** 2).sum(axis=0), (plan[0] * plan[1]).sum(axis=0)
        angle = np.arctan2(2.0 * xy, xx - yy) / 2.0
        along = np.array([np.cos(angle), np.sin(angle)])
    along = np.asarray(along / np.hypot(along[0], along[1]))
    plan = model.coordinates[:2]
    origin = plan.mean(axis=1)
    moved = plan - origin[:, None]
    forward = moved[0] * along[0] + moved[1] * along[1]
    sideways = moved[1] * along[0] - moved[0] * along[1]
    x, y = (forward.max(axis=0) + forward.min(axis=0)) / 2.0, (sideways.max(axis=0) + sideways.min(axis=0)) / 2.0
    half = (forward.max(axis=0) - forward.min(axis=0)) / 2.0
    if not (half > 0.0).all():
        raise Undetermined("expected a strip with points apart from each other, got all in one place")
    middle = origin + np.array([x * along[0] - y * along[1], x * along[1] + y * along[0]])
    return StripAxis(middle, along, np.asarray(half))


def strip_adjustment(
    model: Model, ground: Ground, degree: Degree = 2, axis: StripAxis | None = None
) -> StripAdjustment:
    """Return a strip adjusted to its control by polynomials of the second or third degree.

    The model's coordinates ``(3, n, ...)`` must be in the system of the ground, as after absolute orientation. In plan
    at least three (four) control points are required, in height five (seven), and for the third degree four bands of
    them. Raises Undetermined for less.
    """
    if degree not in (2, 3):
        raise A7SimError(f"expected a polynomial of degree 2 or 3, got {degree}")
    axis = strip_axis(model) if axis is None else axis
    known = ground.among(model.points)
    points = model.at(known.points)
    given = known.coordinates.reshape((*known.coordinates.shape, *(1,) * (points.ndim - 2)))
    missing = np.where(np.isfinite(given), given, 0.0) - points
    plan, height = known.used[0] > 0.0, known.used[2] > 0.0
    for what, count, fewest in (("plan", plan.sum(), degree + 1), ("height", height.sum(), 2 * degree + 1)):
        if count < fewest:
            raise Undetermined(f"expected at least {fewest} control points in {what} for degree {degree}, got {count}")
    design = _plan_columns(axis.plan(points[:, plan]), degree)
    along, across = axis.along
    turned = np.concatenate(
        [
            missing[0][plan] * along + missing[1][plan] * across,
            missing[1][plan] * along - missing[0][plan] * across,
        ]
    )
    in_plan = solve_least_squares(design, turned)
    in_height = solve_least_squares(_height_columns(axis.plan(points[:, height]), degree), missing[2][height])
    done = Model(model.name, model.points, corrected(model.coordinates, axis, in_plan.unknowns, in_height.unknowns))
    return StripAdjustment(
        degree, axis, in_plan, in_height, done, GroundFit(known, done.at(known.points)), GroundFit(known, points)
    )


def corrected(coordinates: Array, axis: StripAxis, plan: Array, height: Array) -> Array:
    """Return points ``(3, n, ...)`` with the polynomials of given coefficients added (see `StripAdjustment`)."""
    z = axis.plan(coordinates)
    degree = plan.shape[0] // 2 - 1
    n = z.shape[0]
    shift = np.einsum("nu...,u...->n...", _plan_columns(z, degree), plan)
    forward, sideways = shift[:n], shift[n:]
    along, across = axis.along
    return np.asarray(
        coordinates
        + np.array(
            [
                forward * along - sideways * across,
                forward * across + sideways * along,
                np.einsum("nu...,u...->n...", _height_columns(z, degree), height),
            ]
        )
    )


def _plan_columns(z: Array, degree: int) -> Array:
    """Return the coefficients ``(2n, 2 (degree + 1), ...)`` of the real and imaginary parts of a in plan."""
    columns = []
    for k in range(degree + 1):
        power = z**k
        columns += [np.concatenate([power.real, power.imag]), np.concatenate([-power.imag, power.real])]
    return np.stack(columns, axis=1)


def _height_columns(z: Array, degree: int) -> Array:
    """Return the coefficients ``(n, 5 or 7, ...)`` of b in height."""
    x, y = z.real, z.imag
    columns = [np.ones_like(x), x, y, x * x, x * y]
    if degree == 3:
        columns += [x**3, x * x * y]
    return np.stack(columns, axis=1)
