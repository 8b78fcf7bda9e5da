"""Job sheet of the operator. It contains no truth about a photograph."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from a7sim.scenario import Camera, GridPlate, Plan
from a7sim.standard_points import CASES


@dataclass(frozen=True)
class ModelJob:
    """Model to be set up: its two photographs, the base, and its standard points by position, and others."""

    name: str
    left: str
    right: str
    base: str
    polarity: str
    standard_points: Mapping[str, str]
    other_points: tuple[str, ...] = ()
    """Control, check and other points, measured if both prints show them."""

    @property
    def left_projector(self) -> int:
        """Projector of the left-hand photograph: 1 with base in, 2 with base out."""
        return 1 if self.base == "inside" else 2

    @property
    def right_projector(self) -> int:
        """Projector of the right-hand photograph."""
        return 3 - self.left_projector

    def side_of(self, projector: int) -> int:
        """Return 1 if a projector holds the left-hand photograph, 2 if the right-hand one."""
        return 1 if projector == self.left_projector else 2

    def points_of_case(self, case: str) -> list[str]:
        """Return the positions of a case that this model has."""
        return [label for label in CASES[case] if label in self.standard_points]

    def all_positions(self) -> list[str]:
        """Return all standard positions that this model has."""
        return self.points_of_case("E")


@dataclass(frozen=True)
class Job:
    """Camera certificate, settings, models in order, and the data of the grid plate."""

    certificate: Camera
    plan: Plan
    models: tuple[ModelJob, ...]
    grid_plate: GridPlate = field(default_factory=GridPlate)
    control: Mapping[str, tuple[float, float, float]] = field(default_factory=dict)
    """X, Y, Z in m of ground control, nan if not given, for models that are levelled at the instrument."""

    @property
    def tolerated_parallax_mm(self) -> float:
        """Rms of the residual y-parallaxes at the scale of the model above which a model does not fit."""
        return 1e-3 * self.plan.tolerated_parallax_um * self.plan.projection_height / self.certificate.c
