"""Driver of one instrument by lines of text over the link."""

import math
from collections.abc import Mapping, Sequence

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.link.headers import FITTING_NODES, header, short_form
from a7sim.operator.driving.driver import BoolArray
from a7sim.operator.people.person import Person
from a7sim.plotters import NOT_VISIBLE, POSITIONS_OF

_NOT_VISIBLE = float(NOT_VISIBLE)


class ScpiDriver:
    """`InstrumentDriver` of one operator, by lines of text over the link."""

    def __init__(self, person: Person) -> None:
        self._person = person

    def _send(self, line: str) -> None:
        self._person.client.send(line)

    def _numbers(self, line: str) -> list[float]:
        return self._person.client.numbers(line)

    def variant(self) -> str:
        return self._person.client.ask("*IDN?").split(",")[1]

    def reset(self, active: Indices) -> None:
        self._send("*RST")

    def set_height_gear(self, active: Indices, height_gear: str | float, plan_gear: str) -> None:
        self._send(f'GEAR:HEIG "{height_gear}"' if isinstance(height_gear, str) else f"GEAR:HEIG {height_gear}")
        self._send(f'GEAR:PLAN "{plan_gear}"')

    def set_base_mode(self, active: Indices, mode: str) -> None:
        self._send(f"BASE:MODE {short_form(mode)}")

    def set_fitting(self, active: Indices, name: str, position: str) -> None:
        self._send(f"FITT:{FITTING_NODES[name]} {short_form(position)}")

    def fitting(self, active: Indices, name: str) -> npt.NDArray[np.str_]:
        reply = self._person.client.ask(f"FITT:{FITTING_NODES[name]}?")
        return np.array([position for position in POSITIONS_OF[name] if short_form(position) == reply])

    def set_element(self, active: Indices, name: str, values: Array) -> None:
        self._send(f"{header(name)} {values[0]:.2f}")

    def turn_element(self, active: Indices, name: str, amounts: Array) -> None:
        self._send(f"{header(name)}:TURN {amounts[0]:.5f}")

    def preset(self, active: Indices, readings: Mapping[str, float]) -> None:
        self._send(";:".join(f"COUN:{axis}:PRES {reading:.2f}" for axis, reading in readings.items()))

    def preset_one(self, active: Indices, axis: str, readings: Array) -> None:
        self._send(f"COUN:{axis}:PRES {readings[0]:.2f}")

    def load(self, active: Indices, projector: int, photograph: str) -> None:
        self._send(f'PHOT{projector}:LOAD "{photograph}"')

    def unload(self, active: Indices, projector: int) -> None:
        self._send(f"PHOT{projector}:UNL")

    def loaded(self, active: Indices, projector: int) -> str:
        return self._person.client.fields(f"PHOT{projector}?")[0]

    def fiducials(self, active: Indices, projector: int) -> tuple[list[str], Array]:
        fields = self._person.client.fields(f"PHOT{projector}:FID?")
        return fields[0::3], np.array([fields[1::3], fields[2::3]], dtype=float)[:, :, None]

    def centring(self, active: Indices, projector: int) -> Array:
        return np.array(self._numbers(f"PHOT{projector}:CENT?"))[:, None]

    def centre(self, active: Indices, projector: int, values: Array) -> None:
        self._send("PHOT{}:CENT {:.3f},{:.3f},{:.3f}".format(projector, *values[:, 0]))

    def prints(self, active: Indices, projector: int) -> dict[str, Array]:
        fields = self._person.client.fields(f"PHOT{projector}:SKET?")
        places = np.array([fields[1::3], fields[2::3]], dtype=float).T[:, :, None]
        return dict(zip(fields[0::3], places, strict=False))

    def elements(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        replies = np.array(self._numbers(";:".join(f"{header(name)}?" for name in names)))[:, None]
        return dict(zip(names, replies, strict=True))

    def counters(self, active: Indices) -> Array:
        return np.array(self._numbers("COUN?"))[:, None]

    def counter(self, active: Indices, axis: str) -> Array:
        return np.array(self._numbers(f"COUN:{axis}?"))

    def drive(self, active: Indices, readings: Mapping[str, Array]) -> BoolArray:
        line = ";".join(f"{axis} {reading[0]:.2f}" for axis, reading in readings.items())
        before, after = self._numbers(f"SYST:ERR:COUN?;:DRIV:{line};:SYST:ERR:COUN?")
        return np.array([before == after])

    def turn(self, active: Indices, wheels: Array, element: str | None = None, amounts: Array | None = None) -> None:
        turned = ";".join(f"{axis} {amount:.4f}" for axis, amount in zip("XYZ", wheels[:, 0].tolist(), strict=False))
        line = f"WHE:{turned}"
        if element is not None and amounts is not None:
            line += f";:{header(element)}:TURN {amounts[0]:.5f}"
        self._send(line)

    def view_point(self, active: Indices, eye: int, point: str) -> Array:
        return self._view(f'EYEP{eye}? "{point}"')

    def view_point_stereo(self, active: Indices, point: str) -> Array:
        return self._view(f'EYEP1? "{point}";:EYEP2? "{point}"')

    def _view(self, query: str) -> Array:
        return np.array([[math.nan if value == _NOT_VISIBLE else value] for value in self._numbers(query)])

    def record(self, active: Indices, point: str) -> None:
        self._send(f'REC "{point}"')

    def note(self, active: Indices, text: str) -> None:
        self._person.note(text)

    def pop_errors(self, active: Indices) -> dict[int, list[str]]:
        errors = self._person.client.errors()
        return {0: errors} if errors else {}
