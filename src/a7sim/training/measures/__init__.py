"""The measures that exercises are graded by."""

from a7sim.training.measures import answers, centres, clearing, deeds, numerical, readings, truth
from a7sim.training.measures.base import MEASURES, Found, Measure, measure_of

__all__ = [
    "MEASURES",
    "Found",
    "Measure",
    "answers",
    "centres",
    "clearing",
    "deeds",
    "measure_of",
    "numerical",
    "readings",
    "truth",
]
