"""Some among many: arrays whose last axis are all sessions of a crowd, or all instruments of a fleet."""

import numpy as np
import numpy.typing as npt

Who = npt.NDArray[np.intp]
"""Indices ``(m,)`` of those that are meant."""


def without(who: Who, others: Who) -> Who:
    """Return those of some that are not among others, in their order."""
    if not who.size or not others.size:
        return who
    stays = np.ones(max(int(who.max()), int(others.max())) + 1, dtype=bool)
    stays[others] = False
    return np.asarray(who[stays[who]])


def among(values: npt.NDArray[np.float64], who: Who) -> npt.NDArray[np.float64]:
    """Return the values ``(..., m)`` of some among those ``(..., all)``, laid out as these; indexing transposes."""
    return values.take(who, axis=-1)


def put(values: npt.NDArray[np.float64], who: Who, into: npt.NDArray[np.float64]) -> None:
    """Put values ``(k, m)`` of some among those ``(k, all)`` of all."""
    for row, new in zip(into, values, strict=True):
        row[who] = new
