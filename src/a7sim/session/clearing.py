"""Relative orientation by y-parallaxes on arrays: what a plotter without by and bz comes to, point by point."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array, mxm, mxv, ray_of, rotation, stereoscopic_intersection, transposed
from a7sim.reduction import Stand, Undetermined, element_corrections

UNKNOWNS = ("kappa1", "kappa2", "phi1", "phi2", "omega2")
"""Of the paper P, which has omega" in place of omega'."""

MOST_ROUNDS = 20
CLEARED = 1e-10
"""Radians: the rounds end when every correction is smaller."""


@dataclass(frozen=True)
class Cleared:
    """Two projectors as they stand when the parallaxes are cleared: images about the principal points, base along X."""

    c: tuple[float, float]
    angles: tuple[Array, Array]
    """omega, phi, kappa ``(3,)`` of both, radians."""
    bx: float
    rounds: int

    @property
    def rotations(self) -> tuple[Array, Array]:
        """Rotations ``(3, 3)`` of both cameras into the frame of the projectors."""
        left, right = self.angles
        return rotation(*left), rotation(*right)

    @property
    def rotation(self) -> Array:
        """The rotation ``(3, 3)`` that takes the right photograph's vectors into the left photograph's frame."""
        left, right = self.rotations
        return mxm(transposed(left), right)

    @property
    def base(self) -> Array:
        """Unit vector ``(3,)`` from the left to the right centre in the left photograph's frame."""
        return mxv(transposed(self.rotations[0]), np.array([1.0, 0.0, 0.0]))

    def seen(self, left: Array, right: Array) -> tuple[Array, Array]:
        """Return where x-parallax vanishes ``(3, n)``, from the left centre, and the y-parallaxes ``(n,)``, mm."""
        rays = [
            ray_of(image, turned[:, :, None], c)
            for image, turned, c in zip((left, right), self.rotations, self.c, strict=True)
        ]
        centre1, centre2 = np.zeros((3, 1)), np.array([[self.bx], [0.0], [0.0]])
        return stereoscopic_intersection(centre1, rays[0], centre2, rays[1])


def cleared(left: Array, right: Array, c: tuple[float, float], bx: float, errors_mm: Array | float = 0.0) -> Cleared:
    """Clear the y-parallaxes of image points ``(2, n)`` in mm, in rounds of seeing, computing and setting.

    `errors_mm` ``(n,)`` are those with which each parallax is seen to vanish, at the scale of the pictures. Elements
    are set as they come, without a counter: that is how a parallax is cleared. The pictures are first laid with their
    swings along the base. Raises Undetermined for points that do not determine the five elements or parallaxes that
    do not vanish.
    """
    if left.shape[1] < len(UNKNOWNS):
        raise Undetermined(f"expected at least {len(UNKNOWNS)} points to orient a model, got {left.shape[1]}")
    dx, dy = (left - right).mean(axis=1)
    level = np.array([0.0, 0.0, -np.arctan2(dy, dx)])
    stand = Cleared(c, (level, level), bx, 0)
    for i in range(1, MOST_ROUNDS + 1):
        points, parallaxes = stand.seen(left, right)
        enlargement = -points[2] / c[0]
        one, two = (Stand(np.array([x, 0.0, 0.0]), angles) for x, angles in zip((0.0, bx), stand.angles, strict=True))
        step = element_corrections(parallaxes + enlargement * errors_mm, points, one, two, UNKNOWNS).unknowns
        kappa1, kappa2, phi1, phi2, omega2 = step
        turns = np.array([0.0, phi1, kappa1]), np.array([omega2, phi2, kappa2])
        stand = Cleared(c, (stand.angles[0] + turns[0], stand.angles[1] + turns[1]), bx, i)
        if np.abs(step).max() < CLEARED:
            return stand
    raise Undetermined(f"the y-parallaxes of {left.shape[1]} points are not cleared in {MOST_ROUNDS} rounds")
