"""Numerical relative orientation after Hallert: from y-parallaxes, at six standard points in closed form."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from a7sim.geometry import (
    PARALLAX_ELEMENTS,
    Array,
    near_vertical_parallax_coefficients,
    parallax_coefficients,
    ray_of,
    rotation,
    stereoscopic_intersection,
)
from a7sim.reduction.coplanarity import RelativeOrientation, Unknowns, coplanarity, finish_orientation, rays_of
from a7sim.reduction.least_squares import Undetermined, solve_least_squares
from a7sim.reduction.normal_equations import MAX_CONDITION
from a7sim.reduction.relative_poses import MAX_ITERATIONS, MIN_POINTS, TOLERANCE
from a7sim.text import pluralize

Scalars = float | Array
"""One number, or one number per pair of a batch ``(...)``."""

REGULAR_POINTS = ((0.0, 1.0, 0.0, 1.0, 0.0, 1.0, 0.5, 0.5, 0.5), (0.0, 0.0, 1.0, 1.0, -1.0, -1.0, 1.0, 0.0, -1.0))
"""x in b and y in d of the six, or all nine, points at which parallaxes are measured, in the order of the parameter."""


def six_point_corrections(parallaxes: Array, b: Scalars, d: Scalars, h: Scalars) -> tuple[Mapping[str, Array], Array]:
    """Return the corrections to the right projector, radians and mm, and s0 in mm, in closed form.

    `parallaxes` ``(6, ...)`` in mm are those at (0, 0), (b, 0), (0, d), (b, d), (0, -d), (b, -d), h below the centres
    (Hallert's points 31, 33, 51, 53, 11, 13). Exactly the least-squares solution; elements and signs are those of
    `element_corrections` with by2, bz2, kappa2, phi2 and omega2. Source: ISP Archives, TIB 1048997812/408.
    """
    p31, p33, p51, p53, p11, p13 = np.asarray(parallaxes, dtype=float)
    hh, dd = h * h, d * d
    by = (
        -p31 * (6 * hh + 4 * dd)
        - p33 * (6 * hh + 8 * dd)
        + (p51 + p11) * (3 * hh + 2 * dd)
        + (p53 + p13) * (3 * hh - 2 * dd)
    ) / (12 * dd)
    kappa = (p31 - p33 + p51 - p53 + p11 - p13) / (3 * b)
    bz = h * (p53 - p13) / (2 * d)
    phi = h * (p51 - p53 - p11 + p13) / (2 * b * d)
    omega = h * (-2 * p31 - 2 * p33 + p51 + p53 + p11 + p13) / (4 * dd)
    s0 = np.abs(-2 * p31 + 2 * p33 + p51 - p53 + p11 - p13) / np.sqrt(12.0)
    return {"by2": by, "bz2": bz, "kappa2": -kappa, "phi2": phi, "omega2": omega}, np.asarray(s0)


def nine_point_corrections(parallaxes: Array, b: Scalars, d: Scalars, h: Scalars) -> tuple[Mapping[str, Array], Array]:
    """Return the same from nine points: those six and (b/2, d), (b/2, 0), (b/2, -d), ``(9, ...)`` in mm.

    Derived like Hallert's six: on three columns of three, 1, x, y, xy and y^2 are fitted to the parallaxes, and T 2.33
    says which elements these are. Exactly the least-squares solution.
    """
    p31, p33, p51, p53, p11, p13, p52, p32, p12 = p = np.asarray(parallaxes, dtype=float)
    left, right, middle = p31 + p51 + p11, p33 + p53 + p13, p31 + p32 + p33
    kappa = (left - right) / (3 * b)
    phi = h * (p51 - p53 - p11 + p13) / (2 * b * d)
    bz = h * (5 * (p53 - p13) + 2 * (p52 - p12) - (p51 - p11)) / (12 * d)
    omega = h * (p.sum(axis=0) - 3 * middle) / (6 * d**2)
    by = h * omega * (1 + 2 * d**2 / (3 * h**2)) + (left - right) / 6 - p.mean(axis=0)
    x, y = (_shaped(each, p) for each in REGULAR_POINTS)
    u, slope = (x - 1) * b, y * d / h
    residuals = p + u * kappa + u * slope * phi - h * (1 + slope**2) * omega + by - slope * bz
    s0 = np.sqrt((residuals**2).sum(axis=0) / (9 - 5))
    return {"by2": by, "bz2": bz, "kappa2": -kappa, "phi2": phi, "omega2": omega}, np.asarray(s0)


def _shaped(values: Sequence[float], like: Array) -> Array:
    return np.asarray(values, dtype=float).reshape((len(values), *(1,) * (like.ndim - 1)))


def regular_corrections(
    parallaxes: Array, b: Scalars, d: Scalars, h: Scalars, unknowns: Sequence[str]
) -> tuple[Array, Array]:
    """Return corrections and their standard deviations ``(5, ...)``, radians and mm, at six or nine regular points.

    The points are those of `six_point_corrections` or `nine_point_corrections`; b, d and h ``(...)`` in mm. Unknowns
    by2, bz2, kappa2, phi2, omega2, or kappa1, kappa2, phi1, phi2 and either omega: a base turned by by / b and bz / b
    is the same as both photographs turned back by as much.
    """
    closed = six_point_corrections if len(parallaxes) == 6 else nine_point_corrections
    right, s0 = closed(parallaxes, b, d, h)
    swing, tilt = right["by2"] / b, right["bz2"] / b
    both = {
        "kappa1": swing,
        "kappa2": right["kappa2"] + swing,
        "phi1": tilt,
        "phi2": right["phi2"] + tilt,
        "omega1": -right["omega2"],
        "omega2": right["omega2"],
    }
    corrections = right if "by2" in unknowns else both
    x, y = (_shaped(each, parallaxes) for each in REGULAR_POINTS)
    rows = [PARALLAX_ELEMENTS.index(name) for name in unknowns]
    n = len(parallaxes)
    design = near_vertical_parallax_coefficients(x[:n] * b, y[:n] * d, h, b)[rows]
    cofactors = solve_least_squares(np.swapaxes(design, 0, 1), parallaxes).cofactors
    spreads = np.sqrt(np.einsum("ii...->i...", cofactors))
    return np.array([corrections[name] for name in unknowns]), np.asarray(s0 * spreads)


def orientation_by_parallaxes(
    image1: Array,
    image2: Array,
    c1: float,
    c2: float,
    unknowns: Unknowns = "independent",
    omega: Literal[1, 2] = 2,
    bx: float = 1.0,
) -> RelativeOrientation:
    """Orient pairs from image points ``(2, n, ...)`` in mm by the y-parallaxes of their model (T 2.33, 2.34).

    As in the plotter, from zero: parallaxes measured in the model, corrections computed and set, until no correction
    remains; all parallaxes of the model have the same weight. Unknowns and errors are those of
    `coplanarity.relative_orientation`; residuals and s0 are in mm of one image coordinate of a vertical pair, by the
    mean scale of the model.
    """
    n, batch = image1.shape[1], image1.shape[2:]
    if n < MIN_POINTS:
        raise Undetermined(f"expected at least {MIN_POINTS} points to orient a pair of photographs, got {n}")
    names = (
        ("kappa1", "kappa2", "phi1", "phi2", f"omega{omega}")
        if unknowns == "independent"
        else ("omega2", "phi2", "kappa2", "by2", "bz2")
    )
    rows = [PARALLAX_ELEMENTS.index(name) for name in names]
    angles = np.zeros((2, 3, *batch))
    centre1, centre2 = np.zeros((3, *batch)), np.zeros((3, *batch))
    centre2[0] = 1.0
    iterations = np.zeros(batch, dtype=np.int64)
    active, before = np.ones(batch, dtype=bool), np.ones(batch)
    for _ in range(MAX_ITERATIONS):
        turns = rotation(*angles[0]), rotation(*angles[1])
        points, parallaxes = stereoscopic_intersection(
            centre1[:, None],
            ray_of(image1, turns[0][:, :, None], c1),
            centre2[:, None],
            ray_of(image2, turns[1][:, :, None], c2),
        )
        coefficients = parallax_coefficients(
            points, points, centre1[:, None], centre2[:, None], angles[0][:, None], angles[1][:, None]
        )
        step = solve_least_squares(np.swapaxes(coefficients[rows], 0, 1), -parallaxes)
        for name, correction in zip(names, step.unknowns * active, strict=True):
            kind, projector = name[:-1], int(name[-1]) - 1
            if kind in ("by", "bz"):
                centre2[("by", "bz").index(kind) + 1] += correction if kind == "bz" else -correction
            else:
                angles[projector, ("omega", "phi", "kappa").index(kind)] += correction
        size = np.abs(step.unknowns).max(axis=0)
        iterations += active
        active = active & ~(size * size < TOLERANCE * before)
        before = np.maximum(size, TOLERANCE)
        if not active.any():
            break
    turns = rotation(*angles[0]), rotation(*angles[1])
    condition = coplanarity(rays_of(image1, c1), rays_of(image2, c2), *turns, centre2)
    if active.any() or not (step.condition < MAX_CONDITION).all() or not (condition.ahead > 0.0).all():
        raise Undetermined(
            f"the y-parallaxes of {n} points do not orient the pair (condition number "
            f"{float(np.max(step.condition)):.1e}, {pluralize(int(iterations.max()), 'iteration')})"
        )
    scale = -points[2].mean(axis=0) / np.sqrt(c1 * c2)
    unit = -np.sqrt(2.0) * scale * condition.by_base[1]  # p = b . (a1 x a2) / (x1 z2 - z1 x2)
    return finish_orientation((image1, image2), (c1, c2), names, turns, bx * centre2, iterations, ~active, bx * unit)
