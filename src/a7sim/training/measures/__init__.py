"""The measures that exercises are graded by."""

from a7sim.training.measures import answers, grid, ground, procedure, truth
from a7sim.training.measures.base import MEASURES, Found, Measure, measure_of

__all__ = ["MEASURES", "Found", "Measure", "answers", "grid", "ground", "measure_of", "procedure", "truth"]
