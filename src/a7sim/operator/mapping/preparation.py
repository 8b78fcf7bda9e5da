"""Settings before a picture is mounted: model scale, gears, projection height, base (thesis 3.2.3)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from a7sim.errors import A7SimError
from a7sim.plotters import Variant

PLAN_GEARS: Mapping[str, float] = MappingProxyType({"3-1-1": 4.0 / 3.0, "1-2-1": 1.5})
"""Enlargements of the horizontal gears from model to map: 1:3333 and 1:3750 into 1:2500 (thesis table 3.3).

The thesis names only these two ratios; the plotter had more.
"""

RATIO_AGREES = 2e-3
"""Tolerance of a model scale such as 1:3333 and a ratio of gears, as a share."""

FORMAT_MM = 230.0
MIN_WIDE_DEG, WIDEST_WIDE_DEG = 75.0, 100.0
"""Field angles across the picture called wide (thesis 3.2.3.2)."""


@dataclass(frozen=True)
class FlightPlan:
    """Data of a flight: principal distance and photo base in mm, heights of the ground in m."""

    c: float
    photo_scale: float
    """Scale number at the mean height of the ground."""
    photo_base: float
    lowest: float
    highest: float

    @classmethod
    def of_heights(
        cls,
        c: float,
        photo_base: float,
        heights: tuple[float, float],
        photo_scale: float | None = None,
        flying_height: float | None = None,
    ) -> "FlightPlan":
        """Return a flight over the lowest and the highest ground, by its photo scale or its flying height.

        Heights are m, the flying height above the mean ground. Raises A7SimError if they are inconsistent.
        """
        if (photo_scale is None) == (flying_height is None):
            got = "none" if photo_scale is None else "both"
            raise A7SimError(f"prepare: expected --photo-scale or --flying-height, one of the two, got {got}")
        lowest, highest = heights
        if lowest > highest:
            raise A7SimError(
                f"--heights: expected the lowest ground before the highest, got {lowest:g} and {highest:g}"
            )
        if photo_scale is None:
            photo_scale = 1e3 * (flying_height or 0.0) / c if c else 0.0
        if not min(c, photo_scale, photo_base) > 0.0:
            raise A7SimError("prepare: expected --c, --photo-base and --photo-scale or --flying-height above zero")
        flight = cls(c, photo_scale, photo_base, lowest, highest)
        if not flight.lowest_flown > 0.0:
            above = -flight.lowest_flown
            raise A7SimError(f"--heights: expected ground below the flight, got {highest:g} m, {above:g} m above it")
        return flight

    @property
    def mean_ground(self) -> float:
        """Middle of the lowest and the highest ground, m."""
        return (self.lowest + self.highest) / 2.0

    @property
    def flying_height(self) -> float:
        """Metres above the mean ground."""
        return 1e-3 * self.c * self.photo_scale

    @property
    def lowest_flown(self) -> float:
        """Metres above the highest ground, H'min."""
        return self.flying_height - (self.highest - self.mean_ground)

    @property
    def highest_flown(self) -> float:
        """Metres above the lowest ground, H'max."""
        return self.flying_height + (self.mean_ground - self.lowest)

    @property
    def field_angle_deg(self) -> float:
        """Angle of the field across the corners of the picture, degrees (thesis 3.2)."""
        return 2.0 * math.degrees(math.atan(FORMAT_MM * math.sqrt(2.0) / (2.0 * self.c)))

    @property
    def angle(self) -> str:
        """Normal, wide or superwide."""
        if self.field_angle_deg < MIN_WIDE_DEG:
            return "normal"
        return "wide" if self.field_angle_deg <= WIDEST_WIDE_DEG else "superwide"


@dataclass(frozen=True)
class ModelScale:
    """Model scale with its settings, mm at the instrument, and the reasons for which it is rejected."""

    number: float
    height_gear: str
    interval: float
    """Last digit of the height counter, m."""
    plan_gear: str
    """Horizontal gear to the map, empty if none is requested or known."""
    projection_height: float
    lowest: float
    highest: float
    """Projection distances of the highest and the lowest ground."""
    bx: float
    width: float
    """Extent of the corners of the picture across the base."""
    reason_rejected: tuple[str, ...] = ()


