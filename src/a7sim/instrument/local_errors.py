"""Local errors of a projector: errors of rods, rails and gimbals beyond those that a grid test determines."""

import numpy as np

from a7sim.geometry import Array

_GRID_MM = np.array(np.meshgrid(np.linspace(-100.0, 100.0, 5), np.linspace(-100.0, 100.0, 5))).reshape(2, -1)
"""Crosses of a grid test."""

_UNIT_MM = 100.0
_DEGREES = tuple((i, j) for total in range(5) for j in range(total + 1) for i in (total - j,))
"""Powers of x and y in the polynomials of smooth local errors."""

_OF_X, _OF_Y = np.array(_DEGREES).T


def smooth_local_errors(rng: np.random.Generator) -> Array:
    """Return coefficients ``(2, k)`` of local errors over the picture, polynomials of the fourth degree.

    Drawn with equal variance for all powers of x and y in 100 mm; the part that a grid test determines (shift,
    principal distance, swing and both tilts) is removed, and the rest scaled to a standard error of one on the test's
    25 crosses.
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


def local_errors(coefficients: Array, image: Array) -> Array:
    """Return the local errors ``(2, ...)`` at image points ``(2, ...)`` in mm from coefficients ``(2, k, ...)``."""
    return np.asarray(np.einsum("ck...,k...->c...", coefficients, powers_at(image)))


def powers_at(image: Array) -> Array:
    """Return the powers ``(k, ...)`` of image points ``(2, ...)`` in mm."""
    both = image / _UNIT_MM
    square = both * both
    powers = np.array([np.ones_like(both), both, square, square * both, square * square])
    return np.asarray(powers[_OF_X, 0] * powers[_OF_Y, 1])


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
