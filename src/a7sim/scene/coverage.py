"""Coverage of picture elements by objects with edges."""

import numpy as np

from a7sim.geometry import Array


def within_band(offset: Array, half_width: float, element: float) -> Array:
    """Return the share 0..1 of an element of width `element` covered by a band whose middle is `offset` away.

    An element of zero width is inside or outside the band.
    """
    if element <= 0.0:
        return np.asarray(np.abs(offset) <= half_width, dtype=float)
    low = np.maximum(offset - element / 2.0, -half_width)
    high = np.minimum(offset + element / 2.0, half_width)
    return np.asarray(np.maximum(high - low, 0.0) / element)