@dataclass(frozen=True)
class FlightSettings:
    """Settings of a flight: the optimum scale number, all scales with gears, and the chosen one."""

    flight: FlightPlan
    optimum: float
    optimum_bx: float
    scales: tuple[ModelScale, ...]
    chosen: ModelScale
    reason: str


def choose_settings(flight: FlightPlan, variant: Variant, map_scale: float | None = None) -> FlightSettings:
    """Return the settings for a flight on a plotter, from a flight in mm and m and a map's scale number.

    The optimum places the mean ground at the longest projection distance, equation 3.1. Of the scales for which a
    height gear counts metres, those within the ranges of Z, bx, X and Y and with a horizontal gear to the map remain;
    the height counter with the finest last digit is chosen, and among equals the scale nearest to the optimum. Raises
    A7SimError if none remains.
    """
    optimum = 1e3 * flight.flying_height / _longest(variant)
    gears = {gear.units_per_mm: name for name, gear in variant.height_gears.items()}
    scales = tuple(_scale(flight, variant, gear, map_scale) for gear in gears.values())
    possible = [scale for scale in scales if not scale.reason_rejected]
    if not possible:
        texts = "; ".join(f"1:{scale.number:.0f} {scale.reason_rejected[0]}" for scale in scales)
        raise A7SimError(f"no model scale of an {variant.name} suits this flight: {texts}")
    chosen = min(possible, key=lambda scale: (scale.interval, abs(scale.number - optimum)))
    return FlightSettings(flight, optimum, _base(flight, optimum), scales, chosen, _reason(chosen, possible))


def _longest(variant: Variant) -> float:
    return -variant.carriages["Z"][0]


def _base(flight: FlightPlan, number: float) -> float:
    return flight.photo_base * flight.photo_scale / number


def _scale(flight: FlightPlan, variant: Variant, gear: str, map_scale: float | None) -> ModelScale:
    engaged = variant.height_gears[gear]
    number = 1e3 * engaged.units_per_mm
    plan_gear = _plan_gear(number, map_scale)
    scale = ModelScale(
        number,
        gear,
        10.0**-engaged.decimals,
        plan_gear,
        1e3 * flight.flying_height / number,
        1e3 * flight.lowest_flown / number,
        1e3 * flight.highest_flown / number,
        _base(flight, number),
        flight.photo_scale / number * FORMAT_MM / 2.0,
    )
    return ModelScale(**{**vars(scale), "reason_rejected": tuple(_against(scale, variant, map_scale))})


def _plan_gear(number: float, map_scale: float | None) -> str:
    if map_scale is None:
        return ""
    fitting = (name for name, ratio in PLAN_GEARS.items() if abs(number / map_scale / ratio - 1.0) < RATIO_AGREES)
    return next(fitting, "")


def _against(scale: ModelScale, variant: Variant, map_scale: float | None) -> list[str]:
    low, high = variant.carriages["Z"]
    texts = []
    if not (-high <= scale.lowest and scale.highest <= -low):
        texts.append(f"needs Z {scale.lowest:.1f} to {scale.highest:.1f} mm, the range is {-high:.0f} to {-low:.0f} mm")
    most = variant.elements["bx"].high
    if scale.bx > most:
        texts.append(f"needs bx {scale.bx:.2f} mm, the range ends at {most:.0f} mm")
    left, right = variant.centres_on_base
    reaches = {"X": (left * scale.bx, right * scale.bx), "Y": (-scale.width, scale.width)}
    for axis, (least, furthest) in reaches.items():
        first, last = variant.carriages[axis]
        if least < first or furthest > last:
            texts.append(f"needs {axis} {least:.1f} to {furthest:.1f} mm, the range is {first:.0f} to {last:.0f} mm")
    if map_scale is not None and not scale.plan_gear:
        texts.append(f"has no horizontal gear to 1:{map_scale:.0f}")
    return texts


def _reason(chosen: ModelScale, possible: Sequence[ModelScale]) -> str:
    if len(possible) == 1:
        return "the only scale with gears and within the ranges"
    if any(scale.interval > chosen.interval for scale in possible):
        return f"its height counter reads {chosen.interval:g} m, the finest within the ranges, nearest to the optimum"
    return "the scale nearest to the optimum within the ranges"
