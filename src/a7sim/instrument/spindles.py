"""Spindles with their drums: setting, reading and true movement."""

import math
from dataclasses import dataclass

import numpy as np

from a7sim.instrument.errors import OutOfRangeError
from a7sim.plotters import COUNTER_DECIMALS, Element

APPROXIMATIONS = 20
"""Number of iterations; each reduces the error by the slope of the periodic error, some hundredths."""

UNITS_A_DRUM = 1.0
"""Counter units per turn of the last drum, which carries to the next one as it passes zero."""


@dataclass(frozen=True, slots=True)
class PeriodicError:
    """Periodic error of a screw."""

    amplitude: float
    """mm."""
    lead: float
    """mm per turn."""
    phase: float = 0.0
    """Radians."""

    def at(self, position: float) -> float:
        """Return the excess travel of the nut over the turns, in mm."""
        return self.amplitude * math.sin(2.0 * math.pi * position / self.lead + self.phase)


@dataclass
class Spindle:
    """Spindle whose drum is turned by hand and whose shaft follows with play and a setting error."""

    low: float
    high: float
    at: float
    """Drum reading, unrounded."""
    endless: bool = False
    play: float = 0.0
    setting_sigma: float = 0.0
    zero_error: float = 0.0
    """Offset of the shaft from the drum reading."""
    periodic_error: PeriodicError | None = None

    def __post_init__(self) -> None:
        self._shaft = self.at
        self._error = 0.0

    @classmethod
    def of(cls, element: Element, play: float, setting_sigma: float, fault: float) -> "Spindle":
        """Return the spindle of an element, at its counter zero."""
        return cls(element.low, element.high, element.zero, element.endless, play, setting_sigma, fault)

    def state(self) -> tuple[float, float, float]:
        """Return drum and shaft positions and the setting error, for `restore`."""
        return self.at, self._shaft, self._error

    def restore(self, state: tuple[float, float, float]) -> None:
        """Restore a state."""
        self.at, self._shaft, self._error = state

    @property
    def position(self) -> float:
        """True position of the shaft, in mm or gon."""
        position = self._shaft + self._error + self.zero_error
        return position if self.periodic_error is None else position + self.periodic_error.at(position)

    def position_without_periodic_error(self, place: float) -> float:
        """Return the position without the periodic error, the inverse of it."""
        position = place
        if self.periodic_error is not None:
            for _ in range(APPROXIMATIONS):
                position = place - self.periodic_error.at(position)
        return position

    @property
    def shown(self) -> float:
        """Counter reading."""
        shown = round(self.at, COUNTER_DECIMALS)
        return round(shown % self.high, COUNTER_DECIMALS) if self.endless else shown + 0.0

    def within_range(self, value: float) -> bool:
        """Return whether the drum can be turned to a value."""
        return self.low - 1e-9 <= value <= self.high + 1e-9

    def value_after_turn(self, amount: float) -> float:
        """Return the drum value after a turn by an amount."""
        return (self.at + amount) % self.high if self.endless else self.at + amount

    def turn_to(self, value: float, rng: np.random.Generator | None = None) -> None:
        """Turn the drum to a value; with `rng` it is set by its counter, with a new setting error.

        Raises OutOfRangeError; then nothing has moved.
        """
        if not self.within_range(value):
            raise OutOfRangeError(f"expected {self.low:.2f} to {self.high:.2f}, got {value:.10g}")
        if self.endless:
            value += self.high * round((self.at - value) / self.high)
        self.at = value
        half = self.play / 2.0
        self._shaft = min(max(self._shaft, value - half), value + half)
        if self.setting_sigma and rng is not None:
            self._error = self.setting_sigma * rng.standard_normal()


_ROUNDED_TO = tuple(f"z.{decimals}f" for decimals in range(7))
"""Formats by decimals; a zero has no sign."""


@dataclass
class Counter:
    """Counter geared to a carriage: ``reading = offset + units_per_mm * position``."""

    units_per_mm: float = 1.0
    decimals: int = COUNTER_DECIMALS
    offset: float = 0.0
    slip_share: float = 0.0
    """Share of the passes of the last drum over zero without a carry to the next one."""

    def __post_init__(self) -> None:
        self._at_rest = self.offset

    def state(self) -> tuple[float, int, float]:
        """Return units per mm, decimals and offset, for `restore`."""
        return self.units_per_mm, self.decimals, self.offset

    def restore(self, state: tuple[float, int, float]) -> None:
        """Restore a state."""
        self.units_per_mm, self.decimals, self.offset = state

    def advance(self, before: float, after: float, rng: np.random.Generator) -> None:
        """Follow the carriage from one position to another, and slip where a carry fails.

        A missed carry stays missing until the counter is preset or cleared.
        """
        if not self.slip_share:
            return
        first, last = (math.floor((self.offset + self.units_per_mm * each) / UNITS_A_DRUM) for each in (before, after))
        if first != last:
            missed = int(rng.binomial(abs(last - first), self.slip_share))
            self.offset -= math.copysign(missed * UNITS_A_DRUM, last - first)

    def reading(self, position: float) -> float:
        """Return the reading at a carriage position in mm."""
        return round(self.offset + self.units_per_mm * position, self.decimals) + 0.0

    def text(self, position: float) -> str:
        """Return the reading with all its decimals."""
        return format(self.offset + self.units_per_mm * position, _ROUNDED_TO[self.decimals])

    def position(self, reading: float) -> float:
        """Return the carriage position in mm of a reading, rounded to its last digit."""
        return (round(reading, self.decimals) - self.offset) / self.units_per_mm

    @property
    def half_count(self) -> float:
        """Half the last digit, in mm of the carriage: the resolution of the counter."""
        return 0.5000001 * 10.0**-self.decimals / self.units_per_mm

    def preset(self, reading: float, position: float) -> None:
        """Preset the counter to a reading at the present position."""
        self.offset = round(reading, self.decimals) - self.units_per_mm * position

    def engage(self, units_per_mm: float, decimals: int, position: float) -> None:
        """Change the gear; the counter continues from its reading."""
        reading = self.offset + self.units_per_mm * position
        self.units_per_mm, self.decimals = units_per_mm, decimals
        self.preset(reading, position)

    def clear(self) -> None:
        """Remove the preset:

        the counter shows mm of the instrument frame times its gear, plus its fixed reading at the frame's origin, if
        any.
        """
        self.offset = self._at_rest
