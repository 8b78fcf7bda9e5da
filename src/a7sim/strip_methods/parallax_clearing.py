"""Relative orientation by y-parallaxes as arrays: the result of a plotter without by and bz, point by point."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array, mxm, mxv, ray_of, rotation, stereoscopic_intersection, transposed
from a7sim.reduction import ProjectorPose, Undetermined, element_corrections

UNKNOWNS = ("kappa1", "kappa2", "phi1", "phi2", "omega2")
"""Of the paper P, which has omega" in place of omega'."""

MAX_ROUNDS = 20
CONVERGED_MM = 1e-10
"""Radians: the rounds end when all corrections are smaller."""


@dataclass(frozen=True)
class ClearedPair:
    """Two projectors with cleared parallaxes: images about the principal points, base along X."""

    c: tuple[float | Array, float | Array]
    angles: tuple[Array, Array]
    """omega, phi, kappa ``(3, ...)`` of both, radians."""
    bx: float
    rounds: int

    @property
    def rotations(self) -> tuple[Array, Array]:
        """Rotations ``(3, 3)`` of both cameras into the frame of the projectors."""
        left, right = self.angles
        return rotation(*left), rotation(*right)

    @property
    def rotation(self) -> Array:
        """Rotation ``(3, 3)`` of the right photograph's vectors into the left photograph's frame."""
        left, right = self.rotations
        return mxm(transposed(left), right)

    @property
    def base(self) -> Array:
        """Unit vector ``(3,)`` from the left to the right centre in the left photograph's frame."""
        return mxv(transposed(self.rotations[0]), np.array([1.0, 0.0, 0.0]))

    def of(self, model: int) -> "ClearedPair":
        """Return one of several models cleared together."""
        c = float(np.ravel(self.c[0])[model]), float(np.ravel(self.c[1])[model])
        return ClearedPair(c, (self.angles[0][:, model], self.angles[1][:, model]), self.bx, self.rounds)

    def model_points(self, left: Array, right: Array) -> tuple[Array, Array]:
        """Return the points of zero x-parallax ``(3, n, ...)`` and the y-parallaxes ``(n, ...)``, mm.

        Points are relative to the left centre.
        """
        rays = [
            ray_of(image, camera[:, :, None], c)
            for image, camera, c in zip((left, right), self.rotations, self.c, strict=True)
        ]
        shape = (3, *(1,) * (left.ndim - 1))
        centre1, centre2 = np.zeros(shape), np.array([self.bx, 0.0, 0.0]).reshape(shape)
        return stereoscopic_intersection(centre1, rays[0], centre2, rays[1])


def clear_parallaxes(
    left: Array, right: Array, c: tuple[float | Array, float | Array], bx: float, errors_mm: Array | float = 0.0
) -> ClearedPair:
    """Clear the y-parallaxes of image points ``(2, n, ...)`` in mm, in rounds of observing, computing and setting.

    `c` are the principal distances ``(...)`` of both. `errors_mm` ``(n, ...)`` are the errors of observing zero
    parallax, at the scale of the pictures. Elements are set continuously, not by counters. The pictures first get their
    swings along the base. Raises Undetermined for points that do not determine the five elements or parallaxes that do
    not vanish; of several models, for any of them.
    """
    if left.shape[1] < len(UNKNOWNS):
        raise Undetermined(f"expected at least {len(UNKNOWNS)} points to orient a model, got {left.shape[1]}")
    dx, dy = (left - right).mean(axis=1)
    swing = -np.arctan2(dy, dx)
    zero = np.zeros_like(swing)
    level = np.array([zero, zero, swing])
    cleared = ClearedPair(c, (level, level), bx, 0)
    clearing = np.ones(swing.shape, dtype=bool)
    for i in range(1, MAX_ROUNDS + 1):
        points, parallaxes = cleared.model_points(left, right)
        enlargement = -points[2] / c[0]
        left_pose, right_pose = (
            ProjectorPose(np.array([zero + x, zero, zero]), angles)
            for x, angles in zip((0.0, bx), cleared.angles, strict=True)
        )
        step = element_corrections(
            parallaxes + enlargement * errors_mm, points, left_pose, right_pose, UNKNOWNS
        ).unknowns
        kappa1, kappa2, phi1, phi2, omega2 = np.where(clearing, step, 0.0)
        turns = np.array([zero, phi1, kappa1]), np.array([omega2, phi2, kappa2])
        cleared = ClearedPair(c, (cleared.angles[0] + turns[0], cleared.angles[1] + turns[1]), bx, i)
        clearing = clearing & ~(np.abs(step).max(axis=0) < CONVERGED_MM)
        if not clearing.any():
            return cleared
    raise Undetermined(f"the y-parallaxes of {left.shape[1]} points are not cleared in {MAX_ROUNDS} rounds")
