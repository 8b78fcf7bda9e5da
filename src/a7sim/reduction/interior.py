"""How a picture lies on its carrier, from its fiducials."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.reduction.least_squares import adjusted


@dataclass(frozen=True)
class PictureLie:
    """Shift in mm, turn in radians and change of scale of a picture against its collimating marks."""

    dx: float
    dy: float
    turn: float
    scale: float
    """Relative: 1e-4 for a picture that is too large by as much."""


def picture_lie(displacements: Array, marks: Array) -> PictureLie:
    """Return how a picture lies from its fiducials' displacements ``(2, n)`` at collimating marks ``(2, n)``, mm.

    Small-angle similarity ``d = t + (scale, turn) x`` by least squares. Raises Undetermined for one fiducial.
    """
    x, y = marks
    one, zero = np.ones_like(x), np.zeros_like(x)
    design = np.array([np.concatenate(pair) for pair in ((one, zero), (zero, one), (-y, x), (x, y))]).T
    dx, dy, turn, scale = adjusted(design, np.concatenate([displacements[0], displacements[1]])).unknowns
    return PictureLie(float(dx), float(dy), float(turn), float(scale))
