"""Levelling and scaling a model at the instrument, by computed changes of its elements (thesis 3.5).

Scale by the base against a known distance, levelling by the tilts against known heights. Both projectors and the base
are turned together, so that the relative orientation is unchanged: on a plotter with bz by omega, phi, bz and bx of
both, to second order also by kappa and by; on one with a common Phi by that, by equal changes of omega, and by the
base. The list of the plotter's elements selects the method.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from a7sim.batch import Indices
from a7sim.geometry import GON, Array, angles_of, length_of, mxm, mxv, rotation
from a7sim.operator.driving.driver import BoolArray
from a7sim.operator.driving.job import ModelJob
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.procedures.relative import expand_to_batch
from a7sim.plotters import Variant
from a7sim.reduction import Ground, Undetermined, solve_least_squares

MAX_ROUNDS = 6
STILL_FALLING = 0.8
MIN_PLAN, MIN_HEIGHTS = 2, 3

Settings = Mapping[str, Array]


@dataclass(frozen=True)
class LevellingRound:
    """Levelling round of a session: readings at control, and differences of model and ground."""

    height_rms: float
    """Rms of the heights about their mean, m."""
    scale: float
    """Factor by which the model was too small."""
    tilts: tuple[float, float]
    """Inclination of the plumb line in the model, along the base and across it, gon."""


@dataclass(frozen=True)
class Control:
    """Control of a model: names, ground ``(3, n)`` in m with nan for unknown coordinates."""

    names: tuple[str, ...]
    ground: Array

    @classmethod
    def of(cls, ground: Ground, names: Sequence[str]) -> "Control":
        """Return the control among these points."""
        return cls(tuple(names), ground.coordinates[:, [ground.points.index(name) for name in names]])

    @property
    def with_height(self) -> list[int]:
        """Indices of points with height."""
        return np.flatnonzero(np.isfinite(self.ground[2])).tolist()

    @property
    def in_plan(self) -> list[int]:
        """Indices of points with plan coordinates."""
        return np.flatnonzero(np.isfinite(self.ground[:2]).all(axis=0)).tolist()

    @property
    def is_enough(self) -> bool:
        """Whether scale and levelling are determined."""
        return len(self.in_plan) >= MIN_PLAN and len(self.with_height) >= MIN_HEIGHTS

    @property
    def ends(self) -> tuple[int, int]:
        """The two points farthest apart in plan."""
        return max(combinations(self.in_plan, 2), key=lambda pair: float(length_of(self.between(*pair)[:2])))

    def between(self, first: int, last: int) -> Array:
        """Return the vector ``(3,)`` from one point to another, m."""
        return np.asarray(self.ground[:, last] - self.ground[:, first])


@dataclass(frozen=True)
class Fit:
    """Fit of the models of m sessions to the ground."""

    up: Array
    """Direction in the frame that points upward on the ground ``(3, m)``."""
    metres: Array
    """Metres on the ground per mm of the model ``(m,)``."""
    heights: Array
    """Heights of the control in the model, mm, and on the ground, m ``(2, n, m)``."""

    @property
    def tilts(self) -> Array:
        """Inclination of the plumb line along the base and across it ``(2, m)``, gon."""
        return np.asarray(np.arctan2(self.up[:2], self.up[2]) / GON)

    def factor(self, number: float) -> Array:
        """Return the factor ``(m,)`` from the model to a scale number."""
        return np.asarray(1e3 * self.metres / number)

    def rms(self, number: float) -> Array:
        """Return the rms ``(m,)`` of heights about their mean, model minus ground, m."""
        in_model, on_ground = self.heights
        return np.asarray((1e-3 * number * in_model - on_ground).std(axis=0))

    def of(self, keep: BoolArray) -> "Fit":
        """Return the fit of selected sessions."""
        return Fit(self.up[:, keep], self.metres[keep], self.heights[:, :, keep])


class Levelling:
    """Levelling of the sessions with the same control in one model."""

    def __init__(self, workstation: Workstation, model: ModelJob, control: Control) -> None:
        self.workstation, self.operators, self.controls = workstation, workstation.operators, workstation.controls
        self.model, self.control = model, control
        self.names = [name for name in workstation.controls.manual.elements if name not in ("c1", "c2")]

    def settings(self, active: Indices) -> dict[str, Array]:
        """Return the positions of all elements ``(sessions,)``."""
        return expand_to_batch(self.controls.exact_values(active, self.names), active, self.operators.size)

    def measured(self, active: Indices, number: int) -> Array:
        """Measure the control in a round; return positions ``(3, n, m)`` in the frame, mm, Z up."""
        self.workstation.begin_round(active, number)
        readings = self.workstation.measure_points(active, self.control.names)[:, :, active]
        x, y, z = np.stack([self.controls.model_position(active, each) for each in np.moveaxis(readings, 1, 0)], axis=1)
        return np.array([x, y, -z])

    def compared(self, active: Indices, at: Array) -> Fit:
        """Compare positions ``(3, n, m)`` with the control: the scale by its two ends, the tilts by its heights."""
        self.workstation.compute(active)
        first, last = self.control.ends
        across = self.control.between(first, last)
        vector = at[:, last] - at[:, first]
        given = self.control.ground[2, self.control.with_height][:, None]
        has_height = bool(np.isfinite(across[2]))
        metres = length_of(across if has_height else across[:2]) / length_of(vector)
        up = self._up(active, at[:, self.control.with_height], given / metres)
        if not has_height:
            metres = length_of(across[:2]) / length_of(vector - up * (up * vector).sum(axis=0))
        in_model = at[2, self.control.with_height]
        return Fit(up, metres, np.array([in_model, np.broadcast_to(given, in_model.shape)]))

    def _up(self, active: Indices, at: Array, given: Array) -> Array:
        """Return the up directions ``(3, m)`` of positions ``(3, n, m)`` and heights at their scale ``(n, m)``, mm."""
        slopes = np.zeros((2, active.size))
        design = np.moveaxis(np.array([at[0], at[1], np.ones_like(at[0])]), 0, 1)
        for _ in range(5):
            try:
                slopes = solve_least_squares(design, given - np.sqrt(1.0 - (slopes**2).sum(axis=0)) * at[2]).unknowns[
                    :2
                ]
            except Undetermined as undetermined:
                self.operators.give_up(
                    active, f"{self.model.name}: the height control does not level it: {undetermined}"
                )
                break
        return np.array([*slopes, np.sqrt(1.0 - (slopes**2).sum(axis=0))])

    def level(self, active: Indices, fit: Fit, number: float) -> dict[int, list[LevellingRound]]:
        """Turn and measure until the fit no longer improves, the model to a scale number; the best settings are kept.

        Return the rounds by session.
        """
        operators = self.operators
        rounds: dict[int, list[LevellingRound]] = {int(session): [] for session in active}
        least = np.full(operators.size, np.inf)
        best = self.settings(active)
        height = 1e-3 * number * self.workstation.job.plan.projection_height
        for round_number in range(2, MAX_ROUNDS + 2):
            _note(rounds, active, fit, number)
            misfit = np.hypot(fit.rms(number), np.abs(fit.factor(number) - 1.0) * height)
            now, better = self.settings(active), misfit < least[active]
            falling = misfit < STILL_FALLING * least[active]
            for name, kept in best.items():
                kept[active[better]] = now[name][active[better]]
            least[active[better]] = misfit[better]
            active, fit = active[falling], fit.of(falling)
            if not active.size or round_number > MAX_ROUNDS:
                break
            settings = {name: values[active] for name, values in now.items()}
            upright = levelled_elements(settings, self.model, self.controls.manual, fit.up, fit.factor(number))
            self.controls.turn_if_changed(active, upright)
            active = operators.remaining(active)
            if not active.size:
                break
            fit = self.compared(active, self.measured(active, round_number))
        sessions = operators.remaining(np.array(list(rounds), dtype=np.intp))
        self.controls.turn_if_changed(sessions, {name: kept[sessions] for name, kept in best.items()})
        return rounds


def _note(rounds: Mapping[int, list[LevellingRound]], active: Indices, fit: Fit, number: float) -> None:
    for session, rms, factor, tilts in zip(
        active.tolist(), fit.rms(number), fit.factor(number), fit.tilts.T, strict=True
    ):
        rounds[session].append(LevellingRound(float(rms), float(factor), (float(tilts[0]), float(tilts[1]))))


def levelled_elements(
    settings: Settings, model: ModelJob, manual: Variant, up: Array, factor: Array
) -> dict[str, Array]:
    """Return the elements ``(m,)`` that level a model and enlarge it by a factor, with the elements of the plotter.

    `up` ``(3, m)`` is the direction in the frame that will point upward.
    """
    turned = levelled_by_common_phi if "common_phi" in manual.elements else levelled_by_all_elements
    return turned(settings, model, manual, up, factor)


def levelled_by_all_elements(
    settings: Settings, model: ModelJob, manual: Variant, up: Array, factor: Array
) -> dict[str, Array]:
    """Return the elements ``(m,)`` that level the model and enlarge it by a factor.

    bz' and bz" share the rise of the base.
    """
    left, right = model.left_projector, model.right_projector
    about_y = -np.arctan2(up[0], up[2])
    about_x = np.arctan2(up[1], np.hypot(up[0], up[2]))
    zero = np.zeros_like(about_x)
    whole = mxm(rotation(about_x, zero, zero), rotation(zero, about_y, zero))
    found = {}
    for n in (left, right):
        angles = angles_of(mxm(whole, rotation(*(GON * tilt for tilt in manual.tilts(settings, n)))))
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
    half = (rise - base[2]) / 2.0
    return found | {
        f"bz{left}": settings[f"bz{left}"] - half,
        f"bz{right}": settings[f"bz{right}"] + half,
        f"by{right}": settings[f"by{left}"] - across,
        "bx": bx,
    }


def levelled_by_common_phi(
    settings: Settings, model: ModelJob, manual: Variant, up: Array, factor: Array
) -> dict[str, Array]:
    """Return the elements ``(m,)`` that do the same with a common Phi along the base."""
    zero = manual.elements["common_phi"].zero
    common = (settings["common_phi"] - zero) * GON
    x, y, z = mxv(rotation(np.zeros_like(common), -common, np.zeros_like(common)), up)
    about_x = np.arctan2(y, z)
    upright = y * np.sin(about_x) + z * np.cos(about_x)
    omegas = {name: settings[name] + about_x / GON for name in ("omega1", "omega2")}
    return omegas | {"common_phi": zero - np.arctan2(x, upright) / GON, "bx": factor * settings["bx"]}
