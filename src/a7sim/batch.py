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
    remains = np.ones(max(int(active.max()), int(others.max())) + 1, dtype=bool)
    remains[others] = False
    return np.asarray(active[remains[active]])


def take(values: npt.NDArray[Scalar], active: Indices) -> npt.NDArray[Scalar]:
    """Return the values ``(..., m)`` of the active sessions from ``(..., all)``, read-only.

    The memory layout is that of `values`, where indexing would transpose it; if all are active nothing is copied.
    """
    return values if active.size == values.shape[-1] else values.take(active, axis=-1)


def put(values: npt.NDArray[np.float64], active: Indices, out: npt.NDArray[np.float64]) -> None:
    """Write values ``(m,)`` or ``(k, m)`` of the active sessions into arrays ``(all,)`` or ``(k, all)``."""
    if active.size == out.shape[-1]:
        out[...] = values
    elif out.ndim == 1:
        out[active] = values
    else:
        for row, new_row in zip(out, values, strict=True):
            row[active] = new_row


def add_at(amount: float, active: Indices, out: npt.NDArray[np.float64]) -> None:
    """Add an amount to the values of the active sessions in an array ``(all,)``."""
    if active.size == out.size:
        out += amount
    else:
        out[active] += amount
