"""Driver protocol: the actions and readings at the instruments of a batch of sessions, one instrument per session."""

from collections.abc import Mapping, Sequence
from typing import Protocol

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array

BoolArray = npt.NDArray[np.bool_]


class InstrumentDriver(Protocol):
    """Elements, counters and eyepieces of instruments. `active` are the m active sessions; their axis is the last one.

    An instrument that rejects a command does nothing; `pop_errors` returns the errors.
    """

    def variant(self) -> str:
        """Return the type of the instruments."""

    def reset(self, active: Indices) -> None:
        """Move all elements to their zeros, base inside, fittings for a positive, presets off."""

    def set_height_gear(self, active: Indices, height_gear: str | float, plan_gear: str) -> None:
        """Engage the gears."""

    def set_base_mode(self, active: Indices, mode: str) -> None:
        """Set base inside or outside."""

    def set_fitting(self, active: Indices, name: str, position: str) -> None:
        """Set a fitting to a position."""

    def fitting(self, active: Indices, name: str) -> npt.NDArray[np.str_]:
        """Return the positions ``(m,)`` of a fitting."""

    def set_element(self, active: Indices, name: str, values: Array) -> None:
        """Set an element by its counter to values ``(m,)``, gon or mm, two decimals."""

    def turn_element(self, active: Indices, name: str, amounts: Array) -> None:
        """Turn the drum of an element by amounts ``(m,)``, gon or mm, five decimals."""

    def preset(self, active: Indices, readings: Mapping[str, float]) -> None:
        """Preset counters to these readings, by axis."""

    def preset_one(self, active: Indices, axis: str, readings: Array) -> None:
        """Preset one counter to readings ``(m,)``."""

    def load(self, active: Indices, projector: int, photograph: str) -> None:
        """Mount a photograph in a projector."""

    def unload(self, active: Indices, projector: int) -> None:
        """Remove the photograph from a projector."""

    def loaded(self, active: Indices, projector: int) -> str:
        """Return the name of the photograph in a projector, empty for none."""

    def fiducials(self, active: Indices, projector: int) -> tuple[list[str], Array]:
        """Return names of n fiducials and their displacements ``(2, n, m)`` from the collimating marks, mm."""

    def centring(self, active: Indices, projector: int) -> Array:
        """Return shift and rotation of the pictures on their carrier ``(3, m)``, mm and gon."""

    def centre(self, active: Indices, projector: int, values: Array) -> None:
        """Shift and rotate pictures on their carrier ``(3, m)``, three decimals."""

    def prints(self, active: Indices, projector: int) -> dict[str, Array]:
        """Return the positions ``(2, m)`` in mm of points on the paper prints, nan where a print does not show them."""

    def elements(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        """Return the counter readings of elements ``(m,)``."""

    def counters(self, active: Indices) -> Array:
        """Return the readings of the X, Y and Z counters ``(3, m)``."""

    def counter(self, active: Indices, axis: str) -> Array:
        """Return the readings of one counter ``(m,)``."""

    def drive(self, active: Indices, readings: Mapping[str, Array]) -> BoolArray:
        """Drive carriages to readings ``(m,)`` by axis, two decimals; return which reached them ``(m,)``."""

    def turn(self, active: Indices, wheels: Array, element: str | None = None, amounts: Array | None = None) -> None:
        """Turn the handwheels of X, Y and optionally Z by ``(2 or 3, m)``, four decimals, and an element with them.

        The drum of the element turns by amounts ``(m,)``, five decimals.
        """

    def view_point(self, active: Indices, eye: int, point: str) -> Array:
        """Return the position of a point relative to the mark in one eyepiece ``(2, m)``, um at photo scale, nan if not
        visible.
        """

    def view_point_stereo(self, active: Indices, point: str) -> Array:
        """Return the same for the left and the right eyepiece together ``(4, m)``."""

    def record(self, active: Indices, point: str) -> None:
        """Register the counters under a point."""

    def note(self, active: Indices, text: str) -> None:
        """Write a note into the journals of the instruments."""

    def pop_errors(self, active: Indices) -> dict[int, list[str]]:
        """Return the errors since the last call, by session."""
