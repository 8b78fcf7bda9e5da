"""The measures that exercises are graded by."""

from a7sim.training.measures import answers, deeds, grid, ground, readings, truth
from a7sim.training.measures.base import MEASURES, Found, Measure, measure_of

__all__ = [
    "MEASURES",
    "Found",
    "Measure",
    "answers",
    "deeds",
    "grid",
    "ground",
    "measure_of",
    "readings",
    "truth",
]
