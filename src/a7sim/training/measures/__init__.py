"""The measures that exercises are graded by."""

from a7sim.training.measures import ground, procedure, truth
from a7sim.training.measures.base import MEASURES, Found, Measure, measure_of

__all__ = ["MEASURES", "Found", "Measure", "ground", "measure_of", "procedure", "truth"]
