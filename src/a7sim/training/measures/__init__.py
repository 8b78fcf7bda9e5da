"""The measures that exercises are graded by."""

from a7sim.training.measures import centres, clearing, numerical, procedure, truth
from a7sim.training.measures.base import MEASURES, Found, Measure, measure_of

__all__ = ["MEASURES", "Found", "Measure", "centres", "clearing", "measure_of", "numerical", "procedure", "truth"]
