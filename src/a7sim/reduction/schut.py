"""Relative orientation by Schut's condition equations (fragment S, equations 2, 4 and 5)."""

import numpy as np

from a7sim.geometry import Array, mxm
from a7sim.reduction.batched_rotations import rotation_about
from a7sim.reduction.coplanarity import RelativeOrientation, coplanarity, finish_orientation, rays_of
from a7sim.reduction.least_squares import Undetermined, solve_least_squares
from a7sim.reduction.normal_equations import MAX_CONDITION
from a7sim.reduction.relative_poses import MAX_ITERATIONS, MIN_POINTS, TOLERANCE
from a7sim.text import pluralize


def orientation_by_schut(image1: Array, image2: Array, c1: float, c2: float, bx: float = 1.0) -> RelativeOrientation:
    """Orient the right photograph of pairs to the left one from image points ``(2, n, ...)`` in mm, from zero.

    The condition ``b . (a1 x a2) = 0``, linear in by, bz and a small turn of the right camera, gives five normal
    equations a pair; all conditions have the same weight, and rotations are improved by multiplying matrices. The
    unknowns are the dependent ones of `coplanarity.relative_orientation`, as are lengths and errors; residuals and s0
    are in mm of one image coordinate of a vertical pair, exact where the photographs are vertical.
    """
    n, batch = image1.shape[1], image1.shape[2:]
    if n < MIN_POINTS:
        raise Undetermined(f"expected at least {MIN_POINTS} points to orient a pair of photographs, got {n}")
    rays1, rays2 = rays_of(image1, c1), rays_of(image2, c2)
    left = np.broadcast_to(np.eye(3).reshape((3, 3, *(1,) * len(batch))), (3, 3, *batch))
    right, base = left, left[0]
    unit = np.full((n, *batch), np.hypot(c1, c2))
    iterations = np.zeros(batch, dtype=np.int64)
    active, before = np.ones(batch, dtype=bool), np.ones(batch)
    for _ in range(MAX_ITERATIONS):
        condition = coplanarity(rays1, rays2, left, right, base)
        design = np.concatenate([condition.by_turn2, condition.by_base[1:]]) / unit
        step = solve_least_squares(np.swapaxes(design, 0, 1), -condition.discrepancies / unit)
        corrections = step.unknowns * active
        right = mxm(rotation_about(corrections[:3]), right)
        base = base + np.array([np.zeros_like(corrections[3]), corrections[3], corrections[4]])
        size = np.abs(corrections).max(axis=0)
        iterations += active
        active = active & ~(size * size < TOLERANCE * before)
        before = np.maximum(size, TOLERANCE)
        if not active.any():
            break
    meets = (coplanarity(rays1, rays2, left, right, base).ahead > 0.0).all()
    if active.any() or not (step.condition < MAX_CONDITION).all() or not meets:
        raise Undetermined(
            f"Schut's equations do not orient the {n} points (condition number {float(np.max(step.condition)):.1e}, "
            f"{pluralize(int(iterations.max()), 'iteration')})"
        )
    names = ("omega2", "phi2", "kappa2", "by2", "bz2")
    return finish_orientation(
        (image1, image2), (c1, c2), names, (left, right), bx * base, iterations, ~active, unit * bx
    )
