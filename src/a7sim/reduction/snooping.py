"""Data snooping: relative orientation that identifies the point with the blunder and repeats without it."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from a7sim.geometry import Array
from a7sim.reduction.coplanarity import RelativeOrientation, Unknowns, relative_orientation
from a7sim.reduction.least_squares import Adjustment

CRITICAL = 3.29
"""Of a standardised residual, with a known standard deviation: one sound observation in a thousand exceeds it."""

STUDENT = {1: 636.6, 2: 31.6, 3: 12.9, 4: 8.61, 5: 6.87, 6: 5.96, 7: 5.41, 8: 5.04, 9: 4.78, 10: 4.59, 12: 4.32,
           15: 4.07, 20: 3.85, 30: 3.65, 60: 3.46, 120: 3.37}  # fmt: skip
"""The same by degrees of freedom, where the standard deviation is estimated from the other observations."""

MIN_CONTROL = 1e-6
"""Redundancy number below which a residual is meaningless."""


@dataclass(frozen=True)
class Blunder:
    """Removed point: its name, its y-parallax error in mm at picture scale, and its standardised residual."""

    point: str
    parallax_mm: float
    standardised: float
    critical: float


@dataclass(frozen=True)
class SnoopedOrientation:
    """Orientation without the blunders, and the blunders."""

    orientation: RelativeOrientation
    points: tuple[str, ...]
    """Names of the points of the orientation."""

    blunders: tuple[Blunder, ...]
    standardised: Array
    """Residuals ``(n,)`` of the remaining points, each divided by its standard deviation."""

    searchable: bool
    """False for fewer than seven points: all standardised residuals are then equal, and a blunder cannot be identified.
    """


def standardised_residuals(adjustment: Adjustment, sigma: float | None = None) -> Array:
    """Return residuals ``(n, ...)`` divided by their standard deviations ``sigma sqrt(r)``, r the redundancy number.

    Without `sigma`, the standard deviation of one observation of weight 1, each is divided by its estimate from the
    other observations, so that it follows Student's distribution with one degree of freedom less than the redundancy.
    Zero where r is zero.
    """
    share = adjustment.redundancy_numbers
    seen = share > MIN_CONTROL
    squares = np.where(seen, adjustment.residuals**2 / np.where(seen, share, 1.0), 0.0)
    if sigma is not None:
        variance = np.broadcast_to(sigma**2, squares.shape)
    else:
        freedom = max(adjustment.redundancy - 1, 1)
        variance = np.maximum(adjustment.redundancy * adjustment.s0**2 - squares, 0.0) / freedom
        variance = np.maximum(variance, 1e-24 + 1e-12 * squares)
    return np.asarray(np.sign(adjustment.residuals) * np.sqrt(squares / variance))


def snooped_orientation(
    image1: Array,
    image2: Array,
    c1: float,
    c2: float,
    points: Sequence[str] | None = None,
    sigma: float | None = None,
    unknowns: Unknowns = "independent",
    omega: Literal[1, 2] = 2,
    bx: float = 1.0,
) -> SnoopedOrientation:
    """Orient one pair from image points ``(2, n)`` in mm, removing one point after the other that does not fit.

    The point with the largest standardised residual is removed while that exceeds the critical value (0.1 %) and the
    redundancy, at least two, still separates points. `sigma` is the known standard deviation of one image coordinate in
    mm; without it the other points estimate it. Raises Undetermined as `relative_orientation`.
    """
    names = tuple(points) if points is not None else tuple(str(i + 1) for i in range(image1.shape[1]))
    kept = list(range(image1.shape[1]))
    blunders: list[Blunder] = []
    while True:
        found = relative_orientation(image1[:, kept], image2[:, kept], c1, c2, unknowns, omega, bx)
        adjustment = found.adjustment
        w = standardised_residuals(adjustment, sigma)
        critical = CRITICAL if sigma is not None else _student(adjustment.redundancy - 1)
        searchable = adjustment.redundancy >= 2
        worst = int(np.argmax(np.abs(w)))
        if not searchable or np.abs(w[worst]) <= critical:
            return SnoopedOrientation(found, tuple(names[i] for i in kept), tuple(blunders), w, searchable)
        error = float(np.sqrt(2.0) * adjustment.residuals[worst] / adjustment.redundancy_numbers[worst])
        blunders.append(Blunder(names[kept[worst]], error, float(w[worst]), critical))
        del kept[worst]


def _student(freedom: int) -> float:
    """Return the critical value for degrees of freedom: that of the next smaller number in the table."""
    return STUDENT[max(each for each in STUDENT if each <= freedom)] if freedom > 0 else np.inf
