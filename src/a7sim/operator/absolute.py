"""Absolute orientation at the instrument: a model levelled and to scale, its heights indexed, read, set back."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.batch import Indices
from a7sim.geometry import Array, length_of
from a7sim.operator.controls import counter_value
from a7sim.operator.job import ModelJob
from a7sim.operator.levelling import MAX_ROUNDS, Control, Fit, Levelling, LevellingRound, Settings
from a7sim.operator.workstation import Workstation

TOLERATED_SHARE = 2e-4
"""Of the flying height, within which heights at control agree (the trade's 0.02 %)."""


@dataclass(frozen=True)
class GroundOrientation:
    """A model in the system of the ground, as a session left it."""

    scale_number: float
    height_gear: str
    rounds: Sequence[LevellingRound]
    before: Mapping[str, float]
    """Elements as the relative orientation had left them, and as they are set again in the end."""
    elements: Mapping[str, float]
    """Elements as they stood while the model was level and to scale."""
    heights: Mapping[str, float]
    """Read minus given at control, m."""
    distance: float
    """Read minus given between the two points that gave the scale, m."""
    tolerated: float
    """For heights at control, m."""
    points: Mapping[str, tuple[float, float, float]]
    """X and Y in mm at the model scale, Z in m."""

    @property
    def within_tolerance(self) -> bool:
        """Whether all heights at control agree."""
        return max(map(abs, self.heights.values())) <= self.tolerated


def absolute_orientation_at(
    bench: Workstation, model: ModelJob, control: Mapping[str, tuple[float, float, float]]
) -> dict[int, GroundOrientation]:
    """Level and scale a model, read it with heights in metres, and set the instruments back to how they stood.

    `control` is X, Y, Z in m, nan for what is not known of a point. What comes back is by session; those whose models
    do not show two points of control in plan and three in height remark so and do nothing.
    """
    found: dict[int, GroundOrientation] = {}
    crew = bench.crew
    for who, names in bench.group_by_points(crew.active, [*control]):
        known = Control(tuple(names), np.array([control[name] for name in names]).reshape(-1, 3).T)
        if not known.is_enough:
            crew.remark(who, f"{model.name}: too little control to level and scale it ({', '.join(names) or 'none'})")
            continue
        levelling = Levelling(bench, model, known)
        before = levelling.settings(who)
        start = np.zeros(crew.size)
        bench.seat.drive(who, {"Z": np.round(bench.seat.counters(who)[2])})
        start[who] = bench.seat.counters(who)[2]
        fit = levelling.compared(who, levelling.measured(who, 1))
        gears = np.array([_gear(bench, float(metres)) for metres in fit.metres])
        for gear in dict.fromkeys(gears.tolist()):
            same = crew.is_active(who) & (gears == gear)
            found |= _InMetres(levelling, gear).done(who[same], fit.of(same), before, start)
    return found


def _gear(bench: Workstation, metres: float) -> str:
    """Return the planned height gear, or that which counts metres at the scale nearest to the model as it stands."""
    planned, gears = bench.job.plan.height_gear, bench.seat.manual.height_gears
    if isinstance(planned, str):
        return planned
    return min(gears, key=lambda name: abs(math.log(gears[name].units_per_mm / metres)))


class _InMetres:
    """Sessions whose models are levelled to the same scale, that of the gear by which their counters read metres."""

    def __init__(self, levelling: Levelling, gear: str) -> None:
        self.levelling, self.bench, self.control = levelling, levelling.bench, levelling.control
        self.crew, self.seat = levelling.bench.crew, levelling.bench.seat
        self.gear = gear
        self.number = 1e3 * self.seat.manual.height_gears[gear].units_per_mm

    def done(self, who: Indices, fit: Fit, before: Settings, start: Array) -> dict[int, GroundOrientation]:
        """Level, read and set back to settings and readings of Z ``(sessions,)``."""
        self.seat.drive(who, {"Z": start[who]})
        self.seat.set_height_gear(who, self.gear)
        rounds = self.levelling.level(self.crew.remaining(who), fit.of(self.crew.is_active(who)), self.number)
        who = self.crew.remaining(who)
        shift = np.zeros(self.crew.size)
        shift[who] = self._index_set(who)
        readings = self._read(who)
        who = self.crew.remaining(who)
        found = self._concluded(who, rounds, before, self.levelling.settings(who), readings)
        self._set_back(who, before, start, shift)
        return found

    def _index_set(self, who: Indices) -> Array:
        """Make the Z counter read heights, on the mean of the control; return how much more it reads ``(m,)``."""
        names = [self.control.names[i] for i in self.control.with_height]
        self.bench.begin_round(who, MAX_ROUNDS + 1)
        readings = self.bench.measure_points(who, names)[2][:, who]
        more = np.mean(self.control.ground[2, self.control.with_height][:, None] - readings, axis=0)
        return self.seat.shift_counter(who, "Z", more)

    def _read(self, who: Indices) -> dict[str, Array]:
        """Measure control and all other points that are shown; X, Y in mm and Z in m ``(3, sessions)``."""
        self.bench.begin_round(who, MAX_ROUNDS + 2)
        wanted = dict.fromkeys([*self.control.names, *self.seat.model.other_points])
        names = [name for name in wanted if self.bench.has_point(who, name).all()]
        return dict(zip(names, np.moveaxis(self.bench.measure_points(who, names), 1, 0), strict=True))

    def _concluded(
        self,
        who: Indices,
        rounds: Mapping[int, Sequence[LevellingRound]],
        before: Settings,
        elements: Settings,
        readings: Settings,
    ) -> dict[int, GroundOrientation]:
        names, (first, last) = self.control.names, self.control.ends
        mm = 1.0 / self.seat.manual.scales["X"].units_per_mm
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
                TOLERATED_SHARE * 1e-3 * self.number * self.bench.job.plan.projection_height,
                {name: (float(p[0, s]), float(p[1, s]), float(p[2, s])) for name, p in readings.items()},
            )
            for s in who
        }

    def _set_back(self, who: Indices, before: Settings, start: Array, shift: Array) -> None:
        """Set elements, index and gear as they were before."""
        if who.size:
            self.seat.shift_counter(who, "Z", -shift[who])
            self.seat.drive(who, {"Z": start[who]})
            self.seat.set_height_gear(who, self.bench.job.plan.height_gear)
            self.seat.turn_if_changed(who, {name: values[who] for name, values in before.items()})
