"""Many plotters of one kind held as arrays, each with its own pictures and faults: the twin of `Autograph`.

`who` are the indices ``(m,)`` of the instruments that are worked; what comes in and goes out has them as its last axis.
An instrument that cannot do something does not do it, and says why when asked by `refused`.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.geometry import GON, Array, length_of, mxv, plane_rotation
from a7sim.instrument.autograph import COUNTED_FROM_ZERO, MOVE_CENTRES, guides_of
from a7sim.instrument.condition import INSTRUMENT_STREAM, condition_of, local_coefficients, zero_error
from a7sim.instrument.projection import place_of_centre, place_on_carrier, pose
from a7sim.instrument.spindles import APPROXIMATIONS, UNITS_A_DRUM
from a7sim.manual import COUNTER_DECIMALS, LEAST_COUNT, POSITIONS_OF, RIGHT_FITTINGS, VARIANTS, Variant
from a7sim.scenario.schema import Condition, Instrument, ProjectorCondition
from a7sim.scene.camera import fiducial_places
from a7sim.scene.photograph import Photograph

Who = npt.NDArray[np.intp]
Truths = npt.NDArray[np.bool_]

_AXES = "XYZ"
NEAR_A_TIE = 1e-6
"""Of the last decimal."""


_RIGHT = {
    arrangement: {name: POSITIONS_OF[name].index(position) for name, position in fittings.as_words().items()}
    for arrangement, fittings in RIGHT_FITTINGS.items()
}
"""Which of its two positions each fitting has by rights, by polarity and base."""


def of(values: Array, who: Who) -> Array:
    """Return the values ``(..., m)`` of some instruments, laid out as those of all: indexing would transpose them."""
    return values.take(who, axis=-1)


def rounded(values: Array, decimals: int) -> Array:
    """Return values rounded as the counters of one instrument round them: a tie by what the number exactly is.

    Wheels turn by thousandths, so that ties are common; numpy scales before it rounds and would take some for halves.
    """
    scaled = values * 10.0**decimals
    ties = np.abs(scaled - np.floor(scaled) - 0.5) < NEAR_A_TIE
    nearest = np.round(values, decimals)
    if ties.any():
        nearest[ties] = [round(value, decimals) for value in values[ties].tolist()]
    return np.asarray(nearest + 0.0)


@dataclass(frozen=True)
class Runouts:
    """The errors of screws that repeat with every turn: amplitudes in mm and phases ``(instruments,)``, lead in mm."""

    amplitude: Array
    lead: float
    phase: Array

    def at(self, who: Who, position: Array) -> Array:
        """Return by how much the nuts have gone further ``(m,)`` than the turns say, mm."""
        return np.asarray(self.amplitude[who] * np.sin(2.0 * math.pi * position / self.lead + self.phase[who]))


class Drums:
    """A spindle of every instrument: what the drum shows, where the shaft follows it with play and setting error."""

    def __init__(
        self,
        at: float,
        low: float,
        high: float,
        endless: bool,
        play: Array,
        sigma: Array,
        fault: Array,
        runouts: Runouts | None = None,
    ) -> None:
        self.low, self.high, self.endless = low, high, endless
        self.at = np.full(fault.shape, at)
        self._shaft = self.at.copy()
        self._error = np.zeros(fault.shape)
        self._half_play, self._sigma, self._fault = play / 2.0, sigma, fault
        self._runouts = runouts

    def position(self, who: Who) -> Array:
        """Return where the shafts really stand ``(m,)``."""
        position = self._shaft[who] + self._error[who] + self._fault[who]
        return np.asarray(position if self._runouts is None else position + self._runouts.at(who, position))

    def position_free_of_runout(self, who: Who, place: Array) -> Array:
        """Return where the shafts would stand ``(m,)`` without the errors that their turns repeat."""
        position = place
        if self._runouts is not None:
            for _ in range(APPROXIMATIONS):
                position = place - self._runouts.at(who, position)
        return position

    def shown(self, who: Who) -> Array:
        """Return what the counters show ``(m,)``."""
        shown = rounded(self.at[who], COUNTER_DECIMALS)
        return rounded(shown % self.high, COUNTER_DECIMALS) if self.endless else np.asarray(shown + 0.0)

    def allows(self, values: Array) -> Truths:
        """Return which values the drum can be turned to."""
        return np.asarray((values >= self.low - 1e-9) & (values <= self.high + 1e-9))

    def after(self, who: Who, amounts: Array) -> Array:
        """Return to what values ``(m,)`` the drums come when they are turned by so much."""
        values = self.at[who] + amounts
        return np.asarray(values % self.high if self.endless else values)

    def turn_to(self, who: Who, values: Array, rngs: Sequence[np.random.Generator] = ()) -> None:
        """Turn the drums to values ``(m,)`` that they allow; with dice, by their counters (see `Spindle.turn_to`)."""
        if self.endless:
            values = values + self.high * np.round((self.at[who] - values) / self.high)
        self.at[who] = values
        half = self._half_play[who]
        self._shaft[who] = np.minimum(np.maximum(self._shaft[who], values - half), values + half)
        for session in who[self._sigma[who] > 0.0] if rngs else ():
            self._error[session] = self._sigma[session] * rngs[session].standard_normal()


class Carriers:
    """A picture of the same name on a carrier of every instrument, each laid and centred in its own way."""

    def __init__(self, photographs: Sequence[Photograph], laid: Array) -> None:
        self.name = photographs[0].name
        self.polarity = photographs[0].polarity
        self.photographs = photographs
        self.laid = laid
        self.centring = np.zeros_like(laid)
        self._turn = np.zeros((2, 2, laid.shape[1]))
        self._shift = np.zeros((2, laid.shape[1]))
        self._films: dict[str, Array] = {}
        self.centre(np.arange(laid.shape[1]), self.centring)

    def centre(self, who: Who, values: Array) -> None:
        """Shift and turn the pictures ``(3, m)``, mm and gon, from where they were laid."""
        self.centring[:, who] = values
        dx, dy, turn = self.laid[:, who] + values
        self._turn[:, :, who] = plane_rotation(turn * GON)
        self._shift[:, who] = dx, dy

    def point(self, who: Who, name: str) -> Array:
        """Return where an image point lies on the carriers ``(2, m)``, nan where a picture has none such."""
        film = self._films.get(name)
        if film is None:
            nowhere = np.full(2, np.nan)
            places = [photograph.points.get(name) for photograph in self.photographs]
            columns = np.array([nowhere if place is None else place for place in places]).T
            film = self._films[name] = np.ascontiguousarray(columns)
        return np.asarray(mxv(of(self._turn, who), of(film, who)) + of(self._shift, who))

    def fiducial_displacements(self, who: Who) -> tuple[tuple[str, ...], Array]:
        """Return names and displacements ``(2, n, m)`` of the fiducials from their collimating marks."""
        fiducials = self.photographs[0].fiducials
        names, calibrated = fiducial_places(self.photographs[0].camera)
        marks = calibrated[:, [names.index(name) for name in fiducials.names]]
        film = np.stack([self.photographs[session].fiducials.xy for session in who], axis=-1)
        placed = np.einsum("ijm,jnm->inm", self._turn[:, :, who], film) + self._shift[:, None, who]
        return fiducials.names, np.asarray(placed - marks[:, :, None])

    def sketch(self, who: Who) -> dict[str, Array]:
        """Return the places ``(2, m)`` of points on the paper prints, nan where a print has it not."""
        names = dict.fromkeys(name for session in who for name in self.photographs[session].sketch.names)
        nowhere = np.full(2, np.nan)
        prints = [self.photographs[session].sketch for session in who]
        places = {name: [each.get(name) for each in prints] for name in names}
        return {
            name: np.array([nowhere if place is None else place for place in each]).T for name, each in places.items()
        }


class Fleet:
    """Plotters worked by their handles, all together. Lengths in mm, angles in gon, as the counters count them."""

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
        nothing = np.zeros(self.instruments)
        self._carriages = {
            axis: Drums(
                variant.carriages_at_rest[axis],
                low,
                high,
                False,
                carriage_play,
                nothing,
                nothing,
                self._carriage_runouts(axis),
            )
            for axis, (low, high) in variant.carriages.items()
            for at in (variant.carriages_at_rest[axis],)
        }
        self._slip_shares = self._of_conditions(lambda condition: condition.counter_slip_share)
        self._units = {axis: scale.units_per_mm for axis, scale in variant.scales.items()}
        self._decimals = dict.fromkeys(_AXES, COUNTER_DECIMALS)
        self._offsets = {axis: np.full(self.instruments, scale.at_origin) for axis, scale in variant.scales.items()}
        self._guides = np.stack([guides_of(condition) for condition in conditions], axis=-1)
        self._principal_points = {
            n: 1e-3 * self._of_projectors(n, lambda projector: projector.principal_point_um) for n in (1, 2)
        }
        self._rods = {n: self._where_any(1e-3 * self._of_projectors(n, lambda each: each.rod_um)) for n in (1, 2)}
        self._local = {n: self._local_errors(n) for n in (1, 2)}
        self._axes = {n: 1e-3 * self._of_projectors(n, lambda projector: projector.axes_um) for n in (1, 2)}
        self._carriers: dict[int, Carriers] = {}
        self._base_inside = np.ones(self.instruments, dtype=bool)
        self._fittings = {name: np.zeros(self.instruments, dtype=np.intp) for name in POSITIONS_OF}
        self._put_right_fittings(everywhere)
        self._centres = {n: np.zeros((3, self.instruments)) for n in (1, 2)}
        self._turned = {n: np.zeros((3, 3, self.instruments)) for n in (1, 2)}
        self._swung = {n: np.zeros((2, 2, self.instruments)) for n in (1, 2)}
        """By the swing of a projector, which its picture is seen with."""
        for n in (1, 2):
            self._stand(everywhere, n)

    def _of_conditions(self, value: Callable[[Condition], float]) -> Array:
        return np.array([value(condition) for condition in self._conditions])

    def _of_projectors(self, n: int, values: Callable[[ProjectorCondition], Sequence[float]]) -> Array:
        return np.array([values(each.left if n == 1 else each.right) for each in self._conditions]).T

    def _local_errors(self, n: int) -> Array | None:
        found = [local_coefficients(each.left if n == 1 else each.right) for each in self._conditions]
        shape = next((each.shape for each in found if each is not None), None)
        if shape is None:
            return None
        return np.stack([np.zeros(shape) if each is None else each for each in found], axis=-1)

    def _where_any(self, values: Array) -> Array | None:
        return values if values.any() else None

    def _carriage_runouts(self, axis: str) -> Runouts | None:
        place = _AXES.index(axis)
        amplitude = 1e-3 * self._of_conditions(lambda condition: condition.carriage_periodic_um[place])
        phase = GON * self._of_conditions(lambda condition: condition.carriage_periodic_phase_gon[place])
        return Runouts(amplitude, self.variant.carriage_lead_mm, phase) if amplitude.any() else None

    def _element_drums(self, name: str) -> Drums:
        element = self.variant.elements[name]
        angular = element.unit == "gon"
        play = self._of_conditions(lambda each: each.backlash_gon if angular else each.backlash_mm)
        sigma = self._of_conditions(lambda each: each.setting_sigma_gon if angular else each.setting_sigma_mm)
        fault = self._of_conditions(lambda each: zero_error(each, name))
        return Drums(element.zero, element.low, element.high, element.endless, play, sigma, fault)

    # --- refusals -------------------------------------------------------------------------------------

    def refused(self, who: Who) -> dict[int, list[str]]:
        """Return what was refused since the last asking, by instrument."""
        return {int(each): self._refusals.pop(int(each)) for each in who if int(each) in self._refusals}

    def _refuse(self, who: Who, why: str, number: int = -222) -> None:
        for each in who:
            self._refusals.setdefault(int(each), []).append(f'{number},"{why}"')

    # --- elements -------------------------------------------------------------------------------------

    def elements(self, who: Who, names: Sequence[str]) -> dict[str, Array]:
        """Return what the counters of elements show ``(m,)``."""
        return {name: self._drums[name].shown(who) for name in names}

    def set_element(self, who: Who, name: str, values: Array) -> None:
        """Set an element through its counters to values ``(m,)``, to the least count."""
        self._run_element(who, name, np.round(values / LEAST_COUNT) * LEAST_COUNT, self._rngs)

    def turn_element(self, who: Who, name: str, amounts: Array) -> None:
        """Turn the drums of an element by so much ``(m,)``, to wherever between two counts that is."""
        self._run_element(who, name, self._drums[name].after(who, amounts) if name in self._drums else amounts)

    def _run_element(self, who: Who, name: str, targets: Array, rngs: Sequence[np.random.Generator] = ()) -> None:
        if name not in self._drums:
            self._refuse(who, f"an {self.variant.name} has no {name}", -221)
            return
        drums = self._drums[name]
        allowed = drums.allows(targets)
        if name in MOVE_CENTRES:
            allowed &= self._rods_can(who, elements={name: targets})
        self._refuse(who[~allowed], f"Data out of range;{name}: beyond its range or that of the rods")
        who, targets = who[allowed], targets[allowed]
        drums.turn_to(who, targets, rngs)
        for n in (1, 2):
            if name in ("bx", "common_phi") or name.endswith(str(n)):
                self._stand(who, n)

    def set_base_mode(self, who: Who, mode: str) -> None:
        """Set base inside or outside."""
        inside = mode == "inside"
        able = self._rods_can(who, base_inside=inside)
        self._refuse(who[~able], f"Data out of range;base {mode}: beyond the range of the rods")
        self._base_inside[who[able]] = inside
        for n in (1, 2):
            self._stand(who, n)

    def fitting(self, who: Who, name: str) -> npt.NDArray[np.str_]:
        """Return the positions ``(m,)`` in which a fitting stands."""
        return np.array(POSITIONS_OF[name])[self._fittings[name][who]]

    def set_fitting(self, who: Who, name: str, position: str) -> None:
        """Put a fitting into one of its two positions."""
        self._fittings[name][who] = POSITIONS_OF[name].index(position)

    def reset(self, who: Who) -> None:
        """Run every element that has a counter zero to it, base inside, fittings for a positive, presets off."""
        for name, drums in self._drums.items():
            if name not in ("c1", "c2"):
                drums.turn_to(who, np.full(who.size, self.variant.elements[name].zero), self._rngs)
        self._base_inside[who] = True
        self._put_right_fittings(who)
        for axis, scale in self.variant.scales.items():
            self._offsets[axis][who] = scale.at_origin
        for n in (1, 2):
            self._stand(who, n)

    def _put_right_fittings(self, who: Who) -> None:
        for name, position in RIGHT_FITTINGS["positive", "inside"].as_words().items():
            self.set_fitting(who, name, position)

    # --- carriages, counters, gears -------------------------------------------------------------------

    def counter(self, who: Who, axis: str) -> Array:
        """Return what the X, Y or Z counters show ``(m,)``."""
        reading = self._offsets[axis][who] + self._units[axis] * self._carriages[axis].at[who]
        return rounded(reading, self._decimals[axis])

    def preset(self, who: Who, axis: str, reading: float) -> None:
        """Make the counters show a reading where their carriages stand."""
        self._offsets[axis][who] = (
            round(reading, self._decimals[axis]) - self._units[axis] * self._carriages[axis].at[who]
        )

    def set_height_gear(self, who: Who, gear: str | float) -> None:
        """Engage a height gear; all instruments have the same."""
        units, decimals = float(gear) if not isinstance(gear, str) else 0.0, COUNTER_DECIMALS
        if isinstance(gear, str):
            engaged = self.variant.height_gears[gear]
            units, decimals = engaged.units_per_mm, engaged.decimals
        position = self._carriages["Z"].at[who]
        reading = self._offsets["Z"][who] + self._units["Z"] * position
        self._units["Z"], self._decimals["Z"] = units, decimals
        self._offsets["Z"][who] = rounded(reading, decimals) - units * position

    def drive(self, who: Who, axis: str, readings: Array) -> Truths:
        """Run carriages until their counters show readings ``(m,)``; return which went."""
        wanted = rounded(readings, self._decimals[axis])
        went = self._move(who, axis, (wanted - self._offsets[axis][who]) / self._units[axis])
        slipping = went & (self._slip_shares[who] > 0.0)
        if slipping.any():
            again = (wanted[slipping] - self._offsets[axis][who[slipping]]) / self._units[axis]
            off = np.abs(again - self._carriages[axis].at[who[slipping]]) > self._half_a_count(axis)
            self._move(who[slipping][off], axis, again[off], silently=True)
        return went

    def _half_a_count(self, axis: str) -> float:
        return float(0.5000001 * 10.0 ** -self._decimals[axis] / self._units[axis])

    def wheel(self, who: Who, axis: str, amounts: Array) -> Truths:
        """Turn handwheels by so many counter units ``(m,)``; their collars decide which way the carriages go."""
        step = self._wheel_senses(who, axis) * amounts / self._units[axis]
        return self._move(who, axis, self._carriages[axis].at[who] + step)

    def _wheel_senses(self, who: Who, axis: str) -> Array:
        collar = f"{axis.lower()}collar"
        if collar not in self.variant.fittings:
            return np.ones(who.size)
        polarity = next((carriers.polarity for carriers in self._carriers.values()), "positive")
        return np.where(self._fittings[collar][who] == _RIGHT[polarity, "inside"][collar], 1.0, -1.0)

    def _move(self, who: Who, axis: str, positions: Array, silently: bool = False) -> Truths:
        drums = self._carriages[axis]
        at_end = np.clip(positions, drums.low, drums.high)
        positions = np.where(np.abs(at_end - positions) <= self._half_a_count(axis), at_end, positions)
        allowed = drums.allows(positions) & self._rods_can(who, carriages={axis: positions})
        if not silently:
            self._refuse(who[~allowed], f"Data out of range;{axis}: beyond its range or that of the rods")
        who, positions = who[allowed], positions[allowed]
        self._slip(who, axis, drums.at[who], positions)
        drums.turn_to(who, positions)
        return np.asarray(allowed)

    def _slip(self, who: Who, axis: str, before: Array, after: Array) -> None:
        """Let counters miss carries on the way from one position ``(m,)`` to another (see `Counter.passed`)."""
        for i in np.flatnonzero(self._slip_shares[who] > 0.0):
            each = who[i]
            first, last = (
                math.floor((self._offsets[axis][each] + self._units[axis] * position[i]) / UNITS_A_DRUM)
                for position in (before, after)
            )
            if first != last:
                missed = self._rngs[each].binomial(abs(last - first), self._slip_shares[each])
                self._offsets[axis][each] -= math.copysign(missed * UNITS_A_DRUM, last - first)

    def _rods_can(
        self,
        who: Who,
        carriages: Mapping[str, Array] | None = None,
        elements: Mapping[str, Array] | None = None,
        base_inside: bool | None = None,
    ) -> Truths:
        """Return where a change brings no rod beyond its limit, nor further beyond it."""
        able = np.ones(who.size, dtype=bool)
        for n in (1, 2):
            beside, below = self._rods_reach(who, n, carriages or {}, elements or {}, base_inside)
            if (beside < self._surely_within * below).all():
                continue
            then = np.arctan2(beside, below) / GON
            beyond = then > self.variant.rod_limit_gon
            if beyond.any():
                able &= ~beyond | (then <= np.arctan2(*self._rods_reach(who, n, {}, {}, None)) / GON)
        return able

    @property
    def _surely_within(self) -> float:
        """How far to the side a rod may reach for all the depth, well within its limit."""
        return 0.99 * math.tan(self.variant.rod_limit_gon * GON)

    def _rods_reach(
        self,
        who: Who,
        n: int,
        carriages: Mapping[str, Array],
        elements: Mapping[str, Array],
        base_inside: bool | None,
    ) -> tuple[Array, Array]:
        """Return how far the mark lies beside the centre of a projector and below it ``(m,)``, as the drums tell."""
        at = {axis: drums.at[who] for axis, drums in self._carriages.items() if axis not in carriages} | dict(carriages)
        inside = self._base_inside[who] if base_inside is None else np.full(who.size, base_inside)

        def drum(name: str) -> Array:
            if name in elements:
                return elements[name]
            return self._drums[name].at[who] if name in self._drums else np.zeros(who.size)

        x, y, z = self._shares(n, inside) * drum("bx"), -drum(f"by{n}"), drum(f"bz{n}")
        if "common_phi" in self._drums:
            tilt = (drum("common_phi") - self.variant.elements["common_phi"].zero) * GON
            x, z = x * np.cos(tilt) + z * np.sin(tilt), z * np.cos(tilt) - x * np.sin(tilt)
        return np.hypot(at["X"] - x, at["Y"] - y), z - at["Z"]

    def _shares(self, n: int, inside: Truths) -> Array:
        """Return where projectors stand along X ``(m,)``, as shares of bx."""
        left, right = self.variant.centres_on_base
        return np.where(inside == (n == 1), left, right)

    # --- pictures -------------------------------------------------------------------------------------

    def load(self, who: Who, projector: int, name: str) -> None:
        """Put a photograph on the carriers of a projector, by hand."""
        photographs = [each[name] for each in self._photographs]
        laid = np.zeros((3, self.instruments))
        shift, turn = self._laying_sigmas
        for each in who:
            upside_down = 200.0 if photographs[each].laid == "upside down" else 0.0
            laid[:, each] = self._rngs[each].standard_normal(3) * (shift, shift, turn) + (0.0, 0.0, upside_down)
        self._carriers[projector] = Carriers(photographs, laid)

    def unload(self, who: Who, projector: int) -> None:
        """Take the photographs off the carriers of a projector."""
        del self._carriers[projector]

    def loaded(self, projector: int) -> str:
        """Return the name of the photograph in a projector, empty for none."""
        carriers = self._carriers.get(projector)
        return carriers.name if carriers else ""

    def carriers(self, projector: int) -> Carriers:
        """Return the carriers of a projector, which hold pictures."""
        return self._carriers[projector]

    # --- the space rods and the view ------------------------------------------------------------------

    def _stand(self, who: Who, n: int) -> None:
        """Put the projectors where their elements, the base and their faults bring them."""
        omega, phi, kappa = (self._really(who, f"{name}{n}") * GON for name in ("omega", "phi", "kappa"))
        base = (self._really(who, name) for name in ("bx", f"by{n}", f"bz{n}"))
        place = place_of_centre(self._shares(n, self._base_inside[who]), *base)
        common_phi = self._really(who, "common_phi") * GON if "common_phi" in self._drums else None
        centre, turned = pose(omega, phi, kappa, place, of(self._axes[n], who), common_phi)
        self._centres[n][:, who], self._turned[n][:, :, who] = centre, turned
        self._swung[n][:, :, who] = plane_rotation(kappa)

    def _really(self, who: Who, name: str) -> Array:
        if name not in self._drums:
            return np.zeros(who.size)
        position = self._drums[name].position(who)
        return position - self.variant.elements[name].zero if name in COUNTED_FROM_ZERO else position

    def pose(self, who: Who, projector: int) -> tuple[Array, Array]:
        """Return where projectors really stand: centres ``(3, m)`` in mm and rotations ``(3, 3, m)``."""
        return of(self._centres[projector], who), of(self._turned[projector], who)

    def readings_at(self, who: Who, place: Array) -> dict[str, Array]:
        """Return what the counters would show ``(m,)``, unrounded, with the marks at places ``(3, m)``."""
        guides = np.moveaxis(self._guides[:, :, who], -1, 0)
        carriage = np.linalg.solve(guides, place.T[:, :, None])[:, :, 0].T
        return {
            axis: self._offsets[axis][who]
            + self._units[axis] * self._carriages[axis].position_free_of_runout(who, position)
            for axis, position in zip(_AXES, carriage, strict=True)
        }

    def mark_on_carrier(self, who: Who, projector: int) -> Array:
        """Return the places ``(2, m)`` in mm on carriers where the space rods bring the floating marks."""
        carriage = np.array([self._carriages[axis].position(who) for axis in _AXES])
        local, rods = self._local[projector], self._rods[projector]
        return place_on_carrier(
            mxv(of(self._guides, who), carriage),
            *self.pose(who, projector),
            self._drums[f"c{projector}"].position(who),
            of(self._principal_points[projector], who),
            None if local is None else of(local, who),
            None if rods is None else of(rods, who),
        )

    def eyepiece(self, who: Who, eye: int, name: str) -> Array:
        """Return dx, dy ``(2, m)`` in um at photo scale of an image point from the mark, nan outside the field."""
        straight = self._base_inside[who]
        if "triangulation" in self.variant.fittings:
            straight = self._fittings["triangulation"][who] == POSITIONS_OF["triangulation"].index("back")
        seen = np.full((2, who.size), np.nan)
        for projector in (1, 2):
            looking = straight == (projector == eye)
            if looking.all() and projector in self._carriers:
                return self._seen_in(who, projector, name)
            if looking.any() and projector in self._carriers:
                seen[:, looking] = self._seen_in(who[looking], projector, name)
        return seen

    def _seen_in(self, who: Who, projector: int, name: str) -> Array:
        carriers = self._carriers[projector]
        displacement = carriers.point(who, name) - self.mark_on_carrier(who, projector)
        turned = mxv(of(self._swung[projector], who), displacement)
        shown = 1e3 * self._mirrored(who, carriers.polarity) * turned
        return np.where(length_of(displacement) <= self.variant.field_radius_mm, shown, np.nan)

    def _mirrored(self, who: Who, polarity: str) -> Array:
        signs = np.ones((2, who.size))
        inside = self._base_inside[who]
        for row, name in enumerate(("diapositive", "dove")):
            if name not in self.variant.fittings:
                continue
            right = np.where(inside, _RIGHT[polarity, "inside"][name], _RIGHT[polarity, "outside"][name])
            signs[row, self._fittings[name][who] != right] = -1.0
        return signs


def build_fleet(instrument: Instrument, photographs: Sequence[Mapping[str, Photograph]], seeds: Sequence[int]) -> Fleet:
    """Return the instruments of a scenario, one a seed, with their photographs in their drawers."""
    rngs = [np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(INSTRUMENT_STREAM,))) for seed in seeds]
    return Fleet(
        VARIANTS[instrument.variant],
        [condition_of(instrument, seed) for seed in seeds],
        photographs,
        (instrument.laying_sigma_mm, instrument.laying_sigma_gon),
        rngs,
    )
