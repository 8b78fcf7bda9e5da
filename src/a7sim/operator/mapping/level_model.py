"""Level model to scale for compilation: its orientation to the ground by all control (thesis 3.5)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, Array
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.mapping.stereo_view import StereoView
from a7sim.operator.procedures.levelling import Control, Levelling
from a7sim.reduction import AbsoluteOrientation, Ground, Model, Undetermined, absolute_orientation

Place = tuple[float, float, float]


@dataclass(frozen=True)
class LevelModel:
    """Level model to scale: its orientation to the ground, and the readings of its points."""

    absolute: AbsoluteOrientation
    points: Mapping[str, Place]
    scale_number: float
    """Scale number of the model as requested: 3750 for 1:3750."""
    tilt_gon: float
    """Remaining tilt."""
    units_per_mm: float
    rounds: int

    def on_ground(self, readings: Array) -> Array:
        """Return counter readings ``(3, ...)`` as positions on the ground ``(3, ...)`` in m."""
        places = (readings.reshape(3, -1).T / self._units).T
        return self.absolute.similarity.applied_to(places).reshape(readings.shape)

    def readings_of(self, ground: Array) -> Array:
        """Return the readings ``(3, ...)`` of positions on the ground ``(3, ...)`` in m."""
        places = self.absolute.similarity.inverted(ground.reshape(3, -1))
        return np.asarray((places.T * self._units).T.reshape(ground.shape))

    @property
    def _units(self) -> Array:
        return np.array([1.0, 1.0, self.units_per_mm])

    @property
    def metres_per_mm(self) -> float:
        """Metres on the ground per mm of the model as levelled."""
        return float(self.absolute.similarity.scale)


def level_model(
    workstation: Workstation,
    view: StereoView,
    points: Mapping[str, Place],
    control: Ground,
    scale_number: float,
    also: Sequence[str] = (),
) -> LevelModel:
    """Level a relatively oriented model and bring it to scale over a link; `points` are readings measured in it.

    The control in the model, and the points of `also`, are finally measured again. Gives up if the control does not
    determine the orientation.
    """
    operators, units = workstation.operators, workstation.controls.units_per_mm
    wanted = [name for name in points if name in control.points or name in also]
    rounds = 0
    shown = Control.of(control, [name for name in wanted if name in control.points])
    if shown.is_enough:
        levelling = Levelling(workstation, workstation.controls.model, shown)
        fit = levelling.compared(operators.active, levelling.measured(operators.active, 1))
        rounds = len(levelling.level(operators.active, fit, scale_number)[0]) - 1
        view.read_projectors()
        points = _measure_again(workstation, wanted)
    absolute = orient_to_ground(workstation, points, control, units)
    return LevelModel(absolute, points, scale_number, _tilt(absolute), units, rounds)


def _measure_again(workstation: Workstation, names: Sequence[str]) -> dict[str, Place]:
    readings = workstation.measure_points(workstation.operators.active, names)[:, :, 0].T
    return {
        name: (float(X), float(Y), float(Z))
        for name, (X, Y, Z) in zip(names, readings, strict=True)
        if not math.isnan(X)
    }


def orient_to_ground(
    workstation: Workstation, points: Mapping[str, Place], control: Ground, units: float
) -> AbsoluteOrientation:
    """Return the orientation to the ground of a model with measured control; gives up without control."""
    names = tuple(name for name in points if name in control.points)
    coordinates = np.array([points[name] for name in names]).reshape(-1, 3).T / np.array([[1.0], [1.0], [units]])
    try:
        return absolute_orientation(Model(workstation.controls.model.name, names, coordinates), control)
    except Undetermined as reason:
        workstation.operators.give_up(
            workstation.operators.active, f"{workstation.controls.model.name}: absolute orientation: {reason}"
        )
        raise


def _tilt(absolute: AbsoluteOrientation) -> float:
    """Return the inclination of the ground's plumb line in the model, gon."""
    x, y, _ = absolute.similarity.rotation[2]
    return math.hypot(x, y) / GON
