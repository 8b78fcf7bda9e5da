"""What hands and eyes do at the instruments of a crew, one instrument a session."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array

BoolArray = npt.NDArray[np.bool_]


class InstrumentDriver(Protocol):
    """Handles, counters and eyepieces. `who` are the m sessions that act; their axis comes last.

    What an instrument cannot do it does not do, and says so when asked by `refused`.
    """

    def variant(self) -> str:
        """Return the type of the instruments."""

    def reset(self, active: Indices) -> None:
        """Run all elements to their zeros, base inside, fittings for a positive, presets off."""

    def set_height_gear(self, active: Indices, height_gear: str | float, plan_gear: str) -> None:
        """Engage the gears."""

    def set_base_mode(self, active: Indices, mode: str) -> None:
        """Set base inside or outside."""

    def set_fitting(self, active: Indices, name: str, position: str) -> None:
        """Put a fitting into a position."""

    def fitting(self, active: Indices, name: str) -> npt.NDArray[np.str_]:
        """Return the positions ``(m,)`` in which a fitting stands."""

    def set_element(self, active: Indices, name: str, values: Array) -> None:
        """Set an element through its counter to values ``(m,)``, gon or mm, two decimals."""

    def turn_element(self, active: Indices, name: str, amounts: Array) -> None:
        """Turn the drum of an element by amounts ``(m,)``, gon or mm, five decimals."""

    def preset(self, active: Indices, readings: Mapping[str, float]) -> None:
        """Make counters show these readings, by axis."""

    def preset_one(self, active: Indices, axis: str, readings: Array) -> None:
        """Make one counter show readings ``(m,)``."""

    def load(self, active: Indices, projector: int, photograph: str) -> None:
        """Put a photograph into a projector."""

    def unload(self, active: Indices, projector: int) -> None:
        """Take the photograph out of a projector."""

    def loaded(self, active: Indices, projector: int) -> str:
        """Return the name of the photograph in a projector, empty for none."""

    def fiducials(self, active: Indices, projector: int) -> tuple[list[str], Array]:
        """Return names of n fiducials and their displacements ``(2, n, m)`` from the collimating marks, mm."""

    def centring(self, active: Indices, projector: int) -> Array:
        """Return how pictures were shifted and turned on their carrier ``(3, m)``, mm and gon."""

    def centre(self, active: Indices, projector: int, values: Array) -> None:
        """Shift and turn pictures on their carrier ``(3, m)``, three decimals."""

    def prints(self, active: Indices, projector: int) -> dict[str, Array]:
        """Return the places ``(2, m)`` mm of points on the paper prints, nan where a print has it not."""

    def elements(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        """Return what the counters of elements show ``(m,)``."""

    def counters(self, active: Indices) -> Array:
        """Return what the X, Y and Z counters show ``(3, m)``."""

    def counter(self, active: Indices, axis: str) -> Array:
        """Return what one of them shows ``(m,)``."""

    def drive(self, active: Indices, readings: Mapping[str, Array]) -> BoolArray:
        """Run carriages to readings ``(m,)`` by axis, two decimals; return which went ``(m,)``."""

    def turn(self, active: Indices, wheels: Array, element: str | None = None, amounts: Array | None = None) -> None:
        """Turn the handwheels of X, Y and perhaps Z by ``(2 or 3, m)``, four decimals, and with them an element.

        The drum of the element is turned by amounts ``(m,)``, five decimals.
        """

    def view_point(self, active: Indices, eye: int, point: str) -> Array:
        """Return where an eye sees a point from the mark ``(2, m)``, um at photo scale, nan where it does not."""

    def view_point_stereo(self, active: Indices, point: str) -> Array:
        """Return the same for the left and the right eye together ``(4, m)``."""

    def record(self, active: Indices, point: str) -> None:
        """Register the counters under a point."""

    def note(self, active: Indices, text: str) -> None:
        """Write a note into the journals of the instruments."""

    def pop_errors(self, active: Indices) -> dict[int, list[str]]:
        """Return what was refused since the last asking, by session."""
