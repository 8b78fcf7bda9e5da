"""How much of a picture element is covered by what has an edge."""

import numpy as np

from a7sim.geometry import Array


def within_band(offset: Array, half_width: float, element: float) -> Array:
    """Return what share 0..1 of an element as wide as `element` a band covers whose middle is `offset` away.

    An element of no width lies in the band or beside it.
    """
    if element <= 0.0:
        return np.asarray(np.abs(offset) <= half_width, dtype=float)
    low = np.maximum(offset - element / 2.0, -half_width)
    high = np.minimum(offset + element / 2.0, half_width)
    return np.asarray(np.maximum(high - low, 0.0) / element)
