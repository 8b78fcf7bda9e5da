"""Some among many: arrays whose last axis are all sessions of a crowd, or all instruments of a fleet."""

from typing import TypeVar

import numpy as np
import numpy.typing as npt

Indices = npt.NDArray[np.intp]
"""Indices ``(m,)`` of those that are meant, ascending, each once: as many as there are mean everybody."""


Scalar = TypeVar("Scalar", bound=np.generic)


def exclude(active: Indices, others: Indices) -> Indices:
    """Return those of some that are not among others, in their order."""
    if not active.size or not others.size:
        return active
    stays = np.ones(max(int(active.max()), int(others.max())) + 1, dtype=bool)
    stays[others] = False
    return np.asarray(active[stays[active]])


def take(values: npt.NDArray[Scalar], active: Indices) -> npt.NDArray[Scalar]:
    """Return the values ``(..., m)`` of some among those ``(..., all)``, to be read at once and not written to.

    They are laid out as these, where indexing transposes; everybody's are not copied.
    """
    return values if active.size == values.shape[-1] else values.take(active, axis=-1)


def put(values: npt.NDArray[np.float64], active: Indices, into: npt.NDArray[np.float64]) -> None:
    """Put values ``(m,)`` or ``(k, m)`` of some among those ``(all,)`` or ``(k, all)`` of all."""
    if active.size == into.shape[-1]:
        into[...] = values
    elif into.ndim == 1:
        into[active] = values
    else:
        for row, new in zip(into, values, strict=True):
            row[active] = new


def add_at(amount: float, active: Indices, to: npt.NDArray[np.float64]) -> None:
    """Add an amount to the values of some among those ``(all,)`` of all."""
    if active.size == to.size:
        to += amount
    else:
        to[active] += amount
