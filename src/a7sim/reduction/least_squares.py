"""Least squares with its statistics, for one set of observations or a batch.

All arrays are component-first: a batch is one more axis at the end, and no single set of normal equations is sent to
LAPACK.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from a7sim.geometry import Array


class Undetermined(ValueError):
    """The observations do not determine the unknowns."""


MAX_CONDITION = 1e13
"""Of the scaled normal equations, in the 1-norm; beyond it half the digits of a solution are noise."""


@dataclass(frozen=True)
class Adjustment:
    """A least-squares solution with its statistics.

    Unknowns ``(u, ...)``, their cofactors ``(u, u, ...)``, residuals ``(n, ...)``, s0 ``(...)``. Residuals are
    ``v = A x - l``: what must be added to the observations. `condition` is that of the scaled normal equations.
    """

    unknowns: Array
    cofactors: Array
    residuals: Array
    redundancy: int
    s0: Array
    condition: Array
    design: Array
    weights: Array | None = None

    @property
    def sigmas(self) -> Array:
        """Standard deviations ``(u, ...)`` of the unknowns."""
        return np.asarray(self.s0 * np.sqrt(np.einsum("ii...->i...", self.cofactors)))

    @property
    def covariance(self) -> Array:
        """Covariance ``(u, u, ...)`` of the unknowns."""
        return np.asarray(self.s0**2 * self.cofactors)

    @property
    def correlations(self) -> Array:
        """Correlations ``(u, u, ...)`` of the unknowns."""
        spread = np.sqrt(np.einsum("ii...->i...", self.cofactors))
        return np.asarray(self.cofactors / (spread[:, None] * spread[None, :]))

    @cached_property
    def redundancy_numbers(self) -> Array:
        """Share ``(n, ...)`` of each observation that controls the others; they add up to n - u."""
        explained = np.einsum("nu...,uv...,nv...->n...", self.design, self.cofactors, self.design)
        return np.asarray(1.0 - explained * (1.0 if self.weights is None else self.weights))


def solve_least_squares(
    design: Array, observed: Array, redundancy: int | None = None, weights: Array | None = None
) -> Adjustment:
    """Return the least-squares solution of ``design x = observed``.

    `design` has shape ``(n, u, ...)``, `observed` ``(n, ...)``, `weights` that of `observed` or one each. The
    redundancy is n - u unless some equations hold no observation. s0 is zero where there is no redundancy.
    Raises Undetermined when any of the normal equations are singular.
    """
    n, u = design.shape[:2]
    degrees = n - u if redundancy is None else redundancy
    weighted = design if weights is None else design * weights[:, None]
    scale = np.sqrt(np.einsum("nu...,nu...->u...", weighted, design))
    if n < u or not (scale > 0.0).all():
        raise Undetermined(f"expected observations that determine {u} unknowns, got {n}")
    normal = np.einsum("nu...,nv...->uv...", weighted, design) / (scale[:, None] * scale[None, :])
    inverse = inverse_of_definite(normal)
    condition = np.abs(normal).sum(axis=0).max(axis=0) * np.abs(inverse).sum(axis=0).max(axis=0)
    if not (condition < MAX_CONDITION).all():
        raise Undetermined(
            f"the {n} observations leave some of the {u} unknowns open (condition number {np.nanmax(condition):.1e})"
        )
    unknowns = np.einsum("uv...,v...->u...", inverse, np.einsum("nu...,n...->u...", weighted, observed) / scale) / scale
    residuals = np.einsum("nu...,u...->n...", design, unknowns) - observed
    squares = (residuals**2 if weights is None else weights * residuals**2).sum(axis=0)
    s0 = np.sqrt(squares / degrees) if degrees > 0 else np.zeros(observed.shape[1:])
    cofactors = inverse / (scale[:, None] * scale[None, :])
    return Adjustment(unknowns, cofactors, residuals, degrees, np.asarray(s0), np.asarray(condition), design, weights)


def inverse_of_definite(matrix: Array) -> Array:
    """Return the inverses of symmetric positive definite matrices ``(u, u, ...)``, by Cholesky.

    A batch is computed elementwise over its last axes, a single matrix by LAPACK. If a matrix is not definite its
    inverse is infinite, so that its condition shows it.
    """
    if matrix.ndim == 2:
        return _inverse_of_one(matrix)
    u = matrix.shape[0]
    lower = np.zeros_like(matrix)
    singular = np.zeros(matrix.shape[2:], dtype=bool)
    for j in range(u):
        pivot = matrix[j, j] - np.einsum("k...,k...->...", lower[j, :j], lower[j, :j])
        singular |= ~(pivot > 0.0)
        root = np.sqrt(np.where(singular, 1.0, pivot))
        lower[j, j] = root
        for i in range(j + 1, u):
            lower[i, j] = (matrix[i, j] - np.einsum("k...,k...->...", lower[i, :j], lower[j, :j])) / root
    upward = np.zeros_like(matrix)
    for j in range(u):
        upward[j, j] = 1.0 / lower[j, j]
        for i in range(j + 1, u):
            upward[i, j] = -np.einsum("k...,k...->...", lower[i, j:i], upward[j:i, j]) / lower[i, i]
    inverse = np.einsum("ki...,kj...->ij...", upward, upward)
    return np.where(singular, np.inf, inverse)


def _inverse_of_one(matrix: Array) -> Array:
    try:
        upward = np.linalg.inv(np.linalg.cholesky(matrix))
    except np.linalg.LinAlgError:
        return np.full_like(matrix, np.inf)
    return np.asarray(upward.T @ upward)
