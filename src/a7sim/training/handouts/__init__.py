"""Papers that exercises put into students' hands."""

from a7sim.training.handouts import orientation_forms, slipped_book
from a7sim.training.handouts.base import HANDOUTS, Handout, handed_out

__all__ = ["HANDOUTS", "Handout", "handed_out", "orientation_forms", "slipped_book"]
