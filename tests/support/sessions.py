"""Scenarios, exact orientations and tampered links for tests of sessions."""

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from a7sim.geometry import GON, angles_of, mxm, mxv, rotation
from a7sim.scenario import Observer, Scenario, load_scenario
from a7sim.scenario.schema import FilmDeformation
from a7sim.session import Session, open_session

Exchanges = Sequence[tuple[str, str]]
"""Pairs of words: the first is replaced by the second."""


def tilted_flight(tilts: Sequence[tuple[float, float, float]], **overrides: str) -> Scenario:
    """Return a scenario with Akwanga's camera, ground and plan, three stations 672 m apart and no errors.

    `tilts` are omega, phi and swing off the flight line in gon, for each of the three photographs.
    """
    scenario = load_scenario("akwanga", {"plan.half_width": "80.0", "plan.bx": "180.0", **overrides})
    photos = [
        msgspec.structs.replace(
            photo, position=(440680.0 - 672.0 * i, 985000.0, 1680.5 + 3.0 * i), omega=w, phi=f, kappa=200.0 + k
        )
        for i, (photo, (w, f, k)) in enumerate(zip(scenario.photos, tilts, strict=True))
    ]
    return without_errors(msgspec.structs.replace(scenario, photos=photos))


def without_errors(scenario: Scenario) -> Scenario:
    """Return a scenario with faultless film and operator and single readings; counters are still read to 0.01."""
    return read_once(msgspec.structs.replace(scenario, film=FilmDeformation(), observer=Observer.faultless()))


def read_once(scenario: Scenario) -> Scenario:
    """Return a scenario with one reading of each parallax."""
    return msgspec.structs.replace(scenario, plotting=msgspec.structs.replace(scenario.plan, parallax_readings=1))


def element_errors(model: dict[str, Any]) -> dict[str, float]:
    """Return the errors of the elements of a model in results.json, gon.

    The exact solution holds the elements that the method does not turn: it consists of the angles at which the true
    relative rotation and base agree with the base components as they are set.
    """
    elements, truth = model["relative_orientation"]["elements"], model["truth"]
    left, right = (1, 2) if model["base"] == "inside" else (2, 1)
    relative, base = np.array(truth["relative_rotation"]), np.array(truth["base_direction"])
    if model["relative_orientation"]["method"] == "dependent":
        turned_left = rotation(*(_angle(elements, name, left) for name in ("omega", "phi", "kappa")))
        exact = {right: mxm(turned_left, relative)}
    else:
        set_base = np.array(
            [
                elements["bx"],
                elements[f"by{left}"] - elements[f"by{right}"],
                elements[f"bz{right}"] - elements[f"bz{left}"],
            ]
        )

        def misfit(angles: npt.NDArray[np.float64]) -> list[float]:
            turned_left = rotation(*angles)
            of_right = turned_left if right == 1 else mxm(turned_left, relative)
            of_two = turned_left if left == 2 else of_right
            off = np.cross(mxv(turned_left, base), set_base / np.linalg.norm(set_base))
            return [*off, float(angles_of(of_two)[0]) - _angle(elements, "omega", 2)]

        turned_left = rotation(*least_squares(misfit, np.zeros(3), xtol=1e-15, ftol=1e-15, gtol=1e-15).x)
        exact = {left: turned_left, right: mxm(turned_left, relative)}
    errors = {}
    for projector, turned in exact.items():
        for name, angle in zip(("omega", "phi", "kappa"), angles_of(turned), strict=True):
            difference = (_angle(elements, name, projector) - float(angle)) / GON
            errors[f"{name}{projector}"] = (difference + 200.0) % 400.0 - 200.0
    return errors


def _angle(elements: dict[str, float], name: str, projector: int) -> float:
    zero = 0.0 if name == "kappa" else 100.0
    return (elements[f"{name}{projector}"] - zero) * GON


class TamperedPort:
    """A port that replaces words of the lines to the instrument."""

    def __init__(self, port: Any, exchanges: Exchanges) -> None:
        self._port = port
        self._exchanges = exchanges

    def write(self, data: bytes) -> Any:
        """Write bytes, with words replaced."""
        text = data.decode("ascii")
        for old, new in self._exchanges:
            text = text.replace(old, new)
        return self._port.write(text.encode("ascii"))

    def readline(self, size: int | None = -1, /) -> bytes:
        """Read a reply line."""
        line: bytes = self._port.readline(size)
        return line


def tampered_session(scenario: Scenario, exchanges: Exchanges, seed: int = 1) -> Session:
    """Return a session in which words of the operator's lines are replaced."""
    session = open_session(scenario, seed)
    session.person.client = type(session.person.client)(TamperedPort(session.person.client._port, exchanges))
    return session
