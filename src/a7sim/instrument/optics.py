"""Fittings and their effects on the view and on the handwheels (thesis 3.2.3.6).

No function here raises an error: with wrong fittings the observer gets the wrong view. The thesis tables the required
positions for picture and base; the effect of a wrong one is an interpretation of this model: a Dove prism with the
wrong index leaves the picture mirrored top to bottom, a diapositive lever on the wrong side leaves it mirrored left to
right, the triangulation lever decides which projector the left eye sees, and a collar that does not belong to the
picture reverses its handwheel.
"""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from a7sim.geometry import GON, Array, plane_rotation
from a7sim.plotters import REQUIRED_FITTINGS, Fittings

VIEW_CACHE_SIZE = 64


@lru_cache(maxsize=VIEW_CACHE_SIZE)
def effective_fittings(fittings: Fittings, polarity: str, base: str, has: tuple[str, ...]) -> Fittings:
    """Return the fittings of an instrument that has only some: the others are correct for any picture."""
    right = REQUIRED_FITTINGS[polarity, base].as_words()
    return replace(fittings, **{name: position for name, position in right.items() if name not in has})


def projector_in_view(eyepiece: int, fittings: Fittings) -> int:
    """Return the projector, 1 or 2, of an eyepiece; eyepiece 1 is the observer's left eye."""
    straight = fittings.triangulation == "back"
    return eyepiece if straight else 3 - eyepiece


@lru_cache(maxsize=VIEW_CACHE_SIZE)
def view_matrix(fittings: Fittings, polarity: str, base: str, kappa_gon: float) -> Array:
    """Return the matrix ``(2, 2)`` from displacements on the carrier to those in the eyepiece, in mm; read-only.

    The optics do not rotate with the swing of the camera, so a swung picture is seen swung.
    """
    right = REQUIRED_FITTINGS[polarity, base]
    mirrored = np.array(
        [
            1.0 if fittings.diapositive == right.diapositive else -1.0,
            1.0 if fittings.dove == right.dove else -1.0,
        ]
    )
    seen = np.asarray(mirrored[:, None] * plane_rotation(kappa_gon * GON))
    seen.flags.writeable = False
    return seen


def handwheel_senses(fittings: Fittings, polarity: str) -> dict[str, float]:
    """Return +1, or -1 for a collar that does not belong to the picture, for the X and Y handwheels and the Z disc."""
    right = REQUIRED_FITTINGS[polarity, "inside"]
    return {
        "X": 1.0 if fittings.xcollar == right.xcollar else -1.0,
        "Y": 1.0 if fittings.ycollar == right.ycollar else -1.0,
        "Z": 1.0,
    }
