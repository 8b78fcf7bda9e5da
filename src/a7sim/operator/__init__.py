"""Virtual operator: operates the instrument over its link and knows only views and readings."""

from a7sim.operator.driving.job import Job, ModelJob
from a7sim.operator.people.person import OperatorGaveUp, Person
from a7sim.operator.procedures.models import ModelRecord, measure_models

__all__ = ["Job", "ModelJob", "ModelRecord", "OperatorGaveUp", "Person", "measure_models"]
