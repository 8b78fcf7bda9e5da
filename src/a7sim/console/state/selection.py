"""Selected control and step, and the lines of its turns. One key is one step."""

from dataclasses import dataclass, replace

from a7sim.link.headers import header
from a7sim.plotters import Variant

STEP_SIZES = (0.002, 0.01, 0.05, 0.1, 1.0, 10.0)
"""Step sizes; the first turns a drum between two counts, for work by eye."""

SIDELESS_ELEMENTS = ("bx", "common_phi")
"""Elements of neither side."""

SIDES = {1: "'", 2: '"'}
"""Notation of the left and the right projector."""


@dataclass(frozen=True)
class ControlSelection:
    """Selection: element, side, step size; and whether X and Y are disengaged from the wheels."""

    name: str = "by"
    side: int = 1
    step_index: int = STEP_SIZES.index(1.0)
    free: bool = False

    @property
    def step(self) -> float:
        """Present step, mm or gon or units of a counter."""
        return STEP_SIZES[self.step_index]

    @property
    def element(self) -> str:
        """Selected element, such as by1 or bx."""
        return self.name if self.name in SIDELESS_ELEMENTS else f"{self.name}{self.side}"

    def valid_for(self, variant: Variant) -> "ControlSelection":
        """Return the selection for a plotter that may not have the selected element."""
        return self if self.element in variant.elements else replace(self, name="kappa")

    def stepping(self, rungs: int) -> "ControlSelection":
        """Return the selection with a larger or smaller step."""
        return replace(self, step_index=min(max(self.step_index + rungs, 0), len(STEP_SIZES) - 1))

    def turned(self, way: int) -> str:
        """Return the line that turns the selected element by a step, forward or back."""
        return f"{header(self.element)}:TURN {way * self.step:g}"

    def moved(self, axis: str, way: int, reading: float) -> str:
        """Return the line that moves a carriage by a step: by its handwheel, or disengaged to a reading."""
        if self.free and axis != "Z":
            return f"DRIV:{axis} {reading + way * self.step:.4f}"
        return f"WHE:{axis} {way * self.step:g}"


def element_label(element: str) -> str:
    """Return an element in the notation of the field: by', kappa", bx, Phi."""
    if element == "common_phi":
        return "Phi"
    return element if element == "bx" else f"{element[:-1]}{SIDES[int(element[-1])]}"


def unit(variant: Variant, element: str) -> str:
    """Return mm or gon."""
    return variant.elements[element].unit
