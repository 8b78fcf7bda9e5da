"""The hands of whoever sits there: what they hold, and the lines that a turn of it says. One key, one step."""

from dataclasses import dataclass, replace

from a7sim.link.headers import header
from a7sim.plotters import Variant

STEP_SIZES = (0.002, 0.01, 0.05, 0.1, 1.0, 10.0)
"""Steps; the first turns a drum between two counts, as the eye wants it."""

SIDELESS_ELEMENTS = ("bx", "common_phi")
"""Elements that belong to no side."""

SIDES = {1: "'", 2: '"'}
"""How the field writes the left and the right projector."""


@dataclass(frozen=True)
class ControlSelection:
    """What is in hand: an element, a side, a rung of the ladder; and whether X and Y are moved free of the wheels."""

    name: str = "by"
    side: int = 1
    step_index: int = STEP_SIZES.index(1.0)
    free: bool = False

    @property
    def step(self) -> float:
        """The present step, mm or gon or units of a counter."""
        return STEP_SIZES[self.step_index]

    @property
    def element(self) -> str:
        """The element in hand, such as by1 or bx."""
        return self.name if self.name in SIDELESS_ELEMENTS else f"{self.name}{self.side}"

    def valid_for(self, variant: Variant) -> "ControlSelection":
        """Return the hands at a plotter that may not have what they held."""
        return self if self.element in variant.elements else replace(self, name="kappa")

    def stepping(self, rungs: int) -> "ControlSelection":
        """Return the hands with a larger or smaller step."""
        return replace(self, step_index=min(max(self.step_index + rungs, 0), len(STEP_SIZES) - 1))

    def turned(self, way: int) -> str:
        """Return the line that turns the element in hand by a step, forward or back."""
        return f"{header(self.element)}:TURN {way * self.step:g}"

    def moved(self, axis: str, way: int, reading: float) -> str:
        """Return the line that moves a carriage by a step: by its handwheel, or free of it to a reading."""
        if self.free and axis != "Z":
            return f"DRIV:{axis} {reading + way * self.step:.4f}"
        return f"WHE:{axis} {way * self.step:g}"


def element_label(element: str) -> str:
    """Return an element as the field writes it: by', kappa", bx, Phi."""
    if element == "common_phi":
        return "Phi"
    return element if element == "bx" else f"{element[:-1]}{SIDES[int(element[-1])]}"


def unit(variant: Variant, element: str) -> str:
    """Return mm or gon."""
    return variant.elements[element].unit
