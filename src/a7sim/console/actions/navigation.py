"""Driving near a point of the sketch, and the position of the mark on the print, by the counters.

A user reads the sketch, the counters and the elements, and knows the data of the plotter. Preset counters are read
relative to `CounterOrigins`: their readings at the origin of the frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from a7sim.console.drawing.sketch import Place
from a7sim.console.instrument_thread import view_point
from a7sim.console.state.readouts import Readouts
from a7sim.geometry import GON, Array, at_level, image_of, mxm, mxv, ray_of, rotation
from a7sim.link.client.client import Client
from a7sim.plotters import Variant

SEARCH_STEP_MM, SEARCH_RINGS = 8.0, 2
"""Steps and rings of the search for a point that is not in view, at photo scale."""

NEAR_MM = 0.5
"""Distance to which the mark is brought to a visible point, at photo scale; the user does the rest."""


@dataclass
class CounterOrigins:
    """Reading of each counter at the origin of the frame, and its units per mm."""

    origins: dict[str, float] = field(default_factory=dict)
    units: dict[str, float] = field(default_factory=dict)

    def frame(self, variant: Variant, dials: Readouts) -> Array:
        """Return the position of the mark in the frame ``(3,)``, mm, by the counters."""
        return np.array(
            [(dials.counter(axis) - self.origin(variant, axis)) / self.unit(variant, axis) for axis in "XYZ"]
        )

    def origin(self, variant: Variant, axis: str) -> float:
        """Return the reading of a counter at the origin."""
        return self.origins.get(axis, variant.scales[axis].at_origin)

    def unit(self, variant: Variant, axis: str) -> float:
        """Return the units per mm of a counter."""
        return self.units.get(axis, variant.scales[axis].units_per_mm)

    def preset(self, variant: Variant, dials: Readouts, axis: str, reading: float) -> None:
        """Record that a counter is preset to a reading, if it can be."""
        if not variant.scales[axis].preset:
            return
        self.origins[axis] = self.origin(variant, axis) + reading - dials.counter(axis)

    def regeared(self, variant: Variant, dials: Readouts, units: float) -> None:
        """Record another height gear: the Z reading is unchanged and continues from there."""
        height = self.frame(variant, dials)[2]
        self.units["Z"] = units
        self.origins["Z"] = dials.counter("Z") - height * units


def displayed_pose(variant: Variant, dials: Readouts, projector: int) -> tuple[Array, Array]:
    """Return centre ``(3,)`` and rotation ``(3, 3)`` of a projector by its counters."""
    show = {name: float(dials.elements.get(name, "0")) for name in (*variant.elements, "by1", "by2", "bz1", "bz2")}
    counts = {name: np.asarray(reading) for name, reading in show.items()}
    turned = rotation(*(tilt * GON for tilt in variant.tilts(counts, projector)))
    on_the_left = (projector == 1) == (dials.base == "inside")
    share = variant.centres_on_base[0 if on_the_left else 1]
    centre = np.array([share * show["bx"], -show[f"by{projector}"], show[f"bz{projector}"]])
    if "common_phi" in variant.elements:
        frame = rotation(0.0, (show["common_phi"] - variant.elements["common_phi"].zero) * GON, 0.0)
        return mxv(frame, centre), mxm(frame, turned)
    return centre, turned


def print_position(variant: Variant, dials: Readouts, presets: CounterOrigins, projector: int) -> Place:
    """Return the approximate position of the mark on the print in a projector, mm."""
    centre, turned = displayed_pose(variant, dials, projector)
    x, y = image_of(presets.frame(variant, dials), centre, turned, dials.element(f"c{projector}"))
    return float(x), float(y)


def readings_over(
    variant: Variant, dials: Readouts, presets: CounterOrigins, projector: int, place: Place
) -> dict[str, float]:
    """Return the X and Y readings with the mark over a position of the print, at its present height."""
    centre, turned = displayed_pose(variant, dials, projector)
    ray = ray_of(np.array(place), turned, dials.element(f"c{projector}"))
    met = at_level(centre, ray, presets.frame(variant, dials)[2])
    return {
        axis: presets.origin(variant, axis) + float(met["XYZ".index(axis)]) * presets.unit(variant, axis)
        for axis in "XY"
    }


@dataclass(frozen=True)
class PointNavigator:
    """Navigator to a point of the sketch of a projector's picture."""

    variant: Variant
    dials: Readouts
    presets: CounterOrigins
    projector: int
    sketch: Mapping[str, Place]

    def drive_near(self, client: Client, point: str) -> bool:
        """Drive until the eye sees the point near the mark; return whether it does."""
        for dx, dy in _outward():
            x, y = self.sketch[point]
            self._drive(client, (x + dx, y + dy))
            seen = view_point(client, self._eye, point)
            if seen is not None:
                self._approach(client, point, seen)
                return True
        return False

    @property
    def _eye(self) -> int:
        crossed = self.dials.fittings.get("triangulation") == "front"
        return 3 - self.projector if crossed else self.projector

    def _drive(self, client: Client, place: Place) -> None:
        readings = readings_over(self.variant, self.dials, self.presets, self.projector, place)
        client.send("DRIV:" + ";".join(f"{axis} {reading:.2f}" for axis, reading in readings.items()))

    def _approach(self, client: Client, point: str, seen: tuple[float, float]) -> None:
        """Turn both wheels until the point is within `NEAR_MM` of the mark."""
        for _ in range(3):
            if max(map(abs, seen)) <= 1e3 * NEAR_MM:
                return
            centre, _ = displayed_pose(self.variant, self.dials, self.projector)
            height = abs(self.presets.frame(self.variant, self.dials)[2] - centre[2])
            scale = 1e-3 * height / self.dials.element(f"c{self.projector}")
            dx, dy = (round(each / 1e3 / NEAR_MM) * NEAR_MM * 1e3 * scale for each in seen)
            units = [self.presets.unit(self.variant, axis) for axis in "XY"]
            client.send(f"WHE:X {dx * units[0]:.2f};Y {dy * units[1]:.2f}")
            again = view_point(client, self._eye, point)
            if again is None or max(map(abs, again)) >= max(map(abs, seen)):
                client.send(f"WHE:X {-dx * units[0]:.2f};Y {-dy * units[1]:.2f}")
                return
            seen = again


def _outward() -> list[Place]:
    """Return the positions to search: the middle, then rings, nearest first."""
    span = range(-SEARCH_RINGS, SEARCH_RINGS + 1)
    places = [(SEARCH_STEP_MM * i, SEARCH_STEP_MM * j) for i in span for j in span]
    return sorted(places, key=lambda place: place[0] ** 2 + place[1] ** 2)


def fetch_sketch(projector: int, picture: str, client: Client) -> dict[str, Place]:
    """Query the points that are pricked on the print in a projector."""
    if not picture:
        return {}
    fields = client.fields(f"PHOT{projector}:SKET?")
    places = zip(map(float, fields[1::3]), map(float, fields[2::3]), strict=True)
    return dict(zip(fields[0::3], places, strict=True))
