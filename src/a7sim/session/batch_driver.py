"""Driver of a batch of instruments as arrays; numbers are rounded as the command language prints them."""

from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.instrument.autograph_batch import AutographBatch
from a7sim.operator.driving.driver import BoolArray


class BatchDriver:
    """`InstrumentDriver` of an `AutographBatch`; numbers are rounded as the command language prints them."""

    def __init__(self, batch: AutographBatch) -> None:
        self._batch = batch

    def variant(self) -> str:
        return self._batch.variant.name

    def reset(self, active: Indices) -> None:
        self._batch.reset(active)

    def set_height_gear(self, active: Indices, height_gear: str | float, plan_gear: str) -> None:
        self._batch.set_height_gear(active, height_gear)

    def set_base_mode(self, active: Indices, mode: str) -> None:
        self._batch.set_base_mode(active, mode)

    def set_fitting(self, active: Indices, name: str, position: str) -> None:
        self._batch.set_fitting(active, name, position)

    def fitting(self, active: Indices, name: str) -> npt.NDArray[np.str_]:
        return self._batch.fitting(active, name)

    def set_element(self, active: Indices, name: str, values: Array) -> None:
        self._batch.set_element(active, name, values.round(2))

    def turn_element(self, active: Indices, name: str, amounts: Array) -> None:
        self._batch.turn_element(active, name, amounts.round(5))

    def preset(self, active: Indices, readings: Mapping[str, float]) -> None:
        for axis, reading in readings.items():
            self._batch.preset(active, axis, round(reading, 2))

    def preset_one(self, active: Indices, axis: str, readings: Array) -> None:
        for session, reading in zip(active, readings.tolist(), strict=True):
            self._batch.preset(np.array([session]), axis, round(reading, 2))

    def load(self, active: Indices, projector: int, photograph: str) -> None:
        self._batch.load(active, projector, photograph)

    def unload(self, active: Indices, projector: int) -> None:
        self._batch.unload(active, projector)

    def loaded(self, active: Indices, projector: int) -> str:
        return self._batch.loaded(projector)

    def fiducials(self, active: Indices, projector: int) -> tuple[list[str], Array]:
        names, displacements = self._batch.carriers(projector).fiducial_displacements(active)
        return list(names), displacements.round(3)

    def centring(self, active: Indices, projector: int) -> Array:
        return self._batch.carriers(projector).centring[:, active].round(3)

    def centre(self, active: Indices, projector: int, values: Array) -> None:
        self._batch.carriers(projector).centre(active, values.round(3))

    def prints(self, active: Indices, projector: int) -> dict[str, Array]:
        sketch = self._batch.carriers(projector).sketch(active)
        return {name: places.round(1) for name, places in sketch.items()}

    def elements(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        return self._batch.elements(active, names)

    def counters(self, active: Indices) -> Array:
        return self._batch.counters(active)

    def counter(self, active: Indices, axis: str) -> Array:
        return self._batch.counter(active, axis)

    def drive(self, active: Indices, readings: Mapping[str, Array]) -> BoolArray:
        reached = [self._batch.drive(active, axis, reading.round(2)) for axis, reading in readings.items()]
        return np.asarray(np.all(reached, axis=0))

    def turn(self, active: Indices, wheels: Array, element: str | None = None, amounts: Array | None = None) -> None:
        self._batch.turn_handwheels(active, wheels.round(4))
        if element is not None and amounts is not None:
            self.turn_element(active, element, amounts)

    def view_point(self, active: Indices, eye: int, point: str) -> Array:
        return self._batch.eyepiece(active, eye, point).round(2)

    def view_point_stereo(self, active: Indices, point: str) -> Array:
        return self._batch.both_eyepieces(active, point).round(2)

    def record(self, active: Indices, point: str) -> None:
        """Do nothing: a batch has no recorder."""

    def note(self, active: Indices, text: str) -> None:
        """Do nothing: a batch has no journal."""

    def pop_errors(self, active: Indices) -> dict[int, list[str]]:
        return self._batch.pop_errors(active)
