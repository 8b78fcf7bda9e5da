"""The assembled plotter: projectors, carriages, fittings, pictures, and the view through the eyepieces."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from a7sim.geometry import GON, Array, length_of, mxv, rotation, transposed
from a7sim.instrument.carriers import Carrier
from a7sim.instrument.optics import projector_seen, view, wheel_senses
from a7sim.instrument.recorder import Recorder
from a7sim.instrument.refusals import OutOfRange, SettingsConflict, UnknownName
from a7sim.instrument.spindles import Counter, Spindle
from a7sim.manual import LEAST_COUNT, POSITIONS_OF, RIGHT_FITTINGS, VARIANTS, Element, Variant
from a7sim.scenario.schema import FORMAT_MM, Condition, Instrument, ProjectorCondition
from a7sim.scene.photograph import Photograph

INSTRUMENT_STREAM = 3
"""Spawn key of the instrument's random numbers; the scene's come before, the operator's after."""

MARK_RADIUS_MM = 0.02
"""The floating mark, 40 um across at photo scale."""

_CENTRES_AND_BASE = ("bx", "by1", "by2", "bz1", "bz2")


class Autograph:
    """A plotter worked by its handles. Lengths in mm, angles in gon, all as its counters count them.

    Every method that moves something raises a Refusal and moves nothing when the instrument cannot do it.
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
        self.plan_gear = "1-1-1"
        self.height_gear = "1"
        self._condition = condition or Condition()
        self._photographs = dict(photographs or {})
        self._laying_sigmas = laying_sigmas
        self._rng = rng or np.random.default_rng(0)
        self._spindles = {name: self._element_spindle(name, e) for name, e in variant.elements.items()}
        self._carriages = {
            axis: Spindle(low, high, variant.carriages_at_rest[axis], play=self._condition.carriage_backlash_mm)
            for axis, (low, high) in variant.carriages.items()
        }
        self._counters = {axis: Counter() for axis in variant.carriages}
        self._guides = _guides_of(self._condition)
        self._carriers: dict[int, Carrier] = {}
        self.base_mode = variant.base_modes[0]
        self.fittings = RIGHT_FITTINGS["positive", self.base_mode]
        self._poses: dict[int, tuple[Array, Array]] = {}

    def _element_spindle(self, name: str, element: Element) -> Spindle:
        condition = self._condition
        angular = element.unit == "gon"
        return Spindle.of(
            element,
            condition.backlash_gon if angular else condition.backlash_mm,
            condition.setting_sigma_gon if angular else condition.setting_sigma_mm,
            self._zero_error(name),
        )

    def _zero_error(self, name: str) -> float:
        if name == "bx":
            return self._condition.bx_zero_mm
        projector = self._projector_condition(int(name[-1]))
        return {
            "c": projector.principal_distance_mm,
            "kappa": projector.kappa_zero_gon,
            "phi": projector.phi_zero_gon,
            "omega": projector.omega_zero_gon,
            "by": projector.by_zero_mm,
            "bz": projector.bz_zero_mm,
        }[name[:-1]]

    def _projector_condition(self, projector: int) -> ProjectorCondition:
        return self._condition.left if projector == 1 else self._condition.right

    # --- elements -------------------------------------------------------------------------------------

    def element(self, name: str) -> float:
        """Return what the counter of an element shows. Raises SettingsConflict if the variant has none such."""
        return self._spindle(name).shown

    def set_element(self, name: str, value: float) -> None:
        """Set an element through its counter, to the least count."""
        spindle = self._spindle(name)
        target = round(value / LEAST_COUNT) * LEAST_COUNT
        if name in _CENTRES_AND_BASE and spindle.allows(target):
            self._refuse_if_rods_cannot(elements={name: target})
        spindle.turn_to(target, self._rng)
        self._poses.clear()

    def _spindle(self, name: str) -> Spindle:
        if name not in self._spindles:
            raise SettingsConflict(f"an {self.variant.name} has no {name}")
        return self._spindles[name]

    def element_data(self, name: str) -> Element:
        """Return range and zero of an element. Raises SettingsConflict if the variant has none such."""
        self._spindle(name)
        return self.variant.elements[name]

    def set_base_mode(self, mode: str) -> None:
        """Set the Zeiss parallelogram to base 'inside' or 'outside'."""
        if mode not in self.variant.base_modes:
            raise SettingsConflict(f"an {self.variant.name} has no base {mode}")
        self._refuse_if_rods_cannot(base_mode=mode)
        self.base_mode = mode
        self._poses.clear()

    def set_fitting(self, name: str, position: str) -> None:
        """Put a fitting into one of its two positions."""
        if position not in POSITIONS_OF[name]:
            raise UnknownName(f"expected {' or '.join(POSITIONS_OF[name])}, got {position}")
        self.fittings = replace(self.fittings, **{name: position})

    def reset(self) -> None:
        """Run every element that has a counter zero to it, base inside, fittings for a positive, presets off."""
        for name, spindle in self._spindles.items():
            if name not in ("c1", "c2"):
                spindle.turn_to(self.variant.elements[name].zero, self._rng)
        self.base_mode = self.variant.base_modes[0]
        self.fittings = RIGHT_FITTINGS["positive", self.base_mode]
        for counter in self._counters.values():
            counter.clear()
        self._poses.clear()

    # --- carriages, counters, gears -------------------------------------------------------------------

    def counter(self, axis: str) -> float:
        """Return the reading of the X, Y or Z counter."""
        return self._counters[axis].reading(self._carriages[axis].at)

    def counter_text(self, axis: str) -> str:
        """Return the reading of a counter with the decimals that it shows."""
        return f"{self.counter(axis):.{self._counters[axis].decimals}f}"

    def counter_limits(self, axis: str) -> tuple[float, float]:
        """Return the counter readings at the two ends of a carriage."""
        low, high = self.variant.carriages[axis]
        return self._counters[axis].reading(low), self._counters[axis].reading(high)

    def counter_at_rest(self, axis: str) -> float:
        """Return the counter reading where a carriage stands when the instrument is at rest."""
        return self._counters[axis].reading(self.variant.carriages_at_rest[axis])

    def preset(self, axis: str, reading: float) -> None:
        """Make a counter show a reading where its carriage stands."""
        self._counters[axis].preset(reading, self._carriages[axis].at)

    def drive(self, axis: str, reading: float) -> None:
        """Run a carriage until its counter shows a reading."""
        self._move(axis, self._counters[axis].position(reading))

    def wheel(self, axis: str, amount: float) -> None:
        """Turn a handwheel by so many counter units; its collar decides which way the carriage goes."""
        sense = wheel_senses(self.fittings, self._polarity())[axis]
        step = sense * amount / self._counters[axis].units_per_mm
        self._move(axis, self._carriages[axis].at + step)

    def _move(self, axis: str, position: float) -> None:
        spindle = self._carriages[axis]
        at_end = min(max(position, spindle.low), spindle.high)
        if abs(at_end - position) <= self._counters[axis].half_a_count:
            position = at_end
        if not spindle.allows(position):
            low, high = self.counter_limits(axis)
            got = self._counters[axis].reading(position)
            raise OutOfRange(f"{axis} expected {low:.2f} to {high:.2f} on its counter, got {got:.10g}")
        self._refuse_if_rods_cannot(carriages={axis: position})
        spindle.turn_to(position, self._rng)

    def set_height_gear(self, gear: str | float) -> None:
        """Engage a height gear by its combination or by its counter units a mm."""
        if isinstance(gear, str):
            if gear not in self.variant.height_gears:
                known = ", ".join(self.variant.height_gears)
                raise UnknownName(f"expected one of the combinations {known}, got {gear}")
            engaged = self.variant.height_gears[gear]
            units, decimals, self.height_gear = engaged.units_per_mm, engaged.decimals, gear
        else:
            if not 0.0 < gear <= 100.0:
                raise OutOfRange(f"expected more than 0 to 100 units a mm, got {gear:.10g}")
            units, decimals, self.height_gear = gear, 2, f"{gear:.10g}"
        self._counters["Z"].engage(units, decimals, self._carriages["Z"].at)

    def _refuse_if_rods_cannot(
        self,
        carriages: Mapping[str, float] | None = None,
        elements: Mapping[str, float] | None = None,
        base_mode: str | None = None,
    ) -> None:
        """Refuse what brings a rod beyond its limit, or further beyond it where `reset` has left it so."""
        for projector in (1, 2):
            inclination = self._rod_inclination(projector, carriages or {}, elements or {}, base_mode or self.base_mode)
            if inclination > max(self.variant.rod_limit_gon, self._rod_inclination(projector, {}, {}, self.base_mode)):
                raise OutOfRange(
                    f"expected space rods within {self.variant.rod_limit_gon:.0f} gon of the plumb line, "
                    f"got {inclination:.0f} gon at projector {projector}"
                )

    def _rod_inclination(
        self, projector: int, carriages: Mapping[str, float], elements: Mapping[str, float], base_mode: str
    ) -> float:
        at = {axis: spindle.at for axis, spindle in self._carriages.items()} | dict(carriages)
        x, y, z = self._nominal_centre(projector, elements, base_mode)
        return math.atan2(math.hypot(at["X"] - x, at["Y"] - y), z - at["Z"]) / GON

    def _nominal_centre(
        self, projector: int, changed: Mapping[str, float], base_mode: str
    ) -> tuple[float, float, float]:
        def drum(name: str) -> float:
            spindle = self._spindles.get(name)
            return changed.get(name, spindle.at if spindle else 0.0)

        at_origin = 1 if base_mode == "inside" else 2
        x = 0.0 if projector == at_origin else drum("bx")
        return x, -drum(f"by{projector}"), drum(f"bz{projector}")

    # --- pictures -------------------------------------------------------------------------------------

    @property
    def catalogue(self) -> list[str]:
        """Names of the photographs in the drawer and in the carriers."""
        return list(self._photographs)

    def load(self, projector: int, name: str) -> None:
        """Put a photograph on a carrier, by hand, in place of any that lies there."""
        if name not in self._photographs:
            raise UnknownName(f"expected one of {', '.join(self.catalogue)}, got {name}")
        other = self._carriers.get(3 - projector)
        if other is not None and other.photograph.name == name:
            raise SettingsConflict(f"picture {name} lies in projector {3 - projector}")
        photograph = self._photographs[name]
        shift, turn = self._laying_sigmas
        dx, dy, dkappa = self._rng.standard_normal(3) * (shift, shift, turn)
        upside_down = 200.0 if photograph.laid == "upside down" else 0.0
        self._carriers[projector] = Carrier(photograph, (float(dx), float(dy), float(dkappa) + upside_down))

    def unload(self, projector: int) -> None:
        """Take the photograph off a carrier."""
        self.carrier(projector)
        del self._carriers[projector]

    def loaded(self, projector: int) -> str | None:
        """Return the name of the photograph in a projector, or None."""
        carrier = self._carriers.get(projector)
        return carrier.photograph.name if carrier else None

    def carrier(self, projector: int) -> Carrier:
        """Return a carrier that holds a picture. Raises SettingsConflict when there is none in it."""
        if projector not in self._carriers:
            raise SettingsConflict(f"there is no picture in projector {projector}")
        return self._carriers[projector]

    def centre_picture(self, projector: int, dx: float, dy: float, dkappa: float) -> None:
        """Shift (mm) and turn (gon) a picture on its carrier, counted from where it was laid."""
        limits = (self.variant.centring_mm, self.variant.centring_mm, self.variant.centring_gon)
        for value, limit in zip((dx, dy, dkappa), limits, strict=True):
            if not abs(value) <= limit:
                raise OutOfRange(f"expected a shift or turn of -{limit:g} to {limit:g}, got {value:.10g}")
        self.carrier(projector).centre(dx, dy, dkappa)

    def _polarity(self) -> str:
        for carrier in self._carriers.values():
            return carrier.photograph.polarity
        return "positive"

    # --- the space rods and the view ------------------------------------------------------------------

    def pose(self, projector: int) -> tuple[Array, Array]:
        """Return where a projector really stands: centre ``(3,)`` in mm and rotation ``(3, 3)``.

        Base in: O' = (0, -by', bz'), O" = (bx, -by", bz"); base out exchanges the X (geometry.md).
        """
        if projector not in self._poses:
            angles = (self._really(f"{name}{projector}") for name in ("omega", "phi", "kappa"))
            turned = rotation(*(angle * GON for angle in angles))
            at_origin = 1 if self.base_mode == "inside" else 2
            x = 0.0 if projector == at_origin else self._really("bx")
            missed = 1e-3 * np.array(self._projector_condition(projector).axes_um)
            centre = np.array([x, -self._really(f"by{projector}"), self._really(f"bz{projector}")])
            self._poses[projector] = (centre + mxv(turned, missed) - missed, turned)
        return self._poses[projector]

    def _really(self, name: str) -> float:
        """Return where an element stands, angles of tilt counted from their counter zero."""
        if name not in self._spindles:
            return 0.0
        position = self._spindles[name].position
        return position - self.variant.elements[name].zero if name[:3] in ("phi", "ome") else position

    def mark_in_model(self) -> Array:
        """Return where the floating mark really stands in the instrument frame, ``(3,)`` in mm."""
        carriage = np.array([self._carriages[axis].position for axis in "XYZ"])
        return np.asarray(self._guides @ carriage)

    def readings_at(self, place: Array) -> dict[str, float]:
        """Return what the counters would show, unrounded, with the mark at a place ``(3,)`` of the frame.

        Part of the truth: no command of the language asks it.
        """
        carriage = np.linalg.solve(self._guides, place)
        return {
            axis: counter.offset + counter.units_per_mm * float(position)
            for (axis, counter), position in zip(self._counters.items(), carriage, strict=True)
        }

    def mark_on_carrier(self, projector: int) -> Array:
        """Return the place ``(2,)`` in mm on a carrier where the space rod brings the floating mark."""
        centre, turned = self.pose(projector)
        x, y, z = transposed(turned) @ (self.mark_in_model() - centre)
        scale = -self._spindles[f"c{projector}"].position / z
        fault = self._projector_condition(projector).principal_point_um
        return np.array([scale * x + 1e-3 * fault[0], scale * y + 1e-3 * fault[1]])

    def eyepiece(self, eyepiece: int, name: str) -> tuple[float, float] | None:
        """Return dx, dy in um at photo scale of an image point from the mark, None outside the field of view."""
        projector = projector_seen(eyepiece, self.fittings)
        carrier = self._carriers.get(projector)
        place = carrier.point(name) if carrier else None
        if carrier is None or place is None:
            return None
        displacement = place - self.mark_on_carrier(projector)
        if length_of(displacement) > self.variant.field_radius_mm:
            return None
        dx, dy = self._view(projector, carrier) @ displacement
        return float(1e3 * dx), float(1e3 * dy)

    def stereo(self, name: str) -> tuple[float, float] | None:
        """Return px, py in um at photo scale, left eye minus right eye, None unless both eyes see the point."""
        left, right = self.eyepiece(1, name), self.eyepiece(2, name)
        if left is None or right is None:
            return None
        return left[0] - right[0], left[1] - right[1]

    def picture(self, eyepiece: int, columns: int, rows: int, magnification: float) -> Array:
        """Return grey values 0..1, shape ``(rows, columns)``, of what an eyepiece shows about the mark.

        At magnification 1 the longer side spans the field of view. Outside the field and without a picture
        all is dark.
        """
        projector = projector_seen(eyepiece, self.fittings)
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
            grey = content(film) if content else np.full((rows, columns), 0.5)
            if carrier.photograph.polarity == "negative":
                grey = 1.0 - grey
            inside = np.abs(film).max(axis=0) <= FORMAT_MM / 2.0
            grey = np.where(inside, grey, 0.0)
        distance = length_of(seen)
        grey = np.where(distance <= self.variant.field_radius_mm, grey, 0.0)
        return np.asarray(np.where(distance <= max(MARK_RADIUS_MM, 0.75 * pitch), 1.0, grey))

    def _view(self, projector: int, carrier: Carrier) -> Array:
        return view(
            self.fittings,
            carrier.photograph.polarity,
            self.base_mode,
            self._really(f"kappa{projector}"),
        )


def _guides_of(condition: Condition) -> Array:
    """Return the matrix ``(3, 3)`` from positions on the spindles to places in the frame."""
    x, y, z = condition.carriage_scale_ppm
    xy, xz, yz = condition.carriage_skew_ppm
    return np.eye(3) + 1e-6 * np.array([[x, xy, xz], [0.0, y, yz], [0.0, 0.0, z]])


def build_autograph(instrument: Instrument, photographs: Mapping[str, Photograph], seed: int) -> Autograph:
    """Return the instrument of a scenario with its photographs in the drawer."""
    return Autograph(
        VARIANTS[instrument.variant],
        instrument.condition,
        photographs,
        instrument.serial,
        (instrument.laying_sigma_mm, instrument.laying_sigma_gon),
        np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(INSTRUMENT_STREAM,))),
    )
