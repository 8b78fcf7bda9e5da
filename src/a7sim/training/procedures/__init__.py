"""Procedures of the virtual operator that exercises name."""

from a7sim.training.procedures import cards, models, orienting, testing
from a7sim.training.procedures.base import PROCEDURES, ProcedureContext, procedure, run_procedure

__all__ = ["PROCEDURES", "ProcedureContext", "cards", "models", "orienting", "procedure", "run_procedure", "testing"]
