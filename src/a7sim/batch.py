"""Batch arrays: the last axis contains all sessions of a batch, and `active` selects some of them."""

from typing import TypeVar

import numpy as np
import numpy.typing as npt

Indices = npt.NDArray[np.intp]
"""Sorted unique indices ``(m,)`` into the batch axis. If m equals the batch size, all sessions are selected."""


Scalar = TypeVar("Scalar", bound=np.generic)


def exclude(active: Indices, others: Indices) -> Indices:
    """Return the indices of `active` that are not in `others`, in order."""
    if not active.size or not others.size:
        return active
    stays = np.ones(max(int(active.max()), int(others.max())) + 1, dtype=bool)
    stays[others] = False
    return np.asarray(active[stays[active]])


def take(values: npt.NDArray[Scalar], active: Indices) -> npt.NDArray[Scalar]:
    """Return the values ``(..., m)`` of the active sessions from ``(..., all)``, read-only.

    The memory layout is that of `values`, where indexing would transpose it; if all are active nothing is copied.
    """
    return values if active.size == values.shape[-1] else values.take(active, axis=-1)


def put(values: npt.NDArray[np.float64], active: Indices, into: npt.NDArray[np.float64]) -> None:
    """Write values ``(m,)`` or ``(k, m)`` of the active sessions into arrays ``(all,)`` or ``(k, all)``."""
    if active.size == into.shape[-1]:
        into[...] = values
    elif into.ndim == 1:
        into[active] = values
    else:
        for row, new in zip(into, values, strict=True):
            row[active] = new


def add_at(amount: float, active: Indices, to: npt.NDArray[np.float64]) -> None:
    """Add an amount to the values of the active sessions in an array ``(all,)``."""
    if active.size == to.size:
        to += amount
    else:
        to[active] += amount
