"""A model levelled and brought to scale at the instrument, by computed changes of its elements (thesis 3.5).

The control measured in the model gives a similarity to the ground. Both cameras and the base are turned together until
the ground's plumb line is the instrument's, and the base is stretched to the model scale; relative orientation stays.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, Array
from a7sim.operator.absolute import turned_upright
from a7sim.operator.bench import Bench
from a7sim.operator.stereo_view import StereoView
from a7sim.reduction import AbsoluteOrientation, Ground, Model, Undetermined, absolute_orientation

MOST_ROUNDS = 3

LEVEL_GON, TO_SCALE = 0.02, 2e-4
"""A model is level, and to scale, when what is left is less: two counts of an element, 1 in 5000."""

Place = tuple[float, float, float]


@dataclass(frozen=True)
class LevelModel:
    """A level model to scale: its orientation to the ground, and what was measured in it by point, in readings."""

    absolute: AbsoluteOrientation
    points: Mapping[str, Place]
    scale_number: float
    """Of the model as ordered: 3750 for 1:3750."""
    tilt_gon: float
    """What is left of its tilt."""
    units_per_mm: float
    rounds: int

    def on_ground(self, readings: Array) -> Array:
        """Return readings ``(3, ...)`` of the counters as places on the ground ``(3, ...)`` in m."""
        places = (readings.reshape(3, -1).T / self._units).T
        return self.absolute.similarity.applied_to(places).reshape(readings.shape)

    def readings_of(self, ground: Array) -> Array:
        """Return the readings ``(3, ...)`` at which places on the ground ``(3, ...)`` in m stand in the model."""
        places = self.absolute.similarity.inverted(ground.reshape(3, -1))
        return np.asarray((places.T * self._units).T.reshape(ground.shape))

    @property
    def _units(self) -> Array:
        return np.array([1.0, 1.0, self.units_per_mm])

    @property
    def metres_per_mm(self) -> float:
        """Of the ground, a mm of the model as it came out."""
        return float(self.absolute.similarity.scale)


def levelled(
    bench: Bench,
    view: StereoView,
    points: Mapping[str, Place],
    control: Ground,
    scale_number: float,
    also: Sequence[str] = (),
) -> LevelModel:
    """Level a relatively oriented model of one person and bring it to scale; `points` are readings measured in it.

    The control in the model, and the points of `also`, are measured anew after every round. Gives up where the control
    does not determine the orientation.
    """
    who = bench.crew.everybody
    units = bench.seat.units_per_mm
    wanted = [name for name in points if name in control.points or name in also]
    for number in range(1, MOST_ROUNDS + 2):
        absolute = oriented(bench, points, control, units)
        found = LevelModel(absolute, points, scale_number, _tilt(absolute), units, number - 1)
        to_scale = abs(found.metres_per_mm * 1e3 / scale_number - 1.0) < TO_SCALE
        if (found.tilt_gon < LEVEL_GON and to_scale) or number > MOST_ROUNDS:
            return found
        bench.begin_round(who, number)
        bench.compute(who)
        bench.seat.set_changed(who, _settings(bench, absolute, scale_number))
        view.learn()
        points = _measured(bench, wanted)
    raise AssertionError


def _measured(bench: Bench, names: Sequence[str]) -> dict[str, Place]:
    readings = bench.measure(bench.crew.everybody, names)[:, :, 0].T
    return {
        name: (float(X), float(Y), float(Z))
        for name, (X, Y, Z) in zip(names, readings, strict=True)
        if not math.isnan(X)
    }


def oriented(bench: Bench, points: Mapping[str, Place], control: Ground, units: float) -> AbsoluteOrientation:
    """Return the orientation to the ground of a model in which the control was measured, gives up where it has none."""
    names = tuple(name for name in points if name in control.points)
    coordinates = np.array([points[name] for name in names]).reshape(-1, 3).T / np.array([[1.0], [1.0], [units]])
    try:
        return absolute_orientation(Model(bench.seat.model.name, names, coordinates), control)
    except Undetermined as reason:
        bench.crew.give_up(bench.crew.everybody, f"{bench.seat.model.name}: absolute orientation: {reason}")
        raise


def _tilt(absolute: AbsoluteOrientation) -> float:
    x, y, _ = _plumb(absolute)
    return math.hypot(x, y) / GON


def _plumb(absolute: AbsoluteOrientation) -> Array:
    """Return the ground's upward plumb line ``(3,)`` in the model."""
    return np.asarray(absolute.similarity.rotation[2])


def _settings(bench: Bench, absolute: AbsoluteOrientation, scale_number: float) -> dict[str, Array]:
    """Return what the elements must show for the model to be level and to scale."""
    seat = bench.seat
    names = [name for name in seat.manual.elements if name not in ("c1", "c2")]
    larger = float(absolute.similarity.scale) * 1e3 / scale_number
    settings = seat.elements(bench.crew.everybody, names)
    return turned_upright(settings, seat.model, seat.manual, _plumb(absolute)[:, None], np.array([larger]))
