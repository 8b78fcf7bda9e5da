"""Least-squares reductions: observations in, orientations, perspective centres, models and strips out.

The package imports neither instrument nor operator. Functions take component-first arrays; a batch is one more axis at
the end. Observations that do not determine the result raise `Undetermined`.
"""

from a7sim.deprecation import renamed_attributes
from a7sim.reduction.absolute import AbsoluteOrientation, Ground, GroundFit, absolute_orientation
from a7sim.reduction.block import BlockAdjustment, block_adjustment
from a7sim.reduction.cards import Deck, deck_lines, free_format_lines, is_deck, output_lines, read_cards, write_cards
from a7sim.reduction.centres import (
    PerspectiveCentre,
    a8_centres,
    grid_plate_centre,
    perspective_centre,
    perspective_centre_of_levels,
)
from a7sim.reduction.coplanarity import RelativeOrientation, relative_orientation
from a7sim.reduction.corrections import corrected_image
from a7sim.reduction.grid_test import Elements, PlatePlacement, ProjectorTest, grid_test, plate_placement
from a7sim.reduction.hallert import orientation_by_parallaxes
from a7sim.reduction.interior import (
    PicturePlacement,
    PlaneFit,
    picture_placement,
    plane_fit,
    principal_distance_for_film,
)
from a7sim.reduction.least_squares import Adjustment, Undetermined, solve_least_squares
from a7sim.reduction.modelling import a8_model_coordinates, model_coordinates
from a7sim.reduction.parallax import ProjectorPose, element_corrections
from a7sim.reduction.polynomials import StripAdjustment, StripDeformation, strip_adjustment
from a7sim.reduction.relative_poses import relative_poses
from a7sim.reduction.resection import Resection
from a7sim.reduction.schut import orientation_by_schut
from a7sim.reduction.similarity import Similarity, similarity_by_iteration, similarity_by_quaternion
from a7sim.reduction.snooping import SnoopedOrientation, snooped_orientation
from a7sim.reduction.strips import Join, Model, Strip, formed_strip, joined

__all__ = [
    "AbsoluteOrientation",
    "Adjustment",
    "BlockAdjustment",
    "Deck",
    "Elements",
    "Ground",
    "GroundFit",
    "Join",
    "Model",
    "PerspectiveCentre",
    "PicturePlacement",
    "PlaneFit",
    "PlatePlacement",
    "ProjectorPose",
    "ProjectorTest",
    "RelativeOrientation",
    "Resection",
    "Similarity",
    "SnoopedOrientation",
    "Strip",
    "StripAdjustment",
    "StripDeformation",
    "Undetermined",
    "a8_centres",
    "a8_model_coordinates",
    "absolute_orientation",
    "block_adjustment",
    "corrected_image",
    "deck_lines",
    "element_corrections",
    "formed_strip",
    "free_format_lines",
    "grid_plate_centre",
    "grid_test",
    "is_deck",
    "joined",
    "model_coordinates",
    "orientation_by_parallaxes",
    "orientation_by_schut",
    "output_lines",
    "perspective_centre",
    "perspective_centre_of_levels",
    "picture_placement",
    "plane_fit",
    "plate_placement",
    "principal_distance_for_film",
    "read_cards",
    "relative_orientation",
    "relative_poses",
    "similarity_by_iteration",
    "similarity_by_quaternion",
    "snooped_orientation",
    "solve_least_squares",
    "strip_adjustment",
    "write_cards",
]

__getattr__ = renamed_attributes(
    __name__,
    {
        "PictureLie": "PicturePlacement",
        "PlateLie": "PlatePlacement",
        "Stand": "ProjectorPose",
        "adjusted": "solve_least_squares",
        "picture_lie": "picture_placement",
        "plate_lie": "plate_placement",
    },
)
"""Public names of release 0.1.0: each still works and warns."""
