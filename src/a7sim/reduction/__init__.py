"""The computing room: books in, orientations and centres out. It knows neither instrument nor operator."""

from a7sim.reduction.centres import PerspectiveCentre, perspective_centre
from a7sim.reduction.interior import PictureLie, picture_lie
from a7sim.reduction.least_squares import Adjustment, Undetermined, adjusted
from a7sim.reduction.parallax import Stand, element_corrections

__all__ = [
    "Adjustment",
    "PerspectiveCentre",
    "PictureLie",
    "Stand",
    "Undetermined",
    "adjusted",
    "element_corrections",
    "perspective_centre",
    "picture_lie",
]
