"""Absolute orientation at the instrument: a model is levelled and scaled, its heights indexed and read, then reset."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.batch import Indices
from a7sim.geometry import Array, length_of
from a7sim.operator.driving.controls import counter_value
from a7sim.operator.driving.job import ModelJob
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.procedures.levelling import MAX_ROUNDS, Control, Fit, Levelling, LevellingRound, Settings

TOLERATED_SHARE = 2e-4
"""Tolerance of heights at control as a share of the flying height (the trade's 0.02 %)."""


@dataclass(frozen=True)
class GroundOrientation:
    """Model in the system of the ground, as the result of a session."""

    scale_number: float
    height_gear: str
    rounds: Sequence[LevellingRound]
    before: Mapping[str, float]
    """Elements after the relative orientation, and again at the end."""
    elements: Mapping[str, float]
    """Elements while the model was level and to scale."""
    heights: Mapping[str, float]
    """Read minus given at control, m."""
    distance: float
    """Read minus given distance of the two points that define the scale, m."""
    tolerated: float
    """Tolerance of heights at control, m."""
    points: Mapping[str, tuple[float, float, float]]
    """X and Y in mm at the model scale, Z in m."""

    @property
    def within_tolerance(self) -> bool:
        """Whether all heights at control are within tolerance."""
        return max(map(abs, self.heights.values())) <= self.tolerated


def absolute_orientation_at(
    workstation: Workstation, model: ModelJob, control: Mapping[str, tuple[float, float, float]]
) -> dict[int, GroundOrientation]:
    """Level and scale a model, read it with heights in metres, and reset the instruments to their previous state.

    `control` is X, Y, Z in m, nan for unknown coordinates. The result is by session; sessions whose models do not show
    two control points in plan and three in height write a remark and do nothing.
    """
    found: dict[int, GroundOrientation] = {}
    operators = workstation.operators
    for active, names in workstation.group_by_points(operators.active, [*control]):
        known = Control(tuple(names), np.array([control[name] for name in names]).reshape(-1, 3).T)
        if not known.is_enough:
            operators.remark(
                active, f"{model.name}: too little control to level and scale it ({', '.join(names) or 'none'})"
            )
            continue
        levelling = Levelling(workstation, model, known)
        before = levelling.settings(active)
        start = np.zeros(operators.size)
        workstation.controls.drive(active, {"Z": np.round(workstation.controls.counters(active)[2])})
        start[active] = workstation.controls.counters(active)[2]
        fit = levelling.compared(active, levelling.measured(active, 1))
        gears = np.array([_gear(workstation, float(metres)) for metres in fit.metres])
        for gear in dict.fromkeys(gears.tolist()):
            same = operators.is_active(active) & (gears == gear)
            found |= _GearLevelling(levelling, gear).run(active[same], fit.of(same), before, start)
    return found


def _gear(workstation: Workstation, metres: float) -> str:
    """Return the planned height gear, or the gear that counts metres at the scale nearest to that of the model."""
    planned, gears = workstation.job.plan.height_gear, workstation.controls.manual.height_gears
    if isinstance(planned, str):
        return planned
    return min(gears, key=lambda name: abs(math.log(gears[name].units_per_mm / metres)))


class _GearLevelling:
    """Levelling of models to the scale of a height gear, by which their counters read metres."""

    def __init__(self, levelling: Levelling, gear: str) -> None:
        self.levelling, self.workstation, self.control = levelling, levelling.workstation, levelling.control
        self.operators, self.controls = levelling.workstation.operators, levelling.workstation.controls
        self.gear = gear
        self.number = 1e3 * self.controls.manual.height_gears[gear].units_per_mm

    def run(self, active: Indices, fit: Fit, before: Settings, start: Array) -> dict[int, GroundOrientation]:
        """Level, read and reset to settings and readings of Z ``(sessions,)``."""
        self.controls.drive(active, {"Z": start[active]})
        self.controls.set_height_gear(active, self.gear)
        rounds = self.levelling.level(
            self.operators.remaining(active), fit.of(self.operators.is_active(active)), self.number
        )
        active = self.operators.remaining(active)
        shift = np.zeros(self.operators.size)
        shift[active] = self._set_index(active)
        readings = self._measure_points(active)
        active = self.operators.remaining(active)
        found = self._collect_results(active, rounds, before, self.levelling.settings(active), readings)
        self._reset(active, before, start, shift)
        return found

    def _set_index(self, active: Indices) -> Array:
        """Index the Z counter to heights, on the mean of the control; return the change of its reading ``(m,)``."""
        names = [self.control.names[i] for i in self.control.with_height]
        self.workstation.begin_round(active, MAX_ROUNDS + 1)
        readings = self.workstation.measure_points(active, names)[2][:, active]
        more = np.mean(self.control.ground[2, self.control.with_height][:, None] - readings, axis=0)
        return self.controls.shift_counter(active, "Z", more)

    def _measure_points(self, active: Indices) -> dict[str, Array]:
        """Measure control and all other visible points; X, Y in mm and Z in m ``(3, sessions)``."""
        self.workstation.begin_round(active, MAX_ROUNDS + 2)
        wanted = dict.fromkeys([*self.control.names, *self.controls.model.other_points])
        names = [name for name in wanted if self.workstation.has_point(active, name).all()]
        return dict(zip(names, np.moveaxis(self.workstation.measure_points(active, names), 1, 0), strict=True))

    def _collect_results(
        self,
        active: Indices,
        rounds: Mapping[int, Sequence[LevellingRound]],
        before: Settings,
        elements: Settings,
        readings: Settings,
    ) -> dict[int, GroundOrientation]:
        names, (first, last) = self.control.names, self.control.ends
        mm = 1.0 / self.controls.manual.scales["X"].units_per_mm
        read = 1e-3 * self.number * mm * length_of((readings[names[last]] - readings[names[first]])[:2])
        distance = read - length_of(self.control.between(first, last)[:2])
        return {
            int(s): GroundOrientation(
                self.number,
                self.gear,
                rounds[int(s)],
                {name: float(counter_value(name, each[s])) for name, each in before.items()},
                {name: float(counter_value(name, each[s])) for name, each in elements.items()},
                {
                    names[i]: float(readings[names[i]][2, s] - self.control.ground[2, i])
                    for i in self.control.with_height
                },
                float(distance[s]),
                TOLERATED_SHARE * 1e-3 * self.number * self.workstation.job.plan.projection_height,
                {name: (float(p[0, s]), float(p[1, s]), float(p[2, s])) for name, p in readings.items()},
            )
            for s in active
        }

    def _reset(self, active: Indices, before: Settings, start: Array, shift: Array) -> None:
        """Reset elements, index and gear."""
        if active.size:
            self.controls.shift_counter(active, "Z", -shift[active])
            self.controls.drive(active, {"Z": start[active]})
            self.controls.set_height_gear(active, self.workstation.job.plan.height_gear)
            self.controls.turn_if_changed(active, {name: values[active] for name, values in before.items()})
