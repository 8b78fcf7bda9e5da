"""Handouts of exercises."""

from a7sim.training.handouts import control, job_sheet, model_sheets, orientation_forms, slipped_book
from a7sim.training.handouts.base import HANDOUTS, Handout, make_handout

__all__ = [
    "HANDOUTS",
    "Handout",
    "control",
    "job_sheet",
    "make_handout",
    "model_sheets",
    "orientation_forms",
    "slipped_book",
]
