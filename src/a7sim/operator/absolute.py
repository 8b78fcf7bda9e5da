"""Absolute orientation at the instrument: scale by the base, levelling by the tilts, heights by the index of Z.

Both projectors and the base are turned together, so that the relative orientation stays: on a plotter with bz by
omega, phi, bz and bx of both, to second order also by kappa and by; on one with a common Phi by that, by equal changes
of omega, and by the base. The elements that the manual lists decide which.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from a7sim.geometry import GON, Array, angles_of, length_of, mxm, mxv, rotation
from a7sim.manual import LEAST_COUNT, Variant
from a7sim.operator.bench import Bench
from a7sim.operator.crew import Who
from a7sim.operator.hands import Truths
from a7sim.operator.job import ModelJob
from a7sim.reduction import Undetermined, adjusted

TOLERATED_SHARE = 2e-4
"""Of the flying height, within which heights at control agree (the trade's 0.02 %)."""

MOST_ROUNDS = 6
STILL_FALLING = 0.8
FEWEST_PLAN, FEWEST_HEIGHTS = 2, 3

Settings = Mapping[str, Array]


@dataclass(frozen=True)
class LevellingRound:
    """A round of a session: what was read at control, and how far model and ground were apart."""

    height_rms: float
    """Of the heights about their mean, m."""
    scale: float
    """By what factor the model was too small."""
    tilts: tuple[float, float]
    """How the plumb line leans in the model, along the base and across it, gon."""


@dataclass(frozen=True)
class OnGround:
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
    def agrees(self) -> bool:
        """Whether all heights at control agree."""
        return max(map(abs, self.heights.values())) <= self.tolerated


@dataclass(frozen=True)
class Control:
    """Control that a model shows: names, ground ``(3, n)`` in m with nan for what is not known."""

    names: tuple[str, ...]
    ground: Array

    @property
    def with_height(self) -> list[int]:
        """Which have a height."""
        return np.flatnonzero(np.isfinite(self.ground[2])).tolist()

    @property
    def in_plan(self) -> list[int]:
        """Which have plan coordinates."""
        return np.flatnonzero(np.isfinite(self.ground[:2]).all(axis=0)).tolist()

    @property
    def is_enough(self) -> bool:
        """Whether there is enough for scale and levelling."""
        return len(self.in_plan) >= FEWEST_PLAN and len(self.with_height) >= FEWEST_HEIGHTS

    @property
    def ends(self) -> tuple[int, int]:
        """The two points furthest apart in plan."""
        return max(combinations(self.in_plan, 2), key=lambda pair: float(length_of(self.between(*pair)[:2])))

    def between(self, first: int, last: int) -> Array:
        """Return the vector ``(3,)`` from one point to another, m."""
        return np.asarray(self.ground[:, last] - self.ground[:, first])


@dataclass(frozen=True)
class _Fit:
    """How models of m sessions stand to the ground."""

    up: Array
    """The direction in the frame that points upward on the ground ``(3, m)``."""
    factor: Array
    """From the model to the scale that is wanted ``(m,)``."""
    rms: Array
    """Of heights, model minus ground about their mean ``(m,)``, m."""

    @property
    def tilts(self) -> Array:
        return np.asarray(np.arctan2(self.up[:2], self.up[2]) / GON)

    def of(self, keep: Truths) -> "_Fit":
        return _Fit(self.up[:, keep], self.factor[keep], self.rms[keep])


def absolute_orientation_at(
    bench: Bench, model: ModelJob, control: Mapping[str, tuple[float, float, float]]
) -> dict[int, OnGround]:
    """Level and scale a model, read it with heights in metres, and set the instruments back to how they stood.

    `control` is X, Y, Z in m, nan for what is not known of a point. What comes back is by session; those whose models
    do not show two points of control in plan and three in height remark so and do nothing.
    """
    found: dict[int, OnGround] = {}
    crew = bench.crew
    for who, names in _alike(bench, crew.everybody, [*control]):
        known = Control(tuple(names), np.array([control[name] for name in names]).reshape(-1, 3).T)
        if known.is_enough:
            found |= _Levelling(bench, model, known).done(who)
        else:
            crew.remark(who, f"{model.name}: too little control to level and scale it ({', '.join(names) or 'none'})")
    return found


def _alike(bench: Bench, who: Who, names: Sequence[str]) -> Iterator[tuple[Who, list[str]]]:
    """Yield sessions that find the same points on their prints, and these points."""
    shown = np.array([bench.pricked(who, name) for name in names])
    for pattern in np.unique(shown, axis=1).T:
        alike = who[(shown == pattern[:, None]).all(axis=0)]
        yield alike, [name for name, there in zip(names, pattern, strict=True) if there]


class _Levelling:
    """Sessions with the same control at work on one model."""

    def __init__(self, bench: Bench, model: ModelJob, control: Control) -> None:
        self.bench, self.crew, self.seat = bench, bench.crew, bench.seat
        self.model, self.control = model, control
        self.manual = bench.seat.manual
        self.names = [name for name in self.manual.elements if name not in ("c1", "c2")]
        self.number = 0.0
        """Scale number that is wanted; zero before it is chosen."""

    def done(self, who: Who) -> dict[int, OnGround]:
        """Level, read and set back."""
        seat, sessions = self.seat, self.crew.sessions
        before = self._settings(who)
        seat.drive(who, {"Z": np.round(seat.counters(who)[2])})
        start, shift = np.zeros((2, sessions))
        start[who] = seat.counters(who)[2]
        fit = self._fit(who, self._measured(who, 1))
        gear = self._gear()
        seat.drive(who, {"Z": start[who]})
        seat.engage(who, gear)
        rounds = self._turned_until_level(self.crew.still(who), fit)
        who = self.crew.still(who)
        shift[who] = self._index_set(who)
        readings = self._read(who)
        who = self.crew.still(who)
        found = self._concluded(who, gear, rounds, before, self._settings(who), readings)
        self._set_back(who, before, start, shift)
        return found

    def _settings(self, who: Who) -> dict[str, Array]:
        """Return what all elements show ``(sessions,)``."""
        every = {name: np.full(self.crew.sessions, np.nan) for name in self.names}
        for name, counts in self.seat.elements(who, self.names).items():
            every[name][who] = counts
        return every

    # --- how it stands --------------------------------------------------------------------------------

    def _measured(self, who: Who, number: int) -> Array:
        """Return places ``(3, n, m)`` of the control in the frame, mm, Z up."""
        self.bench.begin_round(who, number)
        readings = self.bench.measure(who, self.control.names)[:, :, who]
        x, y, z = np.stack([self.seat.place(who, each) for each in np.moveaxis(readings, 1, 0)], axis=1)
        return np.array([x, y, -z])

    def _fit(self, who: Who, at: Array) -> _Fit:
        """Compare places ``(3, n, m)`` with the control."""
        self.bench.compute(who)
        first, last = self.control.ends
        across = self.control.between(first, last)
        vector = at[:, last] - at[:, first]
        given = self.control.ground[2, self.control.with_height][:, None]
        has_height = bool(np.isfinite(across[2]))
        metres = length_of(across if has_height else across[:2]) / length_of(vector)
        up = self._up(who, at[:, self.control.with_height], given / metres)
        if not has_height:
            metres = length_of(across[:2]) / length_of(vector - up * (up * vector).sum(axis=0))
        if not self.number:
            self.number = self._nearest_number(metres)
        off = 1e-3 * self.number * at[2, self.control.with_height] - given
        return _Fit(up, 1e3 * metres / self.number, np.asarray(off.std(axis=0)))

    def _up(self, who: Who, at: Array, given: Array) -> Array:
        """Return the up directions ``(3, m)`` from places ``(3, n, m)`` and heights at their scale ``(n, m)``, mm."""
        slopes = np.zeros((2, who.size))
        design = np.moveaxis(np.array([at[0], at[1], np.ones_like(at[0])]), 0, 1)
        for _ in range(5):
            try:
                slopes = adjusted(design, given - np.sqrt(1.0 - (slopes**2).sum(axis=0)) * at[2]).unknowns[:2]
            except Undetermined as undetermined:
                self.crew.give_up(who, f"{self.model.name}: the height control does not level it: {undetermined}")
                break
        return np.array([*slopes, np.sqrt(1.0 - (slopes**2).sum(axis=0))])

    def _nearest_number(self, metres: Array) -> float:
        """Return the scale number of the planned gear, or of the gear that is nearest to the model as it stands."""
        planned = self.bench.job.plan.height_gear
        if isinstance(planned, str):
            return 1e3 * self.manual.height_gears[planned].units_per_mm
        present = 1e3 * float(np.median(metres))
        numbers = [1e3 * each.units_per_mm for each in self.manual.height_gears.values()]
        return min(numbers, key=lambda number: float(abs(np.log(number / present))))

    def _gear(self) -> str:
        """Return the height gear that counts metres at the scale that is wanted."""
        return {1e3 * each.units_per_mm: name for name, each in self.manual.height_gears.items()}[self.number]

    # --- turning --------------------------------------------------------------------------------------

    def _turned_until_level(self, who: Who, fit: _Fit) -> dict[int, list[LevellingRound]]:
        """Turn and measure until it gets no better; the best settings stand."""
        crew = self.crew
        rounds: dict[int, list[LevellingRound]] = {int(session): [] for session in who}
        least = np.full(crew.sessions, np.inf)
        best = self._settings(who)
        for number in range(2, MOST_ROUNDS + 2):
            _note(rounds, who, fit)
            misfit = np.hypot(fit.rms, np.abs(fit.factor - 1.0) * self._flying_height)
            now, better = self._settings(who), misfit < least[who]
            falling = misfit < STILL_FALLING * least[who]
            for name, kept in best.items():
                kept[who[better]] = now[name][who[better]]
            least[who[better]] = misfit[better]
            who, fit = who[falling], fit.of(falling)
            if not who.size or number > MOST_ROUNDS:
                break
            self._turn(who, fit)
            who = crew.still(who)
            if not who.size:
                break
            fit = self._fit(who, self._measured(who, number))
        everybody = crew.still(np.array(list(rounds), dtype=np.intp))
        self.seat.set_changed(everybody, {name: kept[everybody] for name, kept in best.items()})
        return rounds

    @property
    def _flying_height(self) -> float:
        return 1e-3 * self.number * self.bench.job.plan.projection_height

    def _turn(self, who: Who, fit: _Fit) -> None:
        settings = {name: values[who] for name, values in self._settings(who).items()}
        self.seat.set_changed(who, turned_upright(settings, self.model, self.manual, fit.up, fit.factor))

    # --- heights in metres ----------------------------------------------------------------------------

    def _index_set(self, who: Who) -> Array:
        """Make the Z counter read heights, on the mean of the control; return how much more it reads ``(m,)``."""
        names = [self.control.names[i] for i in self.control.with_height]
        self.bench.begin_round(who, MOST_ROUNDS + 1)
        readings = self.bench.measure(who, names)[2][:, who]
        more = np.mean(self.control.ground[2, self.control.with_height][:, None] - readings, axis=0)
        return self.seat.shift_counter(who, "Z", more)

    def _read(self, who: Who) -> dict[str, Array]:
        """Measure control and all other points that are shown; X, Y in mm and Z in m ``(3, sessions)``."""
        self.bench.begin_round(who, MOST_ROUNDS + 2)
        wanted = dict.fromkeys([*self.control.names, *self.model.other_points])
        names = [name for name in wanted if self.bench.pricked(who, name).all()]
        return dict(zip(names, np.moveaxis(self.bench.measure(who, names), 1, 0), strict=True))

    def _concluded(
        self,
        who: Who,
        gear: str,
        rounds: Mapping[int, Sequence[LevellingRound]],
        before: Settings,
        elements: Settings,
        readings: Settings,
    ) -> dict[int, OnGround]:
        names, (first, last) = self.control.names, self.control.ends
        mm = 1.0 / self.manual.scales["X"].units_per_mm
        read = 1e-3 * self.number * mm * length_of((readings[names[last]] - readings[names[first]])[:2])
        distance = read - length_of(self.control.between(first, last)[:2])
        return {
            int(s): OnGround(
                self.number,
                gear,
                rounds[int(s)],
                {name: float(each[s]) for name, each in before.items()},
                {name: float(each[s]) for name, each in elements.items()},
                {
                    names[i]: float(readings[names[i]][2, s] - self.control.ground[2, i])
                    for i in self.control.with_height
                },
                float(distance[s]),
                TOLERATED_SHARE * self._flying_height,
                {name: (float(p[0, s]), float(p[1, s]), float(p[2, s])) for name, p in readings.items()},
            )
            for s in who
        }

    def _set_back(self, who: Who, before: Settings, start: Array, shift: Array) -> None:
        """Set elements, index and gear as they were before, to the count."""
        if who.size:
            self.seat.shift_counter(who, "Z", -shift[who])
            self.seat.drive(who, {"Z": start[who]})
            self.seat.engage(who, self.bench.job.plan.height_gear)
            self.seat.set_changed(who, {name: values[who] for name, values in before.items()})


def _note(rounds: Mapping[int, list[LevellingRound]], who: Who, fit: _Fit) -> None:
    for session, rms, factor, tilts in zip(who.tolist(), fit.rms, fit.factor, fit.tilts.T, strict=True):
        rounds[session].append(LevellingRound(float(rms), float(factor), (float(tilts[0]), float(tilts[1]))))


def turned_upright(settings: Settings, model: ModelJob, manual: Variant, up: Array, factor: Array) -> dict[str, Array]:
    """Return the elements ``(m,)`` that set a whole model upright and larger by a factor, of those the plotter has.

    `up` ``(3, m)`` is the direction in the frame that is to point upward.
    """
    turned = turned_by_common_phi if "common_phi" in manual.elements else turned_together
    return turned(settings, model, manual, up, factor)


def turned_together(settings: Settings, model: ModelJob, manual: Variant, up: Array, factor: Array) -> dict[str, Array]:
    """Return the elements ``(m,)`` at which the whole model stands upright and is larger by a factor.

    The tilts are taken in whole counts, so that
    both projectors turn by the same; bz' and bz" share what the base rises.
    """
    left, right = model.left_projector, model.right_projector
    about_y = _in_counts(-np.arctan2(up[0], up[2]))
    about_x = _in_counts(np.arctan2(up[1], np.hypot(up[0], up[2])))
    zero = np.zeros_like(about_x)
    whole = mxm(rotation(about_x, zero, zero), rotation(zero, about_y, zero))
    found = {}
    for n in (left, right):
        angles = angles_of(mxm(whole, _stand(settings, manual, n)))
        for name, radians in zip(("omega", "phi", "kappa"), angles, strict=True):
            found[f"{name}{n}"] = radians / GON + manual.elements[f"{name}{n}"].zero
    base = np.array(
        [
            settings["bx"],
            settings[f"by{left}"] - settings[f"by{right}"],
            settings[f"bz{right}"] - settings[f"bz{left}"],
        ]
    )
    bx, across, rise = factor * mxv(whole, base)
    more = np.round(rise - base[2], 2)
    half = np.round(more / 2.0, 2)
    return found | {
        f"bz{left}": settings[f"bz{left}"] - half,
        f"bz{right}": settings[f"bz{right}"] + more - half,
        f"by{right}": settings[f"by{left}"] - across,
        "bx": bx,
    }


def turned_by_common_phi(
    settings: Settings, model: ModelJob, manual: Variant, up: Array, factor: Array
) -> dict[str, Array]:
    """Return the elements ``(m,)`` that do the same where a common Phi tilts the whole along the base."""
    zero = manual.elements["common_phi"].zero
    common = (settings["common_phi"] - zero) * GON
    x, y, z = mxv(rotation(np.zeros_like(common), -common, np.zeros_like(common)), up)
    about_x = _in_counts(np.arctan2(y, z))
    upright = y * np.sin(about_x) + z * np.cos(about_x)
    omegas = {name: settings[name] + about_x / GON for name in ("omega1", "omega2")}
    return omegas | {"common_phi": zero - np.arctan2(x, upright) / GON, "bx": factor * settings["bx"]}


def _stand(settings: Settings, manual: Variant, n: int) -> Array:
    omega, phi, kappa = (
        (settings[f"{name}{n}"] - manual.elements[f"{name}{n}"].zero) * GON for name in ("omega", "phi", "kappa")
    )
    return rotation(omega, phi, kappa)


def _in_counts(radians: Array) -> Array:
    return np.asarray(np.round(radians / GON / LEAST_COUNT) * LEAST_COUNT * GON)
