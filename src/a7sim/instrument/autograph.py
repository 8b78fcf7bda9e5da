"""The assembled plotter: projectors, carriages, fittings, pictures, and the view through the eyepieces."""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from typing import Any, Self

import numpy as np

from a7sim.deprecation import RenamedMember
from a7sim.geometry import GON, Array, length_of, mxv, transposed
from a7sim.instrument.carriers import Carrier
from a7sim.instrument.condition import INSTRUMENT_STREAM, draw_condition, local_coefficients, zero_error
from a7sim.instrument.errors import OutOfRangeError, SettingsConflictError, UnknownNameError
from a7sim.instrument.optics import effective_fittings, handwheel_senses, projector_in_view, view_matrix
from a7sim.instrument.projection import CameraAttitude, attitude_from_angles, place_on_carrier, pose, projection_centre
from a7sim.instrument.recorder import Recorder, Registration
from a7sim.instrument.spindles import Counter, PeriodicError, Spindle
from a7sim.plotters import LEAST_COUNT, POSITIONS_OF, REQUIRED_FITTINGS, VARIANTS, Element, Fittings, Gear, Variant
from a7sim.scenario.schema import FORMAT_MM, Condition, Instrument, ProjectorCondition, Scenario
from a7sim.scene import build_scene
from a7sim.scene.photograph import Photograph

MARK_RADIUS_MM = 0.02
"""Floating mark, 40 um across at photo scale."""

MOVE_CENTRES = ("bx", "by1", "by2", "bz1", "bz2", "common_phi")
COUNTED_FROM_ZERO = ("phi1", "phi2", "omega1", "omega2", "common_phi")
"""Tilts, whose counters do not read zero at zero tilt."""

CAMERA_CACHE_SIZE = 64
"""Number of recent tilts whose camera rotations are cached: bx, by and bz move a camera without rotating it."""

State = dict[str, Any]
"""State of an instrument as data for JSON."""


