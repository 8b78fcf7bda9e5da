"""Hands of a crowd: on instruments held as arrays, numbers crossing as the command language would print them."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.instrument.autograph_batch import AutographBatch
from a7sim.operator.driver import BoolArray


class BatchDriver:
    """`Hands` on a fleet: numbers cross as the command language would print them."""

    def __init__(self, fleet: AutographBatch) -> None:
        self._fleet = fleet

    def variant(self) -> str:
        return self._fleet.variant.name

    def reset(self, who: Indices) -> None:
        self._fleet.reset(who)

    def set_height_gear(self, who: Indices, height_gear: str | float, plan_gear: str) -> None:
        self._fleet.set_height_gear(who, height_gear)

    def set_base_mode(self, who: Indices, mode: str) -> None:
        self._fleet.set_base_mode(who, mode)

    def set_fitting(self, who: Indices, name: str, position: str) -> None:
        self._fleet.set_fitting(who, name, position)

    def fitting(self, who: Indices, name: str) -> npt.NDArray[np.str_]:
        return self._fleet.fitting(who, name)

    def set_element(self, who: Indices, name: str, values: Array) -> None:
        self._fleet.set_element(who, name, values.round(2))

    def turn_element(self, who: Indices, name: str, amounts: Array) -> None:
        self._fleet.turn_element(who, name, amounts.round(5))

    def preset(self, who: Indices, readings: Mapping[str, float]) -> None:
        for axis, reading in readings.items():
            self._fleet.preset(who, axis, round(reading, 2))

    def preset_one(self, who: Indices, axis: str, readings: Array) -> None:
        for session, reading in zip(who, readings.tolist(), strict=True):
            self._fleet.preset(np.array([session]), axis, round(reading, 2))

    def load(self, who: Indices, projector: int, photograph: str) -> None:
        self._fleet.load(who, projector, photograph)

    def unload(self, who: Indices, projector: int) -> None:
        self._fleet.unload(who, projector)

    def loaded(self, who: Indices, projector: int) -> str:
        return self._fleet.loaded(projector)

    def fiducials(self, who: Indices, projector: int) -> tuple[list[str], Array]:
        names, displacements = self._fleet.carriers(projector).fiducial_displacements(who)
        return list(names), displacements.round(3)

    def centring(self, who: Indices, projector: int) -> Array:
        return self._fleet.carriers(projector).centring[:, who].round(3)

    def centre(self, who: Indices, projector: int, values: Array) -> None:
        self._fleet.carriers(projector).centre(who, values.round(3))

    def prints(self, who: Indices, projector: int) -> dict[str, Array]:
        sketch = self._fleet.carriers(projector).sketch(who)
        return {name: places.round(1) for name, places in sketch.items()}

    def elements(self, who: Indices, names: Sequence[str]) -> dict[str, Array]:
        return self._fleet.elements(who, names)

    def counters(self, who: Indices) -> Array:
        return self._fleet.counters(who)

    def counter(self, who: Indices, axis: str) -> Array:
        return self._fleet.counter(who, axis)

    def drive(self, who: Indices, readings: Mapping[str, Array]) -> BoolArray:
        went = [self._fleet.drive(who, axis, each.round(2)) for axis, each in readings.items()]
        return np.asarray(np.all(went, axis=0))

    def turn(self, who: Indices, wheels: Array, element: str | None = None, amounts: Array | None = None) -> None:
        self._fleet.turn_handwheels(who, wheels.round(4))
        if element is not None and amounts is not None:
            self.turn_element(who, element, amounts)

    def view_point(self, who: Indices, eye: int, point: str) -> Array:
        return self._fleet.eyepiece(who, eye, point).round(2)

    def view_point_stereo(self, who: Indices, point: str) -> Array:
        return self._fleet.both_eyepieces(who, point).round(2)

    def record(self, who: Indices, point: str) -> None:
        """Nobody keeps what a crowd registers."""

    def note(self, who: Indices, text: str) -> None:
        """Nobody keeps what a crowd notes."""

    def pop_errors(self, who: Indices) -> dict[int, list[str]]:
        return self._fleet.pop_errors(who)
