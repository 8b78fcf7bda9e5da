"""Controls of the instruments: elements, counters and carriages, and the position of the mark by their readings."""

from collections.abc import Mapping, Sequence

import numpy as np

from a7sim.batch import Indices, put, take
from a7sim.geometry import GON, Array, mxv, plane_rotation
from a7sim.operator.driving.driver import BoolArray, InstrumentDriver
from a7sim.operator.driving.job import Job, ModelJob
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.plotters import LEAST_COUNT, VARIANTS, Variant

STEADY_ELEMENTS = ("kappa1", "kappa2", "by1", "by2", "bx")
"""Elements on which the positions of images depend to first order."""

MAX_ROUNDING_COUNTS = 0.51
"""Maximum difference of a counter and the drum beneath it, in counts."""

TURN_DECIMALS = 5
"""Decimals of drum turns."""


class Controls:
    """Controls of a batch of instruments. Lengths in mm at instrument scale, readings as counters show them.

    The last axis of stored arrays contains all sessions, the last axis of parameters the active sessions.
    """

    def __init__(self, operators: OperatorBatch, driver: InstrumentDriver, job: Job) -> None:
        self.operators = operators
        self.driver = driver
        self.job = job
        self.model: ModelJob
        self.manual: Variant = VARIANTS["A7"]
        self.units_per_mm = 1.0
        """Units of the Z counter."""
        self.z = np.zeros(operators.size)
        """Depth of the mark below the base line at the last reading of the counters."""
        self.c = job.certificate.c
        self._plane_units_per_mm = _broadcast_by_dimensions(np.ones(2))
        """Units of the X and Y counters per mm."""
        self._settings = {name: np.zeros(operators.size) for name in STEADY_ELEMENTS}
        self._drum_positions: dict[str, Array] = {}
        """Drum positions set by this object ``(sessions,)``, between two counts too; nan if unknown."""
        self._origin_readings = np.zeros((3, operators.size))

    def prepare(self, active: Indices) -> None:
        """Move the instruments to their zeros, engage the gears, set base and projection height."""
        plan, driver = self.job.plan, self.driver
        gear = self._read_manual()
        driver.set_height_gear(active, 1.0, plan.plan_gear)
        driver.reset(active)
        self.spend_setting(active, 6)
        self._drum_positions.clear()
        self.run_element(active, "bx", np.full(active.size, plan.bx))
        driver.drive(active, {"Z": np.full(active.size, -plan.projection_height)})
        self._count_from_origin(active, "XY")
        driver.drive(active, dict(zip("XY", self._origin_readings[:2, active], strict=True)))
        height = driver.counter(active, "Z")
        driver.set_height_gear(active, gear, plan.plan_gear)
        self.give_up_on_errors(active, "preparing the instrument")
        self._origin_readings[2, active] = driver.counter(active, "Z") - self.units_per_mm * height

    def take_over(self, active: Indices) -> None:
        """Take over instruments that are prepared by the job sheet, with counters not yet preset."""
        self._read_manual()
        self._drum_positions.clear()
        self._count_from_origin(active, "XYZ")

    def _read_manual(self) -> str | float:
        """Read the data of the plotter; return the height gear of the job sheet."""
        gear = self.job.plan.height_gear
        self.manual = VARIANTS[self.driver.variant()]
        self.units_per_mm = self.manual.height_gears[gear].units_per_mm if isinstance(gear, str) else gear
        self._plane_units_per_mm = _broadcast_by_dimensions(
            np.array([self.manual.scales[axis].units_per_mm for axis in "XY"])
        )
        return gear

    def _count_from_origin(self, active: Indices, axes: str) -> None:
        for axis in axes:
            self._origin_readings["XYZ".index(axis), active] = self.manual.scales[axis].at_origin

    def begin(self, active: Indices, model: ModelJob) -> None:
        """Start a model whose pictures are mounted."""
        self.model = model
        self.read_settings(active)

    def preset(self, active: Indices, readings: tuple[float, float, float]) -> None:
        """Preset the counters that can be preset to these readings at the mark."""
        wanted = {a: reading for a, reading in zip("XYZ", readings, strict=True) if self.manual.scales[a].preset}
        before = self.driver.counters(active)
        self.spend_setting(active)
        self.driver.preset(active, wanted)
        self.give_up_on_errors(active, "presetting the counters")
        for axis, reading in wanted.items():
            self._origin_readings["XYZ".index(axis), active] += reading - before["XYZ".index(axis)]

    def shift_counter(self, active: Indices, axis: str, amount: Array) -> Array:
        """Change a counter reading by an amount ``(m,)``, the carriage on a full count; return the actual change."""
        self.drive(active, {axis: self.driver.counter(active, axis)})
        before = self.driver.counter(active, axis)
        self.spend_setting(active)
        self.driver.preset_one(active, axis, np.round(before + amount, 2))
        self.give_up_on_errors(active, f"presetting the {axis} counter")
        change = np.round(self.driver.counter(active, axis) - before, 2)
        self._origin_readings["XYZ".index(axis), active] += change
        return np.asarray(change)

    def set_height_gear(self, active: Indices, gear: str | float) -> None:
        """Engage a height gear; the Z counter continues from its reading, the carriage on a full count."""
        self.drive(active, {"Z": self.driver.counter(active, "Z")})
        height = (self.driver.counter(active, "Z") - self._origin_readings[2, active]) / self.units_per_mm
        self.spend_setting(active)
        self.driver.set_height_gear(active, gear, self.job.plan.plan_gear)
        self.give_up_on_errors(active, f"engaging the height gear {gear}")
        self.units_per_mm = self.manual.height_gears[gear].units_per_mm if isinstance(gear, str) else gear
        self._origin_readings[2, active] = self.driver.counter(active, "Z") - self.units_per_mm * height

    def spend_setting(self, active: Indices, times: int = 1) -> None:
        """Add the duration of a setting."""
        self.operators.spend(active, times * self.operators.observer.seconds_to_set, "setting")

    # --- elements -------------------------------------------------------------------------------------

    def elements(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        """Read the counters of elements ``(m,)``; an element that the instrument does not have reads zero."""
        available = [name for name in names if name in self.manual.elements]
        readings = self.driver.elements(active, available) if available else {}
        return {name: readings.get(name, np.zeros(active.size)) for name in names}

    def elements_from_zero(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        """Read the counters of elements ``(m,)`` minus their readings at zero.

        An element that the instrument does not have reads zero.
        """
        return {
            name: counts - (self.manual.elements[name].zero if name in self.manual.elements else 0.0)
            for name, counts in self.elements(active, names).items()
        }

    @property
    def has_parallax_elements(self) -> bool:
        """Whether y-parallaxes can be measured with by' and by", which not all plotters have."""
        return not self.manual.missing_elements("by1", "by2")

    def set_elements(self, active: Indices, settings: Mapping[str, Array]) -> None:
        """Set elements by their counters to values ``(m,)``, and add them to the book."""
        for name, value in settings.items():
            counts = counter_value(name, value)
            self.spend_setting(active)
            self.run_element(active, name, counts)
            self.give_up_on_errors(active, f"setting {name}")
            self.operators.enter(active, "", f"set {name}", counts)
        self.read_settings(self.operators.remaining(active))

    def set_if_changed(self, active: Indices, settings: Mapping[str, Array]) -> None:
        """Set the elements whose counters do not yet show the values ``(m,)``."""
        for name, wanted in settings.items():
            if not active.size:
                return
            difference = _difference(name, counter_value(name, wanted), self.elements(active, [name])[name])
            changed = self.operators.is_active(active) & (np.abs(difference) > LEAST_COUNT / 2.0)
            if changed.any():
                self.set_elements(active[changed], {name: wanted[changed]})

    def run_element(self, active: Indices, name: str, counts: Array) -> None:
        """Move an element to counts ``(m,)``, and record its position."""
        self.driver.set_element(active, name, counts)
        self._store_drum_position(active, name, counts)

    def exact_values(self, active: Indices, names: Sequence[str]) -> dict[str, Array]:
        """Read the positions of elements ``(m,)``, between two counts too if they were set by this object."""
        positions = {}
        for name, shown in self.elements(active, names).items():
            stored = self._drum_positions.get(name, np.full(self.operators.size, np.nan))[active]
            is_near = np.abs(_difference(name, stored, shown)) <= MAX_ROUNDING_COUNTS * LEAST_COUNT
            positions[name] = np.where(is_near, stored, shown)
        return positions

    def turn_elements(self, active: Indices, settings: Mapping[str, Array]) -> None:
        """Turn elements to values ``(m,)``, between two counts too, and add their readings to the book."""
        for name, wanted in settings.items():
            amounts = _difference(name, wanted, self.grab_drum(active, name))
            self.spend_setting(active)
            self.driver.turn_element(active, name, amounts)
            self._add_drum_turn(active, name, amounts)
            self.give_up_on_errors(active, f"turning {name}")
            self.operators.enter(active, "", f"set {name}", self.elements(active, [name])[name])
        self.read_settings(self.operators.remaining(active))

    def turn_if_changed(self, active: Indices, settings: Mapping[str, Array]) -> None:
        """Turn the elements that are not yet at the values ``(m,)``."""
        for name, wanted in settings.items():
            if not active.size:
                return
            difference = np.abs(_difference(name, wanted, self.exact_values(active, [name])[name]))
            changed = self.operators.is_active(active) & (difference >= 10.0**-TURN_DECIMALS)
            if changed.any():
                self.turn_elements(active[changed], {name: wanted[changed]})

    def grab_drum(self, active: Indices, name: str) -> Array:
        """Hold a drum for turning; return its position ``(m,)``."""
        position = self.exact_values(active, [name])[name]
        self._store_drum_position(active, name, position)
        return position

    def held_position(self, active: Indices, name: str) -> Array:
        """Return the position ``(m,)`` of a drum that was turned by this object."""
        return self._drum_positions[name][active]

    def _store_drum_position(self, active: Indices, name: str, position: Array) -> None:
        self._drum_positions.setdefault(name, np.full(self.operators.size, np.nan))[active] = position

    def _add_drum_turn(self, active: Indices, name: str, amounts: Array) -> None:
        self._drum_positions[name][active] += amounts.round(TURN_DECIMALS)

    def read_settings(self, active: Indices) -> None:
        """Read the settings on which the positions of images depend."""
        for name, counts in self.elements(
            active, [name for name in STEADY_ELEMENTS if name in self.manual.elements]
        ).items():
            self._settings[name][active] = counts

    def projector(self, side: int) -> int:
        """Return the projector of the left-hand (1) or the right-hand (2) photograph."""
        return self.model.left_projector if side == 1 else self.model.right_projector

    def bx(self, active: Indices) -> Array:
        """Return the base as set ``(m,)``, mm."""
        return take(self._settings["bx"], active)

    # --- positions ------------------------------------------------------------------------------------

    def counters(self, active: Indices) -> Array:
        """Read X, Y and Z ``(3, m)``, and record the depth of the mark."""
        readings = self.driver.counters(active)
        put((take(self._origin_readings[2], active) - readings[2]) / self.units_per_mm, active, self.z)
        return readings

    def displayed_levels(self, active: Indices, levels: Sequence[float]) -> Array:
        """Return Z readings ``(k, m)`` as the counters show them after driving there."""
        readings = []
        for level in levels:
            self.drive(active, {"Z": np.full(active.size, level)})
            self.give_up_on_errors(active, f"driving Z to {level:.2f}")
            readings.append(self.counters(active)[2])
        return np.array(readings)

    def drive(self, active: Indices, readings: Mapping[str, Array]) -> BoolArray:
        """Drive carriages to readings ``(m,)``; return which instruments reached them."""
        self.operators.spend(active, self.operators.observer.seconds_to_drive, "driving")
        return self.driver.drive(active, readings)

    def drive_z_to(self, active: Indices, height: Array) -> BoolArray:
        """Drive the mark to heights ``(m,)`` above the base line, mm, hence negative."""
        return self.drive(active, {"Z": self._origin_readings[2, active] + height * self.units_per_mm})

    def turn(self, active: Indices, wheels: Array, element: str | None = None, amounts: Array | None = None) -> None:
        """Turn the handwheels ``(2 or 3, m)`` in counter units, and the held drum of an element with them."""
        self.operators.spend(active, self.operators.observer.seconds_to_turn, "turning")
        self.driver.turn(active, wheels, element, amounts)
        if element is not None and amounts is not None:
            self._add_drum_turn(active, element, amounts)

    def give_up_on_errors(self, active: Indices, action: str) -> None:
        """Give up in sessions whose instrument rejected a command since the last check."""
        errors = self.driver.pop_errors(active)
        if errors:
            sessions = np.array(sorted(errors), dtype=np.intp)
            self.operators.give_up(
                sessions, lambda session: f"{action}: the instrument refuses: {'; '.join(errors[session][:2])}"
            )

    def model_position(self, active: Indices, readings: Array) -> Array:
        """Return readings ``(3, m)`` as x, y, z in mm: from the left-hand centre, the base line, downward."""
        offset = take(self._origin_readings, active)
        x, y = self.to_mm(readings[:2] - offset[:2])
        z = (offset[2] - readings[2]) / self.units_per_mm
        return np.array([x - self._centre_share(1) * self.bx(active), y, z])

    def frame_positions(self, active: Indices, readings: Array, level: Array) -> Array:
        """Return X, Y readings ``(2, n, m)`` at Z readings ``(m,)`` as positions x, y, z ``(3, n, m)`` in mm."""
        x, y = self.to_mm(readings - self._origin_readings[:2, None, active])
        x = x - self._centre_share(1) * self.bx(active)
        z = np.broadcast_to((self._origin_readings[2, active] - level) / self.units_per_mm, x.shape)
        return np.array([x, y, z])

    def under_centre(self, active: Indices, side: int) -> Array:
        """Return the X and Y readings ``(2, m)`` vertically below a photograph's centre, as given by by and bx."""
        below = np.array(
            [self._centre_share(side) * self.bx(active), -self._settings[f"by{self.projector(side)}"][active]]
        )
        return self.to_counter_units(below) + self._origin_readings[:2, active]

    def centre(self, active: Indices, side: int) -> Array:
        """Return the readings ``(3, m)`` of a photograph's centre, as given by elements and scales (P 3.1, 3.2)."""
        heights = self.elements_from_zero(active, [f"bz{self.projector(side)}"])[f"bz{self.projector(side)}"]
        below = self.under_centre(active, side)
        return np.array([*below, self._origin_readings[2, active] + self.units_per_mm * heights])

    def _centre_share(self, side: int) -> float:
        """Return the X position of a centre from the origin of the frame, as a share of bx."""
        return self.manual.centres_on_base[side - 1]

    def to_counter_units(self, shift_mm: Array) -> Array:
        """Return shifts ``(2, ...)`` in mm in units of the X and Y counters."""
        return np.asarray(self._plane_units_per_mm[shift_mm.ndim] * shift_mm)

    def to_mm(self, difference: Array) -> Array:
        """Return differences ``(2, ...)`` of X and Y readings in mm."""
        return np.asarray(difference / self._plane_units_per_mm[difference.ndim])

    @property
    def counter_units_per_mm(self) -> Array:
        """Units per mm ``(3,)`` of the X, Y and Z counters."""
        return np.array([*self._plane_units_per_mm[1], self.units_per_mm])

    def rotate_by_swing(self, active: Indices, side: int, print_position: Array) -> Array:
        """Return positions on paper prints ``(2, m)`` rotated by the swing of their photograph."""
        swing = wrap_gon(self._settings[f"kappa{self.projector(side)}"][active]) * GON
        return mxv(plane_rotation(swing), print_position)


def _broadcast_by_dimensions(units: Array) -> Mapping[int, Array]:
    """Return units per mm ``(2,)`` in shapes that broadcast with points, sessions of each, or neither."""
    return {1: units, 2: units[:, None], 3: units[:, None, None]}


def wrap_gon(gon: Array) -> Array:
    """Return angles within 200 gon of zero."""
    return np.asarray((gon + 200.0) % 400.0 - 200.0)


def counter_value(name: str, value: Array) -> Array:
    """Return the required counter reading of an element, kappa in 0..400."""
    return np.asarray(np.round(value % 400.0, 2) % 400.0 if name.startswith("kappa") else np.round(value, 2))


def _difference(name: str, value: Array, other: Array) -> Array:
    """Return the difference of two values of an element, the shorter way round for kappa."""
    return wrap_gon(value - other) if name.startswith("kappa") else np.asarray(value - other)


def side_name(side: int) -> str:
    """Return left or right for a side."""
    return "left" if side == 1 else "right"