class Autograph:
    """Plotter operated by its controls. Lengths in mm, angles in gon, all as its counters read.

    Each method that moves something raises an AutographError and moves nothing if the instrument cannot do it. This
    class gives more access than the link does to an operator.

    >>> from a7sim import Autograph, Scenario
    >>> plotter = Autograph.from_scenario(Scenario.load("akwanga"), seed=7)
    >>> plotter.load(1, "101")
    >>> plotter.set_element("bx", 194.994)
    >>> plotter.element("bx")
    194.99
    """

    def __init__(
        self,
        variant: Variant,
        condition: Condition | None = None,
        photographs: Mapping[str, Photograph] | None = None,
        serial: str = "0",
        laying_sigmas: tuple[float, float] = (0.0, 0.0),
        rng: np.random.Generator | None = None,
    ) -> None:
        self.variant = variant
        self.serial = serial
        self.recorder = Recorder()
        self._taken: dict[str, float] = {}
        self.plan_gear = "1-1-1"
        self.height_gear = "1"
        self._condition = condition or Condition()
        self._photographs = dict(photographs or {})
        self._laying_sigmas = laying_sigmas
        self._rng = rng or np.random.default_rng(0)
        self._spindles = {name: self._element_spindle(name, e) for name, e in variant.elements.items()}
        self._carriages = {
            axis: Spindle(
                low,
                high,
                variant.carriages_at_rest[axis],
                play=self._condition.carriage_backlash_mm,
                periodic_error=_runout_of(self._condition, axis, variant.carriage_lead_mm),
            )
            for axis, (low, high) in variant.carriages.items()
        }
        self._counters = {
            axis: Counter(scale.units_per_mm, offset=scale.at_origin, slip_share=self._condition.counter_slip_share)
            for axis, scale in variant.scales.items()
        }
        self._guides = guide_matrix(self._condition)
        self._carriers: dict[int, Carrier] = {}
        self.base_mode = variant.base_modes[0]
        self.fittings = REQUIRED_FITTINGS["positive", self.base_mode]
        self._poses: dict[int, tuple[Array, Array]] = {}
        self._mark: Array | None = None
        self._nominal_centres: dict[int, tuple[float, float, float]] = {}
        projectors = {n: self._projector_condition(n) for n in (1, 2)}
        self._axes = {n: tuple(1e-3 * um for um in each.axes_um) for n, each in projectors.items()}
        self._principal_points = {n: 1e-3 * np.array(each.principal_point_um) for n, each in projectors.items()}
        self._local = {n: local_coefficients(each) for n, each in projectors.items()}
        self._rods = {n: 1e-3 * np.array(each.rod_um) if any(each.rod_um) else None for n, each in projectors.items()}

    @classmethod
    def from_parts(cls, instrument: Instrument, photographs: Mapping[str, Photograph], seed: int) -> Self:
        """Return the instrument of a scenario with its photographs, none mounted."""
        return cls(
            VARIANTS[instrument.variant],
            draw_condition(instrument, seed),
            photographs,
            instrument.serial,
            (instrument.laying_sigma_mm, instrument.laying_sigma_gon),
            np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(INSTRUMENT_STREAM,))),
        )

    @classmethod
    def from_scenario(cls, scenario: Scenario, seed: int) -> Self:
        """Return the instrument of a scenario, with the photographs and faults that a seed draws. Raises A7SimError."""
        return cls.from_parts(scenario.instrument, build_scene(scenario, seed).mountable, seed)

    of = RenamedMember("from_parts")
    of_scenario = RenamedMember("from_scenario")
    wheel = RenamedMember("turn_handwheel")
    time_taken = RenamedMember("pop_travel_times")
    register_again = RenamedMember("restore_registrations")

    def _element_spindle(self, name: str, element: Element) -> Spindle:
        condition = self._condition
        angular = element.unit == "gon"
        return Spindle.of(
            element,
            condition.backlash_gon if angular else condition.backlash_mm,
            condition.setting_sigma_gon if angular else condition.setting_sigma_mm,
            zero_error(condition, name),
        )

    def _projector_condition(self, projector: int) -> ProjectorCondition:
        return self._condition.left if projector == 1 else self._condition.right

    # --- elements -------------------------------------------------------------------------------------

    def element(self, name: str) -> float:
        """Return the counter reading of an element. Raises SettingsConflictError if the variant does not have it."""
        return self._spindle(name).shown

    def set_element(self, name: str, value: float) -> None:
        """Set an element by its counter, to the least count."""
        self._run_element(name, round(value / LEAST_COUNT) * LEAST_COUNT, self._rng)

    def turn_element(self, name: str, amount: float) -> None:
        """Turn the drum of an element by an amount of its counter, to any position between two counts."""
        self._run_element(name, self._spindle(name).value_after_turn(amount))

    def _run_element(self, name: str, target: float, rng: np.random.Generator | None = None) -> None:
        spindle = self._spindle(name)
        if name in MOVE_CENTRES and spindle.within_range(target):
            self._refuse_if_rods_cannot(elements={name: target})
        self._turn(name, target, rng)
        self._forget_poses(*(projector for projector in (1, 2) if name.endswith(str(projector))))

    def _turn(self, name: str, target: float, rng: np.random.Generator | None) -> None:
        spindle = self._spindles[name]
        before = spindle.at
        spindle.turn_to(target, rng)
        self._takes(name, abs(spindle.at - before) / self.variant.rates.of(self.variant.elements[name].unit))

    def _spindle(self, name: str) -> Spindle:
        if name not in self._spindles:
            raise SettingsConflictError(f"an {self.variant.name} has no {name}")
        return self._spindles[name]

    def element_data(self, name: str) -> Element:
        """Return range and zero of an element. Raises SettingsConflictError if the variant does not have it."""
        self._spindle(name)
        return self.variant.elements[name]

    def set_base_mode(self, mode: str) -> None:
        """Set the Zeiss parallelogram to base 'inside' or 'outside'."""
        if mode not in self.variant.base_modes:
            raise SettingsConflictError(f"an {self.variant.name} has no base {mode}")
        self._refuse_if_rods_cannot(base_mode=mode)
        if mode != self.base_mode:
            self._takes("base mode", self.variant.rates.lever)
        self.base_mode = mode
        self._forget_poses()

    def fitting(self, name: str) -> str:
        """Return the position of a fitting. Raises SettingsConflictError if the variant does not have it."""
        if name not in self.variant.fittings:
            raise SettingsConflictError(f"an {self.variant.name} has no fitting {name}")
        return self.fittings.as_words()[name]

    def set_fitting(self, name: str, position: str) -> None:
        """Set a fitting to one of its two positions."""
        self.fitting(name)
        if position not in POSITIONS_OF[name]:
            raise UnknownNameError(f"expected {' or '.join(POSITIONS_OF[name])}, got {position}")
        self._fit(replace(self.fittings, **{name: position}))

    def _fit(self, fittings: Fittings) -> None:
        before, after = self.fittings.as_words(), fittings.as_words()
        for name in before:
            if before[name] != after[name]:
                self._takes(name, self.variant.rates.lever)
        self.fittings = fittings

    def reset(self) -> None:
        """Move all elements with a counter zero to it, base inside, fittings for a positive, presets off."""
        for name in self._spindles:
            if name not in ("c1", "c2"):
                self._turn(name, self.variant.elements[name].zero, self._rng)
        if self.base_mode != self.variant.base_modes[0]:
            self._takes("base mode", self.variant.rates.lever)
        self.base_mode = self.variant.base_modes[0]
        self._fit(REQUIRED_FITTINGS["positive", self.base_mode])
        for counter in self._counters.values():
            counter.clear()
        self._forget_poses()

    def _takes(self, part: str, seconds: float) -> None:
        if seconds > 0.0:
            self._taken[part] = self._taken.get(part, 0.0) + seconds

    def pop_travel_times(self) -> dict[str, float]:
        """Return the seconds that each part has moved since the last call; parts that did not move are left out.

        The state changes at once: readings during a movement are those at its end.
        """
        taken, self._taken = self._taken, {}
        return taken

    # --- state ----------------------------------------------------------------------------------------

    def state(self, changes: int = 0) -> State:
        """Return the complete state for `restore`: part of the truth.

        Of the recorder it contains the changes after the first `changes` ones.
        """
        dice = self._rng.bit_generator.state
        return {
            "spindles": {name: list(each.state()) for name, each in self._spindles.items()},
            "carriages": {axis: list(each.state()) for axis, each in self._carriages.items()},
            "counters": {axis: list(each.state()) for axis, each in self._counters.items()},
            "gears": [self.plan_gear, self.height_gear],
            "base_mode": self.base_mode,
            "fittings": dict(self.fittings.as_words()),
            "carriers": {
                str(n): [each.photograph.name, list(each.placement), list(each.centring)]
                for n, each in sorted(self._carriers.items())
            },
            "dice": [str(dice["state"]["state"]), str(dice["state"]["inc"]), dice["has_uint32"], dice["uinteger"]],
            "registered": [
                [each.number, each.point, [list(reading) for reading in each.readings], each.struck]
                for each in self.recorder.changes[changes:]
            ],
        }

    def restore(self, state: State) -> None:
        """Restore a state; its registrations are added to the present ones."""
        for parts, name in ((self._spindles, "spindles"), (self._carriages, "carriages"), (self._counters, "counters")):
            for key, each in state[name].items():
                parts[key].restore(each)
        self.plan_gear, self.height_gear = state["gears"]
        self.base_mode = state["base_mode"]
        self.fittings = Fittings(**state["fittings"])
        self._carriers = {
            int(n): Carrier(self._photographs[name], tuple(laid), tuple(centring))
            for n, (name, laid, centring) in state["carriers"].items()
        }
        inner, increment, has_uint32, uinteger = state["dice"]
        self._rng.bit_generator.state = {
            **self._rng.bit_generator.state,
            "state": {"state": int(inner), "inc": int(increment)},
            "has_uint32": has_uint32,
            "uinteger": uinteger,
        }
        self.restore_registrations(state)
        self._taken.clear()
        self._mark = None
        self._forget_poses()

    def restore_registrations(self, state: State) -> None:
        """Add the registrations of a state to the present ones."""
        for number, point, readings, struck in state["registered"]:
            self.recorder.apply(Registration(number, point, tuple((name, text) for name, text in readings), struck))

    # --- carriages, counters, gears -------------------------------------------------------------------

    def counter(self, axis: str) -> float:
        """Return the reading of the X, Y or Z counter."""
        return self._counters[axis].reading(self._carriages[axis].at)

    def counter_text(self, axis: str) -> str:
        """Return the reading of a counter with its decimals."""
        return self._counters[axis].text(self._carriages[axis].at)

    @property
    def counter_scales(self) -> dict[str, tuple[float, float]]:
        """Reading of each counter at the origin of the frame, and its units per mm, by axis.

        Missed carries included.
        """
        return {axis: (each.offset, each.units_per_mm) for axis, each in self._counters.items()}

    def counter_limits(self, axis: str) -> tuple[float, float]:
        """Return the counter readings at the two ends of a carriage."""
        low, high = self.variant.carriages[axis]
        return self._counters[axis].reading(low), self._counters[axis].reading(high)

    def counter_at_rest(self, axis: str) -> float:
        """Return the counter reading of a carriage when the instrument is at rest."""
        return self._counters[axis].reading(self.variant.carriages_at_rest[axis])

    def preset(self, axis: str, reading: float) -> None:
        """Preset a counter to a reading at the present position of its carriage.

        Raises SettingsConflictError if the variant has a fixed scale there.
        """
        if not self.variant.scales[axis].preset:
            raise SettingsConflictError(f"an {self.variant.name} reads {axis} on a fixed scale")
        self._counters[axis].preset(reading, self._carriages[axis].at)

    def drive(self, axis: str, reading: float) -> None:
        """Drive a carriage until its counter shows a reading, and further if the counter slipped on the way."""
        counter = self._counters[axis]
        self._move(axis, counter.position(reading))
        if counter.slip_share and abs(counter.position(reading) - self._carriages[axis].at) > counter.half_count:
            with suppress(OutOfRangeError):
                self._move(axis, counter.position(reading))

    def turn_handwheel(self, axis: str, amount: float) -> None:
        """Turn a handwheel by an amount in counter units; its collar decides the direction of the carriage."""
        polarity = self._polarity()
        sense = handwheel_senses(self._acting_fittings(polarity), polarity)[axis]
        step = sense * amount / self._counters[axis].units_per_mm
        self._move(axis, self._carriages[axis].at + step)

    def _move(self, axis: str, position: float) -> None:
        spindle = self._carriages[axis]
        at_end = min(max(position, spindle.low), spindle.high)
        if abs(at_end - position) <= self._counters[axis].half_count:
            position = at_end
        if not spindle.within_range(position):
            low, high = self.counter_limits(axis)
            got = self._counters[axis].reading(position)
            raise OutOfRangeError(f"{axis} expected {low:.2f} to {high:.2f} on its counter, got {got:.10g}")
        self._refuse_if_rods_cannot(carriages={axis: position})
        before = spindle.at
        spindle.turn_to(position)
        self._mark = None
        self._takes(axis, abs(position - before) / self.variant.rates.carriage)
        self._counters[axis].advance(before, position, self._rng)

    def set_height_gear(self, gear: str | float) -> None:
        """Engage a height gear by its combination or by its counter units per mm."""
        if isinstance(gear, str):
            if gear not in self.variant.height_gears:
                known = ", ".join(self.variant.height_gears)
                raise UnknownNameError(f"expected one of the combinations {known}, got {gear}")
            engaged, name = self.variant.height_gears[gear], gear
        else:
            if not 0.0 < gear <= 100.0:
                raise OutOfRangeError(f"expected more than 0 to 100 units a mm, got {gear:.10g}")
            engaged, name = Gear(gear), f"{gear:.10g}"
        if name != self.height_gear:
            self._takes("height gear", self.variant.rates.gear)
        self.height_gear = name
        self._counters["Z"].engage(engaged.units_per_mm, engaged.decimals, self._carriages["Z"].at)

    def _refuse_if_rods_cannot(
        self,
        carriages: Mapping[str, float] | None = None,
        elements: Mapping[str, float] | None = None,
        base_mode: str | None = None,
    ) -> None:
        """Raise an error for a change that moves a rod beyond its limit, or further beyond it after `reset`."""
        here = [each.at for each in self._carriages.values()]
        reached = [carriages.get(axis, each.at) for axis, each in self._carriages.items()] if carriages else here
        for projector in (1, 2):
            inclination = self._rod_inclination(projector, reached, elements or {}, base_mode or self.base_mode)
            if inclination <= self.variant.rod_limit_gon:
                continue
            if inclination > self._rod_inclination(projector, here, {}, self.base_mode):
                raise OutOfRangeError(
                    f"expected space rods within {self.variant.rod_limit_gon:.0f} gon of the plumb line, "
                    f"got {inclination:.0f} gon at projector {projector}"
                )

    def _rod_inclination(
        self, projector: int, carriages: Sequence[float], elements: Mapping[str, float], base_mode: str
    ) -> float:
        at_x, at_y, at_z = carriages
        x, y, z = (
            self._nominal_centre(projector, elements, base_mode)
            if elements or base_mode != self.base_mode
            else self._present_nominal_centre(projector)
        )
        return math.atan2(math.hypot(at_x - x, at_y - y), z - at_z) / GON

    def _present_nominal_centre(self, projector: int) -> tuple[float, float, float]:
        if projector not in self._nominal_centres:
            self._nominal_centres[projector] = self._nominal_centre(projector, {}, self.base_mode)
        return self._nominal_centres[projector]

    def _nominal_centre(
        self, projector: int, changed: Mapping[str, float], base_mode: str
    ) -> tuple[float, float, float]:
        def drum(name: str) -> float:
            spindle = self._spindles.get(name)
            return changed.get(name, spindle.at if spindle else 0.0)

        x = self._share_of_base(projector, base_mode) * drum("bx")
        y, z = -drum(f"by{projector}"), drum(f"bz{projector}")
        if "common_phi" not in self._spindles:
            return x, y, z
        tilt = (drum("common_phi") - self.variant.elements["common_phi"].zero) * GON
        return x * math.cos(tilt) + z * math.sin(tilt), y, z * math.cos(tilt) - x * math.sin(tilt)

    def _share_of_base(self, projector: int, base_mode: str) -> float:
        """Return the X position of a projector as a share of bx; base out exchanges the two (geometry.md)."""
        on_the_left = (projector == 1) == (base_mode == "inside")
        return self.variant.centres_on_base[0 if on_the_left else 1]

    # --- pictures -------------------------------------------------------------------------------------

    @property
    def catalogue(self) -> list[str]:
        """Names of the available and the mounted photographs."""
        return list(self._photographs)

    def load(self, projector: int, name: str) -> None:
        """Mount a photograph on a carrier, by hand, in place of a mounted one."""
        if name not in self._photographs:
            raise UnknownNameError(f"expected one of {', '.join(self.catalogue)}, got {name}")
        other = self._carriers.get(3 - projector)
        if other is not None and other.photograph.name == name:
            raise SettingsConflictError(f"picture {name} lies in projector {3 - projector}")
        photograph = self._photographs[name]
        shift, turn = self._laying_sigmas
        dx, dy, dkappa = self._rng.standard_normal(3) * (shift, shift, turn)
        upside_down = 200.0 if photograph.placement == "upside down" else 0.0
        self._carriers[projector] = Carrier(photograph, (float(dx), float(dy), float(dkappa) + upside_down))
        self._takes(f"carrier {projector}", self.variant.rates.laying)

    def unload(self, projector: int) -> None:
        """Remove the photograph from a carrier."""
        self.carrier(projector)
        del self._carriers[projector]
        self._takes(f"carrier {projector}", self.variant.rates.laying)

    def loaded(self, projector: int) -> str | None:
        """Return the name of the photograph in a projector, or None."""
        carrier = self._carriers.get(projector)
        return carrier.photograph.name if carrier else None

    def carrier(self, projector: int) -> Carrier:
        """Return a carrier with a picture. Raises SettingsConflictError if it is empty."""
        if projector not in self._carriers:
            raise SettingsConflictError(f"there is no picture in projector {projector}")
        return self._carriers[projector]

    def centre_picture(self, projector: int, dx: float, dy: float, dkappa: float) -> None:
        """Shift (mm) and rotate (gon) a picture on its carrier, counted from its initial placement."""
        limits = (self.variant.centring_mm, self.variant.centring_mm, self.variant.centring_gon)
        for value, limit in zip((dx, dy, dkappa), limits, strict=True):
            if not abs(value) <= limit:
                raise OutOfRangeError(f"expected a shift or turn of -{limit:g} to {limit:g}, got {value:.10g}")
        carrier = self.carrier(projector)
        x, y, kappa = (abs(new - old) for new, old in zip((dx, dy, dkappa), carrier.centring, strict=True))
        rates = self.variant.rates
        self._takes(f"carrier {projector}", max(math.hypot(x, y) / rates.length, kappa / rates.angle))
        carrier.centre(dx, dy, dkappa)

    def _polarity(self) -> str:
        for carrier in self._carriers.values():
            return carrier.photograph.polarity
        return "positive"

    # --- the space rods and the view ------------------------------------------------------------------

    def _forget_poses(self, *projectors: int) -> None:
        """Discard cached poses, of all projectors if none is named."""
        for projector in projectors or (1, 2):
            self._poses.pop(projector, None)
            self._nominal_centres.pop(projector, None)

    def pose(self, projector: int) -> tuple[Array, Array]:
        """Return the true pose of a projector: centre ``(3,)`` in mm and rotation ``(3, 3)``."""
        if projector not in self._poses:
            tilts = [self._really(f"{name}{projector}") * GON for name in ("omega", "phi", "kappa")]
            share = self._share_of_base(projector, self.base_mode)
            base = [self._really(name) for name in ("bx", f"by{projector}", f"bz{projector}")]
            common_phi = self._really("common_phi") * GON if "common_phi" in self._spindles else None
            camera = _camera(*tilts, self._axes[projector])
            self._poses[projector] = pose(camera, projection_centre(share, *base), common_phi)
        return self._poses[projector]

    def _really(self, name: str) -> float:
        """Return the true position of an element, angles of tilt counted from their counter zero."""
        if name not in self._spindles:
            return 0.0
        position = self._spindles[name].position
        return position - self.variant.elements[name].zero if name in COUNTED_FROM_ZERO else position

    def mark_in_model(self) -> Array:
        """Return the true position of the floating mark in the instrument frame, ``(3,)`` in mm; read-only."""
        if self._mark is None:
            self._mark = self._guides @ np.array([self._carriages[axis].position for axis in "XYZ"])
            self._mark.flags.writeable = False
        return self._mark

    def readings_at(self, place: Array) -> dict[str, float]:
        """Return the counter readings, unrounded, with the mark at a position ``(3,)`` of the frame.

        Part of the truth: no command of the language returns it.
        """
        on_the_guides = dict(zip("XYZ", np.linalg.solve(self._guides, place).tolist(), strict=True))
        return {
            axis: counter.offset
            + counter.units_per_mm * self._carriages[axis].position_without_periodic_error(on_the_guides[axis])
            for axis, counter in self._counters.items()
        }

    def mark_on_carrier(self, projector: int) -> Array:
        """Return the position ``(2,)`` in mm on a carrier to which the space rod projects the floating mark."""
        return self.on_carrier(projector, self.mark_in_model())

    def on_carrier(self, projector: int, place: Array) -> Array:
        """Return the position ``(2,)`` in mm on a carrier to which the space rod projects a position ``(3,)`` of the
        frame.

        Part of the truth, except at the mark.
        """
        return place_on_carrier(
            place,
            *self.pose(projector),
            self._spindles[f"c{projector}"].position,
            self._principal_points[projector],
            self._local[projector],
            self._rods[projector],
        )

    def eyepiece(self, eyepiece: int, name: str) -> tuple[float, float] | None:
        """Return dx, dy in um at photo scale of an image point from the mark, None outside the field of view."""
        projector = projector_in_view(eyepiece, self.fittings)
        carrier = self._carriers.get(projector)
        place = carrier.point(name) if carrier else None
        if carrier is None or place is None:
            return None
        displacement = place - self.mark_on_carrier(projector)
        x, y = displacement.tolist()
        if math.sqrt(x * x + y * y) > self.variant.field_radius_mm:
            return None
        dx, dy = (self._view(projector, carrier) @ displacement).tolist()
        return 1e3 * dx, 1e3 * dy

    def stereo(self, name: str) -> tuple[float, float] | None:
        """Return px, py in um at photo scale, left eye minus right eye, None unless both eyes see the point."""
        left, right = self.eyepiece(1, name), self.eyepiece(2, name)
        if left is None or right is None:
            return None
        return left[0] - right[0], left[1] - right[1]

    def picture(self, eyepiece: int, columns: int, rows: int, magnification: float) -> Array:
        """Return grey values 0..1, shape ``(rows, columns)``, of the view of an eyepiece about the mark.

        At magnification 1 the longer side spans the field of view. Outside the field and without a picture all is dark.
        """
        projector = projector_in_view(eyepiece, self.fittings)
        carrier = self._carriers.get(projector)
        pitch = 2.0 * self.variant.field_radius_mm / (magnification * max(columns, rows))
        x, y = np.meshgrid(
            pitch * (np.arange(columns) - (columns - 1) / 2.0),
            -pitch * (np.arange(rows) - (rows - 1) / 2.0),
        )
        seen = np.array([x, y])
        if carrier is None:
            grey = np.zeros((rows, columns))
        else:
            offset = mxv(transposed(self._view(projector, carrier)), seen)
            film = carrier.on_film(offset + self.mark_on_carrier(projector)[:, None, None])
            content = carrier.photograph.content
            grey = content(film, pitch) if content else np.full((rows, columns), 0.5)
            if carrier.photograph.polarity == "negative":
                grey = 1.0 - grey
            inside = np.abs(film).max(axis=0) <= FORMAT_MM / 2.0
            grey = np.where(inside, grey, 0.0)
        distance = length_of(seen)
        grey = np.where(distance <= self.variant.field_radius_mm, grey, 0.0)
        return np.asarray(np.where(distance <= max(MARK_RADIUS_MM, 0.75 * pitch), 1.0, grey))

    def _view(self, projector: int, carrier: Carrier) -> Array:
        polarity = carrier.photograph.polarity
        return view_matrix(
            self._acting_fittings(polarity),
            polarity,
            self.base_mode,
            self._really(f"kappa{projector}"),
        )

    def _acting_fittings(self, polarity: str) -> Fittings:
        if len(self.variant.fittings) == len(POSITIONS_OF):
            return self.fittings
        return effective_fittings(self.fittings, polarity, self.base_mode, self.variant.fittings)


