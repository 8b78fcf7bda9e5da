"""Projectors of an A8 as the last adjustment left them: c, principal point and local errors of the projected bundle."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.scenario import GridTest

_GRID_MM = np.array(np.meshgrid(np.linspace(-100.0, 100.0, 5), np.linspace(-100.0, 100.0, 5))).reshape(2, -1)
"""Crosses of a grid test."""

_UNIT_MM = 100.0
_DEGREES = tuple((i, j) for total in range(5) for j in range(total + 1) for i in (total - j,))
"""Powers of x and y in the polynomials of smooth local errors."""


@dataclass(frozen=True)
class Projector:
    """A projector as the last adjustment left it, mm in the plane of the picture."""

    principal_distance_error: float
    principal_point: Array
    local: Array
    """Coefficients ``(2, k)`` of smooth local errors, in the powers of `_DEGREES`."""
    scattered: float

    @classmethod
    def drawn(cls, test: GridTest, rng: np.random.Generator) -> "Projector":
        """Return a projector of an instrument whose grid tests come out like this."""
        c, *point = rng.standard_normal(3) * [
            test.principal_distance_mm, test.principal_point_mm, test.principal_point_mm,
        ]  # fmt: skip
        local = smooth_local_errors(rng)
        smooth = test.local == "smooth"
        return cls(
            float(c),
            np.array(point),
            1e-3 * test.local_um * local * smooth,
            0.0 if smooth else 1e-3 * test.local_um,
        )

    def shown(self, image: Array, rng: np.random.Generator) -> Array:
        """Return image points ``(2, n)`` about the principal point as this projector projects them."""
        scatter = self.scattered * rng.standard_normal(image.shape)
        return np.asarray(image + self.principal_point[:, None] + self.local @ powers_at(image) + scatter)


def smooth_local_errors(rng: np.random.Generator) -> Array:
    """Return coefficients ``(2, k)`` of local errors over the picture, polynomials of the fourth degree.

    Drawn alike for every power of x and y in 100 mm; what a grid test computes (shift, principal distance, swing and
    both tilts) is taken off, and what is left scaled to a standard error of one on the test's 25 crosses.
    """
    powers = powers_at(_GRID_MM)
    coefficients = rng.standard_normal((2, len(_DEGREES)))
    regular = _regular_errors()
    design = np.einsum("uck,kn->cnu", regular, powers).reshape(-1, len(regular))
    found = np.linalg.lstsq(design, (coefficients @ powers).reshape(-1), rcond=None)[0]
    coefficients = coefficients - np.einsum("u,uck->ck", found, regular)
    left = coefficients @ powers
    s0 = np.sqrt((left**2).sum() / (left.size - len(regular)))
    return np.asarray(coefficients / s0)


def _regular_errors() -> Array:
    """Return shift in x and y, principal distance, swing and two tilts ``(6, 2, k)`` as coefficients."""
    place = {degree: i for i, degree in enumerate(_DEGREES)}
    terms = (
        (((0, 0), 1.0), None),
        (None, ((0, 0), 1.0)),
        (((1, 0), 1.0), ((0, 1), 1.0)),
        (((0, 1), -1.0), ((1, 0), 1.0)),
        (((2, 0), 1.0), ((1, 1), 1.0)),
        (((1, 1), 1.0), ((0, 2), 1.0)),
    )
    coefficients = np.zeros((len(terms), 2, len(_DEGREES)))
    for row, both in zip(coefficients, terms, strict=True):
        for coordinate, term in enumerate(both):
            if term is not None:
                row[coordinate, place[term[0]]] = term[1]
    return coefficients


def powers_at(image: Array) -> Array:
    """Return the powers ``(k, n)`` of image points ``(2, n)``."""
    x, y = image / _UNIT_MM
    return np.array([x**i * y**j for i, j in _DEGREES])
