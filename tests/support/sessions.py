"""Sessions for tests: scenarios changed in what a test is about, orientations solved exactly, lines tampered with."""

import msgspec
import numpy as np
from scipy.optimize import least_squares

from a7sim.geometry import GON, angles_of, mxm, mxv, rotation
from a7sim.scenario import Observer, load_scenario
from a7sim.scenario.schema import FilmDeformation
from a7sim.session import open_session


def tilted_flight(tilts, **overrides):
    """Akwanga's camera, ground and plan over three stations 672 m apart, all errors zero, tilted as asked.

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


def without_errors(scenario):
    """Return a scenario with film and operator faultless, who need not read twice; counters are still read to 0.01."""
    return read_once(msgspec.structs.replace(scenario, film=FilmDeformation(), observer=Observer.faultless()))


def read_once(scenario):
    """Return a scenario whose operator reads every parallax once: for tests of what more readings do not change."""
    return msgspec.structs.replace(scenario, plotting=msgspec.structs.replace(scenario.plan, parallax_readings=1))


def element_errors(model):
    """How far the elements of a model's results lie from the exact solution, gon.

    Exact given the elements that the method does not turn: the angles at which the true relative rotation and
    base hold with the base components as they are set.
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

        def misfit(angles):
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


def _angle(elements, name, projector):
    zero = 0.0 if name == "kappa" else 100.0
    return (elements[f"{name}{projector}"] - zero) * GON


class TamperedPort:
    """A line on which somebody exchanges words on the way to the instrument."""

    def __init__(self, port, exchanges):
        self._port = port
        self._exchanges = exchanges

    def write(self, data):
        text = data.decode("ascii")
        for said, heard in self._exchanges:
            text = text.replace(said, heard)
        return self._port.write(text.encode("ascii"))

    def readline(self, size=-1):
        return self._port.readline(size)


def tampered_session(scenario, exchanges, seed=1):
    """A session whose operator's words are changed on the line."""
    session = open_session(scenario, seed)
    session.person.client = type(session.person.client)(TamperedPort(session.person.client._port, exchanges))
    return session
