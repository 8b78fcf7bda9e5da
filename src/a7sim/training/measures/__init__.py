"""The measures that exercises are graded by."""

from a7sim.training.measures import answers, centres, clearing, deeds, grid, ground, numerical, readings, truth
from a7sim.training.measures.base import MEASURES, Found, Measure, measure_of

__all__ = [
    "MEASURES",
    "Found",
    "Measure",
    "answers",
    "centres",
    "clearing",
    "deeds",
    "grid",
    "ground",
    "measure_of",
    "numerical",
    "readings",
    "truth",
]
