"""Least squares with its statistics, for one set of observations or a batch of them."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array


@dataclass(frozen=True)
class Adjustment:
    """Unknowns ``(u, ...)``, their cofactors ``(u, u, ...)``, residuals ``(n, ...)`` and s0 ``(...)``.

    Residuals are ``v = A x - l``: what must be added to the observations.
    """

    unknowns: Array
    cofactors: Array
    residuals: Array
    redundancy: int
    s0: Array

    @property
    def sigmas(self) -> Array:
        """Standard deviations ``(u, ...)`` of the unknowns."""
        return np.asarray(self.s0 * np.sqrt(np.einsum("ii...->i...", self.cofactors)))


class Undetermined(ValueError):
    """The observations do not determine the unknowns."""


LARGEST_CONDITION = 1e14


def adjusted(design: Array, observed: Array, redundancy: int | None = None) -> Adjustment:
    """Return the least-squares solution of ``design x = observed``, all weights one.

    `design` has shape ``(n, u, ...)``, `observed` ``(n, ...)``. The redundancy is n - u unless some equations
    hold no observation. s0 is zero where there is no redundancy. Raises Undetermined when the normal
    equations are singular.
    """
    n, u = design.shape[:2]
    degrees = n - u if redundancy is None else redundancy
    scale = np.sqrt((design**2).sum(axis=0))
    if n < u or not (scale > 0.0).all():
        raise Undetermined(f"expected observations that determine {u} unknowns, got {n}")
    scaled = design / scale
    normal = np.moveaxis(np.einsum("nu...,nv...->uv...", scaled, scaled), (0, 1), (-2, -1))
    if not (np.linalg.cond(normal) < LARGEST_CONDITION).all():
        raise Undetermined(f"the {n} observations leave some of the {u} unknowns open")
    inverse = np.moveaxis(np.linalg.inv(normal), (-2, -1), (0, 1))
    unknowns = np.einsum("uv...,nv...,n...->u...", inverse, scaled, observed) / scale
    residuals = np.einsum("nu...,u...->n...", design, unknowns) - observed
    s0 = np.sqrt((residuals**2).sum(axis=0) / degrees) if degrees > 0 else np.zeros(observed.shape[1:])
    cofactors = inverse / (scale[:, None] * scale[None, :])
    return Adjustment(unknowns, cofactors, residuals, degrees, np.asarray(s0))
