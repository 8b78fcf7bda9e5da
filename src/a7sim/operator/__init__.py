"""The operator: a person who works the instrument through its line and knows only what can be seen and read."""

from a7sim.operator.driving.job import Job, ModelJob
from a7sim.operator.people.person import OperatorGaveUp, Person
from a7sim.operator.procedures.models import ModelRecord, measure_models

__all__ = ["Job", "ModelJob", "ModelRecord", "OperatorGaveUp", "Person", "measure_models"]
