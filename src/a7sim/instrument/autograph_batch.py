"""Batch of plotters of one type as arrays, each with its own pictures and faults: the batch twin of `Autograph`.

`active` are the indices ``(m,)`` of the active instruments; parameters and results have them as their last axis. An
instrument that cannot execute an action does nothing; `pop_errors` returns the reason.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, put, take
from a7sim.geometry import GON, Array, length_of, mxm, mxv, plane_rotation, rotation
from a7sim.instrument.autograph import COUNTED_FROM_ZERO, MOVE_CENTRES, guide_matrix
from a7sim.instrument.batch_parts import AXES, BoolArray, Carriages, Carriers, Drums, PeriodicErrors, round_like_counter
from a7sim.instrument.condition import INSTRUMENT_STREAM, draw_condition, local_coefficients, zero_error
from a7sim.instrument.projection import place_on_carrier, projection_centre
from a7sim.instrument.spindles import UNITS_A_DRUM
from a7sim.plotters import COUNTER_DECIMALS, LEAST_COUNT, POSITIONS_OF, REQUIRED_FITTINGS, VARIANTS, Variant
from a7sim.scenario.schema import Condition, Instrument, ProjectorCondition
from a7sim.scene.photograph import Photograph

SHIFTS = ("bx", "by1", "by2", "bz1", "bz2")
"""Elements that rotate no projector."""


_RIGHT = {
    arrangement: {name: POSITIONS_OF[name].index(position) for name, position in fittings.as_words().items()}
    for arrangement, fittings in REQUIRED_FITTINGS.items()
}
"""Required position of each fitting, by polarity and base."""


@dataclass(frozen=True)
class FittingEffects:
    """Effects of base, levers, prisms and collars of each instrument."""

    uncrossed: BoolArray
    """Where the left eye sees the left picture ``(instruments,)``."""
    signs: Mapping[int, Array]
    """Signs of the view of the picture in a projector ``(2, instruments)``, in um for a mm."""
    senses: Array
    """Of the handwheels X, Y and Z ``(3, instruments)``."""


_OF_A_BUNDLE = 19
"""Numbers of the bundle of a projector."""


class ProjectorBundles:
    """Bundles of the projectors of a batch, in rows of one array, so that one look selects them once."""

    def __init__(self, rows: Array) -> None:
        self._rows = rows
        sessions = rows.shape[-1]
        self.turned = rows[:9].reshape(3, 3, sessions)
        self.centre = rows[9:12]
        self.swung = rows[12:16].reshape(2, 2, sessions)
        """By the swing of the projector with which its picture is seen."""
        self.principal_point = rows[16:18]
        self.c = rows[18]

    def take(self, active: Indices) -> "ProjectorBundles":
        """Return the bundles of the active instruments, read-only."""
        return self if active.size == self.c.size else ProjectorBundles(take(self._rows, active))


class AutographBatch:
    """Batch of plotters operated by their controls. Lengths in mm, angles in gon, as the counters read."""

    def __init__(
        self,
        variant: Variant,
        conditions: Sequence[Condition],
        photographs: Sequence[Mapping[str, Photograph]],
        laying_sigmas: tuple[float, float],
        rngs: Sequence[np.random.Generator],
    ) -> None:
        self.variant = variant
        self.instruments = len(conditions)
        self._conditions = conditions
        self._photographs = photographs
        self._laying_sigmas = laying_sigmas
        self._rngs = rngs
        self._refusals: dict[int, list[str]] = {}
        everywhere = np.arange(self.instruments)
        self._drums = {name: self._element_drums(name) for name in variant.elements}
        carriage_play = self._of_conditions(lambda condition: condition.carriage_backlash_mm)
        self._carriages = Carriages(variant, carriage_play, self._carriage_runouts())
        self._slip_shares = self._of_conditions(lambda condition: condition.counter_slip_share)
        self._no_slips = not self._slip_shares.any()
        self._units = np.array([variant.scales[axis].units_per_mm for axis in AXES])
        self._decimals = [COUNTER_DECIMALS] * len(AXES)
        self._offsets = np.empty((len(AXES), self.instruments))
        self._reset_offsets(everywhere)
        self._guides = np.stack([guide_matrix(condition) for condition in conditions], axis=-1)
        self._rods = {n: self._where_any(1e-3 * self._of_projectors(n, lambda each: each.rod_um)) for n in (1, 2)}
        self._local = {n: self._local_errors(n) for n in (1, 2)}
        self._axes = {n: 1e-3 * self._of_projectors(n, lambda projector: projector.axes_um) for n in (1, 2)}
        self._carriers: dict[int, Carriers] = {}
        self._base_inside = np.ones(self.instruments, dtype=bool)
        self._fittings = {name: np.zeros(self.instruments, dtype=np.intp) for name in POSITIONS_OF}
        self._levers: FittingEffects | None = None
        self._put_right_fittings(everywhere)
        self._bundles = {n: ProjectorBundles(np.zeros((_OF_A_BUNDLE, self.instruments))) for n in (1, 2)}
        for n, each in self._bundles.items():
            each.principal_point[:] = 1e-3 * self._of_projectors(n, lambda projector: projector.principal_point_um)
        self._missed = {n: np.zeros((3, self.instruments)) for n in (1, 2)}
        """Distance of the axes from the centre, in the frame (see `pose`)."""
        self._common = np.zeros((3, 3, self.instruments))
        """Rotation by the common Phi, if any."""
        self._projection_centres = {n: np.zeros((3, self.instruments)) for n in (1, 2)}
        """Positions of the centres by the drums."""
        for n in (1, 2):
            self._stand(everywhere, n)

    def _of_conditions(self, value: Callable[[Condition], float]) -> Array:
        return np.array([value(condition) for condition in self._conditions])

    def _of_projectors(self, n: int, values: Callable[[ProjectorCondition], Sequence[float]]) -> Array:
        each_row = np.array([values(each.left if n == 1 else each.right) for each in self._conditions])
        return np.ascontiguousarray(each_row.T)

    def _local_errors(self, n: int) -> Array | None:
        found = [local_coefficients(each.left if n == 1 else each.right) for each in self._conditions]
        shape = next((each.shape for each in found if each is not None), None)
        if shape is None:
            return None
        return np.stack([np.zeros(shape) if each is None else each for each in found], axis=-1)

    def _where_any(self, values: Array) -> Array | None:
        return values if values.any() else None

    def _carriage_runouts(self) -> PeriodicErrors | None:
        amplitude = 1e-3 * np.array([condition.carriage_periodic_um for condition in self._conditions]).T.copy()
        phase = GON * np.array([condition.carriage_periodic_phase_gon for condition in self._conditions]).T.copy()
        return PeriodicErrors(amplitude, self.variant.carriage_lead_mm, phase) if amplitude.any() else None

    def _element_drums(self, name: str) -> Drums:
        element = self.variant.elements[name]
        angular = element.unit == "gon"
        play = self._of_conditions(lambda each: each.backlash_gon if angular else each.backlash_mm)
        sigma = self._of_conditions(lambda each: each.setting_sigma_gon if angular else each.setting_sigma_mm)
        fault = self._of_conditions(lambda each: zero_error(each, name))
        return Drums(element.zero, element.low, element.high, element.endless, play, sigma, fault)

    # --- refusals -------------------------------------------------------------------------------------

    def pop_errors(self, active: Indices) -> dict[int, list[str]]:
        """Return the errors since the last call, by instrument."""
        return {int(each): self._refusals.pop(int(each)) for each in active if int(each) in self._refusals}

    def _refuse(self, active: Indices, why: str, number: int = -222) -> None:
        for each in active:
            self._refusals.setdefault(int(each), []).append(f'{number},"{why}"')

    # --- elements -------------------------------------------------------------------------------------

    def elements(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        """Return the counter readings of elements ``(m,)``."""
        return {name: self._drums[name].shown(active) for name in names}

    def set_element(self, active: Indices, name: str, values: Array) -> None:
        """Set an element by its counters to values ``(m,)``, to the least count."""
        self._run_element(active, name, np.round(values / LEAST_COUNT) * LEAST_COUNT, self._rngs)

    def turn_element(self, active: Indices, name: str, amounts: Array) -> None:
        """Turn the drums of an element by amounts ``(m,)``, to any position between two counts."""
        self._run_element(
            active, name, self._drums[name].value_after_turn(active, amounts) if name in self._drums else amounts
        )

    def _run_element(
        self, active: Indices, name: str, targets: Array, rngs: Sequence[np.random.Generator] = ()
    ) -> None:
        if name not in self._drums:
            self._refuse(active, f"an {self.variant.name} has no {name}", -221)
            return
        drums = self._drums[name]
        allowed = drums.within_range(targets)
        moved = [n for n in (1, 2) if name in ("bx", "common_phi") or name.endswith(str(n))]
        reached_centres: dict[int, Array] = {}
        if name in MOVE_CENTRES:
            reached_centres = {n: self._drum_centres(active, n, {name: targets}) for n in moved}
            allowed &= self._rods_can(active, reached_centres)
        if not allowed.all():
            self._refuse(active[~allowed], f"Data out of range;{name}: beyond its range or that of the rods")
            active, targets = active[allowed], targets[allowed]
            reached_centres = {n: each.compress(allowed, axis=-1) for n, each in reached_centres.items()}
        drums.turn_to(active, targets, rngs)
        for n in moved:
            if name in SHIFTS:
                self._shift(active, n, reached_centres[n])
            else:
                self._stand(active, n)

    def set_base_mode(self, active: Indices, mode: str) -> None:
        """Set base inside or outside."""
        inside = mode == "inside"
        base_inside = np.full(active.size, inside)
        able = self._rods_can(active, {n: self._drum_centres(active, n, base_inside=base_inside) for n in (1, 2)})
        self._refuse(active[~able], f"Data out of range;base {mode}: beyond the range of the rods")
        self._base_inside[active[able]] = inside
        self._levers = None
        for n in (1, 2):
            self._stand(active, n)

    def fitting(self, active: Indices, name: str) -> npt.NDArray[np.str_]:
        """Return the positions ``(m,)`` of a fitting."""
        return np.array(POSITIONS_OF[name])[self._fittings[name][active]]

    def set_fitting(self, active: Indices, name: str, position: str) -> None:
        """Set a fitting to one of its two positions."""
        self._fittings[name][active] = POSITIONS_OF[name].index(position)
        self._levers = None

    def reset(self, active: Indices) -> None:
        """Move all elements with a counter zero to it, base inside, fittings for a positive, presets off."""
        for name, drums in self._drums.items():
            if name not in ("c1", "c2"):
                drums.turn_to(active, np.full(active.size, self.variant.elements[name].zero), self._rngs)
        self._base_inside[active] = True
        self._put_right_fittings(active)
        self._reset_offsets(active)
        for n in (1, 2):
            self._stand(active, n)

    def _reset_offsets(self, active: Indices) -> None:
        for axis, scale in self.variant.scales.items():
            self._offsets[AXES.index(axis), active] = scale.at_origin

    def _put_right_fittings(self, active: Indices) -> None:
        for name, position in REQUIRED_FITTINGS["positive", "inside"].as_words().items():
            self.set_fitting(active, name, position)

    # --- carriages, counters, gears -------------------------------------------------------------------

    def counter(self, active: Indices, axis: str) -> Array:
        """Return the readings of the X, Y or Z counters ``(m,)``."""
        row = AXES.index(axis)
        return round_like_counter(self._unrounded(active, row, self._carriages.at[row][active]), self._decimals[row])

    def counters(self, active: Indices) -> Array:
        """Return the readings of the X, Y and Z counters ``(3, m)``."""
        readings = take(self._offsets, active) + self._units[:, None] * take(self._carriages.at, active)
        if len(set(self._decimals)) == 1:
            return round_like_counter(readings, self._decimals[0])
        return np.array(
            [round_like_counter(each, decimals) for each, decimals in zip(readings, self._decimals, strict=True)]
        )

    def _unrounded(self, active: Indices, row: int, position: Array) -> Array:
        return np.asarray(self._offsets[row][active] + self._units[row] * position)

    def preset(self, active: Indices, axis: str, reading: float) -> None:
        """Preset the counters to a reading at the present positions of their carriages."""
        row = AXES.index(axis)
        shown = round(reading, self._decimals[row])
        self._offsets[row, active] = shown - self._units[row] * self._carriages.at[row][active]

    def set_height_gear(self, active: Indices, gear: str | float) -> None:
        """Engage a height gear, the same in all instruments."""
        units, decimals = float(gear) if not isinstance(gear, str) else 0.0, COUNTER_DECIMALS
        if isinstance(gear, str):
            engaged = self.variant.height_gears[gear]
            units, decimals = engaged.units_per_mm, engaged.decimals
        row = AXES.index("Z")
        position = self._carriages.at[row][active]
        reading = self._unrounded(active, row, position)
        self._units[row], self._decimals[row] = units, decimals
        self._offsets[row, active] = round_like_counter(reading, decimals) - units * position

    def drive(self, active: Indices, axis: str, readings: Array) -> BoolArray:
        """Drive carriages until their counters show readings ``(m,)``; return which reached them."""
        row = AXES.index(axis)
        wanted = round_like_counter(readings, self._decimals[row])
        went = self._move(active, row, (wanted - self._offsets[row][active]) / self._units[row])
        slipping = went & (self._slip_shares[active] > 0.0)
        if slipping.any():
            again = (wanted[slipping] - self._offsets[row][active[slipping]]) / self._units[row]
            off = np.abs(again - self._carriages.at[row][active[slipping]]) > self._half_a_count(row)
            self._move(active[slipping][off], row, again[off], silently=True)
        return went

    def _half_a_count(self, row: int) -> float:
        return float(0.5000001 * 10.0 ** -self._decimals[row] / self._units[row])

    def turn_handwheels(self, active: Indices, amounts: Array) -> None:
        """Turn the handwheels X, Y and, if there is a third row, Z by counter units ``(k, m)``, in that order.

        Their collars decide the directions of the carriages.
        """
        k = len(amounts)
        before = take(self._carriages.at, active)
        steps = take(self._levers_stand.senses[:k], active) * amounts / self._units[:k, None]
        after = before[:k] + steps
        if self._no_slips and active.size:
            low, high = after.min(axis=1), after.max(axis=1)
            if self._carriages.range_contains(low, high) and self._rods_surely_can(active, before, low, high):
                self._carriages.move_to(active, 0, after)
                return
        for row, each in enumerate(after):
            self._move(active, row, each)

    def _move(self, active: Indices, row: int, positions: Array, silently: bool = False) -> BoolArray:
        positions = self._carriages.snap_to_end(row, positions, self._half_a_count(row))
        before = self._carriages.at[row, active]
        mark = take(self._carriages.at, active).copy()
        mark[row] = positions
        allowed = self._carriages.within_range(row, positions) & self._rods_can(active, mark=mark)
        if not silently:
            self._refuse(active[~allowed], f"Data out of range;{AXES[row]}: beyond its range or that of the rods")
        active, positions = active[allowed], positions[allowed]
        self._slip(active, row, before[allowed], positions)
        self._carriages.move_to(active, row, positions[None])
        return np.asarray(allowed)

    def _slip(self, active: Indices, row: int, before: Array, after: Array) -> None:
        """Let counters miss carries on the way from one position ``(m,)`` to another (see `Counter.advance`)."""
        if self._no_slips:
            return
        for i in np.flatnonzero(self._slip_shares[active] > 0.0):
            each = active[i]
            first, last = (
                math.floor((self._offsets[row, each] + self._units[row] * position[i]) / UNITS_A_DRUM)
                for position in (before, after)
            )
            if first != last:
                missed = self._rngs[each].binomial(abs(last - first), self._slip_shares[each])
                self._offsets[row, each] -= math.copysign(missed * UNITS_A_DRUM, last - first)

    def _rods_can(
        self, active: Indices, centres: Mapping[int, Array] | None = None, mark: Array | None = None
    ) -> BoolArray:
        """Return where no rod moves beyond its limit, nor further beyond it, with other centres or marks ``(3, m)``."""
        now = take(self._carriages.at, active)
        mark = now if mark is None else mark
        able = np.ones(active.size, dtype=bool)
        for n in (1, 2) if centres is None else centres:
            beside, below = _reach(take(self._projection_centres[n], active) if centres is None else centres[n], mark)
            if (beside < self._surely_within * below).all():
                continue
            then = np.arctan2(beside, below) / GON
            beyond = then > self.variant.rod_limit_gon
            if beyond.any():
                able &= ~beyond | (then <= np.arctan2(*_reach(take(self._projection_centres[n], active), now)) / GON)
        return able

    def _rods_surely_can(self, active: Indices, before: Array, low: Array, high: Array) -> bool:
        """Return whether all carriages can move from marks ``(3, m)`` into a range ``(k,)``, one axis after another.

        Compares the box of all marks with the box of all centres.
        """
        k = len(low)
        lowest, highest = before.min(axis=1), before.max(axis=1)
        lowest[:k], highest[:k] = np.minimum(lowest[:k], low), np.maximum(highest[:k], high)
        for n in (1, 2):
            reached_centres = take(self._projection_centres[n], active)
            least, most = reached_centres.min(axis=1), reached_centres.max(axis=1)
            x, y, _ = np.maximum(highest - least, most - lowest)
            if not math.hypot(x, y) < self._surely_within * (least[2] - highest[2]):
                return False
        return True

    @property
    def _surely_within(self) -> float:
        """Return a lateral reach of a rod at all depths, well within its limit."""
        return 0.99 * math.tan(self.variant.rod_limit_gon * GON)

    def _drum_centres(
        self,
        active: Indices,
        n: int,
        elements: Mapping[str, Array] = MappingProxyType({}),
        base_inside: BoolArray | None = None,
    ) -> Array:
        """Return the positions of centres by the drums ``(3, m)``, optionally with other elements or another base."""

        def drum(name: str) -> Array:
            if name in elements:
                return elements[name]
            return take(self._drums[name].at, active) if name in self._drums else np.zeros(active.size)

        inside = take(self._base_inside, active) if base_inside is None else base_inside
        x, y, z = self._shares(n, inside) * drum("bx"), -drum(f"by{n}"), drum(f"bz{n}")
        if "common_phi" in self._drums:
            tilt = (drum("common_phi") - self.variant.elements["common_phi"].zero) * GON
            x, z = x * np.cos(tilt) + z * np.sin(tilt), z * np.cos(tilt) - x * np.sin(tilt)
        return np.array([x, y, z])

    def _shares(self, n: int, inside: BoolArray) -> Array:
        """Return the X positions of projectors ``(m,)``, as shares of bx."""
        left, right = self.variant.centres_on_base
        return np.where(inside == (n == 1), left, right)

    # --- pictures -------------------------------------------------------------------------------------

    def load(self, active: Indices, projector: int, name: str) -> None:
        """Mount a photograph on the carriers of a projector, by hand."""
        photographs = [each[name] for each in self._photographs]
        laid = np.zeros((3, self.instruments))
        shift, turn = self._laying_sigmas
        for each in active:
            upside_down = 200.0 if photographs[each].placement == "upside down" else 0.0
            laid[:, each] = self._rngs[each].standard_normal(3) * (shift, shift, turn) + (0.0, 0.0, upside_down)
        self._carriers[projector] = Carriers(photographs, laid)
        self._levers = None

    def unload(self, active: Indices, projector: int) -> None:
        """Remove the photographs from the carriers of a projector."""
        del self._carriers[projector]
        self._levers = None

    def loaded(self, projector: int) -> str:
        """Return the name of the photograph in a projector, empty for none."""
        carriers = self._carriers.get(projector)
        return carriers.name if carriers else ""

    def carriers(self, projector: int) -> Carriers:
        """Return the carriers of a projector, which hold pictures."""
        return self._carriers[projector]

    # --- the space rods and the view ------------------------------------------------------------------

    def _stand(self, active: Indices, n: int) -> None:
        """Compute the poses of projectors from their elements, the base and their faults."""
        omega, phi, kappa = (self._really(active, f"{name}{n}") * GON for name in ("omega", "phi", "kappa"))
        turned = rotation(omega, phi, kappa)
        self._missed[n][:, active] = mxv(turned, take(self._axes[n], active))
        if "common_phi" in self._drums:
            common = rotation(0.0, self._really(active, "common_phi") * GON, 0.0)
            self._common[:, :, active] = common
            turned = mxm(common, turned)
        bundles = self._bundles[n]
        bundles.turned[:, :, active] = turned
        bundles.swung[:, :, active] = plane_rotation(kappa)
        put(self._drums[f"c{n}"].position(active), active, bundles.c)
        self._shift(active, n, self._drum_centres(active, n))

    def _shift(self, active: Indices, n: int, reached_centres: Array) -> None:
        """Move the projectors, with unchanged rotation, to the positions by base, by and bz, given as ``(3, m)``."""
        base = (self._really(active, name) for name in ("bx", f"by{n}", f"bz{n}"))
        place = projection_centre(self._shares(n, take(self._base_inside, active)), *base)
        centre = place + take(self._missed[n], active) - take(self._axes[n], active)
        if "common_phi" in self._drums:
            centre = mxv(take(self._common, active), centre)
        put(centre, active, self._bundles[n].centre)
        put(reached_centres, active, self._projection_centres[n])

    def _really(self, active: Indices, name: str) -> Array:
        if name not in self._drums:
            return np.zeros(active.size)
        position = self._drums[name].position(active)
        return position - self.variant.elements[name].zero if name in COUNTED_FROM_ZERO else position

    def pose(self, active: Indices, projector: int) -> tuple[Array, Array]:
        """Return the true poses of projectors: centres ``(3, m)`` in mm and rotations ``(3, 3, m)``."""
        bundles = self._bundles[projector].take(active)
        return bundles.centre, bundles.turned

    def readings_at(self, active: Indices, place: Array) -> dict[str, Array]:
        """Return the counter readings ``(m,)``, unrounded, with the marks at positions ``(3, m)``."""
        guides = np.moveaxis(self._guides[:, :, active], -1, 0)
        carriage = np.asarray(np.linalg.solve(guides, place.T[:, :, None])[:, :, 0].T, dtype=float)
        free = self._carriages.position_without_periodic_error(active, carriage)
        return {axis: self._unrounded(active, row, free[row]) for row, axis in enumerate(AXES)}

    def mark(self, active: Indices) -> Array:
        """Return the true positions of the floating marks ``(3, m)``."""
        return mxv(take(self._guides, active), self._carriages.position(active))

    def _mark_on_carrier(self, active: Indices, projector: int, bundles: ProjectorBundles, mark: Array) -> Array:
        """Return the positions ``(2, m)`` in mm on carriers to which the space rods project marks ``(3, m)``."""
        local, rods = self._local[projector], self._rods[projector]
        return place_on_carrier(
            mark,
            bundles.centre,
            bundles.turned,
            bundles.c,
            bundles.principal_point,
            None if local is None else take(local, active),
            None if rods is None else take(rods, active),
        )

    def eyepiece(self, active: Indices, eye: int, name: str) -> Array:
        """Return dx, dy ``(2, m)`` in um at photo scale of an image point from the mark, nan outside the field."""
        return self._in_eyepiece(active, eye, name, self.mark(active))

    def both_eyepieces(self, active: Indices, name: str) -> Array:
        """Return dx, dy in the left eyepiece and dx, dy in the right one ``(4, m)``, as `eyepiece` does."""
        mark = self.mark(active)
        return np.concatenate([self._in_eyepiece(active, eye, name, mark) for eye in (1, 2)])

    def _in_eyepiece(self, active: Indices, eye: int, name: str, mark: Array) -> Array:
        straight = take(self._levers_stand.uncrossed, active)
        ways = ((eye, straight), (3 - eye, ~straight))
        for projector, looking in ways:
            if projector in self._carriers and looking.all():
                return self._seen_in(active, projector, name, mark)
        seen = np.full((2, active.size), np.nan)
        for projector, looking in ways:
            if projector in self._carriers and looking.any():
                seen[:, looking] = self._seen_in(active[looking], projector, name, mark[:, looking])
        return seen

    def _seen_in(self, active: Indices, projector: int, name: str, mark: Array) -> Array:
        bundles = self._bundles[projector].take(active)
        displacement = self._carriers[projector].point(active, name) - self._mark_on_carrier(
            active, projector, bundles, mark
        )
        turned = mxv(bundles.swung, displacement)
        shown = take(self._levers_stand.signs[projector], active) * turned
        return np.where(length_of(displacement) <= self.variant.field_radius_mm, shown, np.nan)

    # --- levers, prisms, collars ----------------------------------------------------------------------

    @property
    def _levers_stand(self) -> FittingEffects:
        if self._levers is None:
            signs = {n: 1e3 * self._mirrored(carriers.polarity) for n, carriers in self._carriers.items()}
            self._levers = FittingEffects(
                self._straight(), signs, np.array([self._wheel_senses(axis) for axis in AXES])
            )
        return self._levers

    def _straight(self) -> BoolArray:
        if "triangulation" in self.variant.fittings:
            return np.asarray(self._fittings["triangulation"] == POSITIONS_OF["triangulation"].index("back"))
        return self._base_inside.copy()

    def _mirrored(self, polarity: str) -> Array:
        signs = np.ones((2, self.instruments))
        for row, name in enumerate(("diapositive", "dove")):
            if name not in self.variant.fittings:
                continue
            right = np.where(self._base_inside, _RIGHT[polarity, "inside"][name], _RIGHT[polarity, "outside"][name])
            signs[row, self._fittings[name] != right] = -1.0
        return signs

    def _wheel_senses(self, axis: str) -> Array:
        collar = f"{axis.lower()}collar"
        if collar not in self.variant.fittings:
            return np.ones(self.instruments)
        polarity = next((carriers.polarity for carriers in self._carriers.values()), "positive")
        return np.where(self._fittings[collar] == _RIGHT[polarity, "inside"][collar], 1.0, -1.0)


def _reach(centre: Array, mark: Array) -> tuple[Array, Array]:
    """Return the distances of marks ``(3, m)`` beside centres ``(3, m)`` and below them ``(m,)``."""
    return np.hypot(mark[0] - centre[0], mark[1] - centre[1]), centre[2] - mark[2]


def build_batch(
    instrument: Instrument, photographs: Sequence[Mapping[str, Photograph]], seeds: Sequence[int]
) -> AutographBatch:
    """Return the instruments of a scenario, one per seed, with their photographs, none mounted."""
    rngs = [np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(INSTRUMENT_STREAM,))) for seed in seeds]
    return AutographBatch(
        VARIANTS[instrument.variant],
        [draw_condition(instrument, seed) for seed in seeds],
        photographs,
        (instrument.laying_sigma_mm, instrument.laying_sigma_gon),
        rngs,
    )