@lru_cache(maxsize=CAMERA_CACHE_SIZE)
def _camera(omega: float, phi: float, kappa: float, missed: tuple[float, ...]) -> CameraAttitude:
    """Return a camera rotated by angles in radians; read-only."""
    camera = attitude_from_angles(omega, phi, kappa, np.array(missed))
    camera.rotation.flags.writeable = False
    return camera


def _runout_of(condition: Condition, axis: str, lead: float) -> PeriodicError | None:
    place = "XYZ".index(axis)
    amplitude = condition.carriage_periodic_um[place]
    return (
        PeriodicError(1e-3 * amplitude, lead, condition.carriage_periodic_phase_gon[place] * GON) if amplitude else None
    )


def guide_matrix(condition: Condition) -> Array:
    """Return the matrix ``(3, 3)`` from positions on the spindles to positions in the frame."""
    x, y, z = condition.carriage_scale_ppm
    xy, xz, yz = condition.carriage_skew_ppm
    return np.eye(3) + 1e-6 * np.array([[x, xy, xz], [0.0, y, yz], [0.0, 0.0, z]])


def build_autograph(instrument: Instrument, photographs: Mapping[str, Photograph], seed: int) -> Autograph:
    """Return the instrument of a scenario with its photographs, none mounted."""
    return Autograph.from_parts(instrument, photographs, seed)
