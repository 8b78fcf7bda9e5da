"""The operator: a person who works the instrument through its line and knows only what can be seen and read."""

from a7sim.operator.job import Job, ModelJob
from a7sim.operator.models import ModelRecord, measure_models
from a7sim.operator.person import OperatorGaveUp, Person

__all__ = ["Job", "ModelJob", "ModelRecord", "OperatorGaveUp", "Person", "measure_models"]
