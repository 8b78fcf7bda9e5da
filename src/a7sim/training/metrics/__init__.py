"""Metrics of the exercises' criteria."""

from a7sim.training.metrics import actions, answers, centres, clearing, grid, ground, numerical, readings, truth
from a7sim.training.metrics.base import MEASURES, Metric, MetricResult, make_metric

__all__ = [
    "MEASURES",
    "Metric",
    "MetricResult",
    "actions",
    "answers",
    "centres",
    "clearing",
    "grid",
    "ground",
    "make_metric",
    "numerical",
    "readings",
    "truth",
]
