"""Papers that exercises put into students' hands."""

from a7sim.training.handouts import control, model_sheets, orientation_forms, slipped_book
from a7sim.training.handouts.base import HANDOUTS, Handout, handed_out

__all__ = ["HANDOUTS", "Handout", "control", "handed_out", "model_sheets", "orientation_forms", "slipped_book"]
