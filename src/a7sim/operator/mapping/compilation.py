"""Compilation of a level model: spot heights, contours and lines, followed with the mark and registered as vertices.

A contour is followed by predictor and corrector: the mark stays at its height and moves along the perceived strike of
the ground; if it then appears above or below the ground it is moved up or down the slope. A road is followed by its
middle in the left eyepiece, the mark kept on the ground with the foot disc. Compilation needs the images of the
eyepieces and therefore runs over a link only. Lengths are mm at model scale unless stated otherwise.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from a7sim.geometry import Array, length_of
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.mapping.level_model import LevelModel
from a7sim.operator.mapping.map_lines import (
    CONTOUR,
    Area,
    Ending,
    LineTarget,
    SpotHeights,
    TracedLine,
    Tracing,
    as_polyline,
    distance_to,
    intersects,
    length_along,
)
from a7sim.operator.mapping.stereo_view import (
    COARSE_MM,
    FINE_MM,
    MIDDLING_MM,
    PerceivedSurface,
    StereoPatch,
    StereoView,
    rectify,
)
from a7sim.operator.people.person import Person
from a7sim.text import pluralize

MAX_STEP_MM, MIN_STEP_MM, FIRST_STEP_MM = 3.0, 0.3, 1.0
"""Step from vertex to vertex."""

SPOTS_MM = 25.0
"""Approximate distance of spot heights."""

_SHARP_TURN, _GENTLE_TURN = 0.35, 0.12
"""Radians from vertex to vertex above which steps are shortened, and below which they are lengthened."""

_MAX_STRAYED, _SHARPEST = 0.6, 0.3
"""Limit of a correction, as a share of the step; and of a turn from vertex to vertex, as its cosine."""

_MAX_VERTICES = 4000
_MAX_LOOKS = 14
_NEAR_ENOUGH_MM = 0.15
"""A smaller correction in plan is left to the next movement without another look."""

_MAX_CORRECTION_MM = 3.0
_SAME_LINE_MM, _JOINED_MM, _STUB_MM = 2.5, 1.5, 10.0
"""Distance from a drawn line within which no line starts; distance at which a line ends; and length of a stub.

A line ends near another one at a saddle of its own height. A piece shorter than a stub that ends so is no line.
"""

_AT_A_GLANCE = 10.0
"""Height, in picture elements, up to which the eyes fuse without a search.

Beyond it, unrelated images might be fused.
"""

_CLOSELY = ((FINE_MM, 0.0), (MIDDLING_MM, 0.0), (MIDDLING_MM, 3.0), (COARSE_MM, 12.0))
_WIDELY = _CLOSELY[2:]
"""Sizes of picture elements and searched heights, in mm, in the order of the search.

A medium element serves as well as a fine one if a signal disturbs the fine image.
"""

ROAD_MM = 0.08
"""Size of a picture element for following lines: 3.8 mm of the photograph are visible."""

_ON_ROADS = ((ROAD_MM, 0.0), (ROAD_MM, 1.0), (COARSE_MM, 12.0))
_ROAD_SIDE = 43
_ROAD_SEEN = 0.45
"""Correlation with a light band above which a road is recognised."""

_WIDTHS_MM = tuple(np.geomspace(0.5, 4.0, 10).tolist())
_END_REACHED_MM = 6.0


@dataclass(frozen=True)
class _Vertex:
    """Intended position of the mark ``(2,)``, and unit direction of the line there ``(2,)``."""

    place: Array
    heading: Array
    surface: PerceivedSurface
    look: StereoPatch
    correction: Array
    """From the mark to the intended position, as seen in the look ``(2,)``."""


class Compilation:
    """Compilation of a level model by one operator."""

    def __init__(
        self,
        workstation: Workstation,
        person: Person,
        view: StereoView,
        model: LevelModel,
        area: Area,
        tracing: Tracing,
    ) -> None:
        self._workstation = workstation
        self._person = person
        self._view = view
        self.model = model
        self.area = area
        self._tracing = tracing
        self._active = workstation.operators.active
        self._light = 1.0 if workstation.controls.model.polarity == "positive" else -1.0

    # --- the mark -------------------------------------------------------------------------------------

    def _drive(self, place: Array, z: float) -> None:
        targets = dict(zip("XYZ", [np.array([value]) for value in (*place, z)], strict=True))
        self._workstation.controls.drive(self._active, targets)
        self._workstation.controls.give_up_on_errors(self._active, "driving over the model")

    def _turn(self, plan: Array, rise: float = 0.0) -> None:
        wheels = np.array([*plan, rise * self.model.units_per_mm])
        self._workstation.driver.turn(self._active, wheels[:, None])

    def _place(self) -> Array:
        return np.asarray(self._workstation.controls.counters(self._active)[:2, 0])

    def _register(self, name: str) -> Array:
        """Register the mark under a name and return the registered readings ``(3,)``."""
        self._workstation.operators.spend(self._active, self._tracing.seconds_per_vertex, "turning")
        fields = self._person.client.fields(f'REC "{name}";:REC:LAST?')
        return np.array(fields[2:5], dtype=float)

    def _look_until_fused(
        self, expected: PerceivedSurface | None = None, looks: Sequence[tuple[float, float]] = _CLOSELY
    ) -> tuple[StereoPatch, PerceivedSurface] | None:
        """Look at the ground, with a widening search, until it fuses; None if it does not."""
        look = None
        for pitch, reach in looks:
            if look is None or look.pitch != pitch:
                look = self._view.look(pitch)
            surface = self._view.surface(look, expected, reach)
            if surface.fused and abs(surface.height) < max(reach, _AT_A_GLANCE * look.pitch):
                return look, surface
        return None

    def _tremor(self, look: StereoPatch) -> tuple[Array, float]:
        """Draw tremor along and across ``(2,)``, and the error of the perceived height, in mm."""
        along, across, height = self._workstation.operators.draw_setting_errors(self._active, 1.0, (3,))[:, 0]
        tremor = 1e-3 * self._tracing.tremor_um * look.enlargement * np.array([along, across])
        return tremor, float(1e-3 * self._workstation.operators.observer.height_um * height / look.parallax_by_height)

    # --- spot heights ---------------------------------------------------------------------------------

    def spot_heights(self, spacing: float = SPOTS_MM) -> SpotHeights:
        """Measure heights on a grid over the area."""
        xs, ys = self.area.grid(spacing)
        readings = np.full((3, xs.size, ys.size), np.nan)
        z = float(np.mean([place[2] for place in self.model.points.values()]))
        for i, x in enumerate(xs):
            order = range(ys.size) if i % 2 == 0 else range(ys.size - 1, -1, -1)
            for j in order:
                self._drive(np.array([x, ys[j]]), z)
                found = self._spot()
                if found is not None:
                    readings[:, i, j] = found
                    z = found[2]
        if np.isnan(readings).all():
            self._workstation.operators.give_up(
                self._active, f"{self._workstation.controls.model.name}: the ground is nowhere seen in relief"
            )
        return SpotHeights(readings, np.asarray(self.model.on_ground(readings)[2]))

    def _spot(self) -> Array | None:
        observer = self._workstation.operators.observer
        self._workstation.operators.spend(self._active, observer.seconds_to_look, "looking")
        seen = self._look_until_fused(looks=_WIDELY)
        for _ in range(_MAX_LOOKS):
            if seen is None:
                return None
            look, surface = seen
            if look.pitch <= MIDDLING_MM and abs(surface.height) < _NEAR_ENOUGH_MM:
                _, error = self._tremor(look)
                self._turn(np.zeros(2), surface.height + error)
                return self._register("spot height")
            self._turn(np.zeros(2), surface.height)
            seen = self._look_until_fused()
        return None

    # --- contours -------------------------------------------------------------------------------------

    def contour(self, height: float, spots: SpotHeights) -> list[TracedLine]:
        """Follow all contours of a height in m that pass between spot heights."""
        name = f"contour {height:g}"
        lines: list[TracedLine] = []
        for guess, begin, end in spots.crossings(height):
            if any(intersects(line.readings[:2], begin, end) for line in lines):
                continue
            middle = np.array([*guess, spots.nearest(guess)])
            z = float(self.model.readings_of(_at_height(self.model.on_ground(middle), height))[2])
            self._drive(guess, z)
            start = self._find_contour(guess, None)
            if start is None or any(distance_to(line.readings[:2], start.place) < _SAME_LINE_MM for line in lines):
                continue
            found = self._follow_both_ways(name, height, start, z, lines)
            vertices = found.readings.shape[1]
            if vertices < 2 or ("joined" in found.endings and length_along(found.readings[:2]) < _STUB_MM):
                self._person.client.send(
                    f'NOTE "{name}: {pluralize(vertices, "vertex", "vertices")}, no line or more of one drawn before"'
                )
            else:
                lines.append(found)
        return lines

    def _follow_both_ways(
        self, name: str, height: float, start: _Vertex, z: float, drawn: Sequence[TracedLine]
    ) -> TracedLine:
        outward, ending = self._follow_contour(name, start, drawn)
        if ending == "closed":
            return TracedLine(name, CONTOUR, height, as_polyline([*outward, outward[0]]), ("closed", "closed"))
        self._drive(start.place, z)
        back, other = self._follow_contour(name, replace(start, heading=-start.heading), drawn)
        return TracedLine(name, CONTOUR, height, as_polyline([*back[::-1], *outward]), (other, ending))

    def _follow_contour(self, name: str, start: _Vertex, drawn: Sequence[TracedLine]) -> tuple[list[Array], Ending]:
        """Follow a contour from a position on it; return its vertices and how it ended."""
        vertices: list[Array] = []
        at, step, bend = start, FIRST_STEP_MM, 0.0
        while len(vertices) < _MAX_VERTICES:
            wanted = step * _rotate(at.heading, bend / 2.0)
            cut = self.area.clip_step(at.place, wanted)
            if length_of(cut) < 1e-2:
                return vertices, "edge"
            self._turn(at.place + cut - self._place())
            following = self._find_contour(self._place(), at)
            if following is None:
                if step <= MIN_STEP_MM:
                    return vertices, "lost"
                self._turn(at.place - self._place())
                step = max(step / 2.0, MIN_STEP_MM)
                bend = 0.0
                continue
            vertices.append(self._register_vertex(following, name))
            bend = _angle(at.heading, following.heading)
            at = following
            if any(distance_to(line.readings[:2], at.place) < _JOINED_MM for line in drawn):
                return vertices, "joined"
            if length_of(cut) < length_of(wanted) - 1e-9:
                return vertices, "edge"
            step = _next_step(step, bend)
            bend *= step / max(float(length_of(wanted)), 1e-9)
            ahead = start.place - at.place
            if len(vertices) > 6 and length_of(ahead) < 1.5 * step and ahead @ at.heading > 0.0:
                return vertices, "closed"
        return vertices, "lost"

    def _find_contour(self, place: Array, before: _Vertex | None) -> _Vertex | None:
        """Move the mark near the contour at its height; return the vertex there, None if none is found."""
        expected = None if before is None else PerceivedSurface(0.0, before.surface.slope, 0.0, 1.0)
        for number in range(_MAX_LOOKS):
            seen = self._look_until_fused(expected, _CLOSELY if number or before is not None else _WIDELY)
            if seen is None:
                return None
            look, surface = seen
            steepness = float(surface.slope @ surface.slope)
            if steepness == 0.0:
                return None
            back = -surface.height * surface.slope / steepness
            far = float(length_of(back))
            expected = PerceivedSurface(0.0, surface.slope, 0.0, 1.0)
            if far > _NEAR_ENOUGH_MM or look.pitch > MIDDLING_MM:
                self._turn(back * min(1.0, _MAX_CORRECTION_MM / far))
                continue
            here = self._place() + back
            strike = np.array([-surface.slope[1], surface.slope[0]]) / np.sqrt(steepness)
            if before is not None and strike @ before.heading < 0.0:
                strike = -strike
            if before is not None and _has_strayed(before, place, here, strike):
                return None
            return _Vertex(here, strike, surface, look, back)
        return None

    def _register_vertex(self, vertex: _Vertex, name: str) -> Array:
        """Move the mark to a vertex with the tremor of the hand; return the registered readings ``(3,)``."""
        (along, across), error = self._tremor(vertex.look)
        slope = vertex.surface.slope
        steepness = np.sqrt(float(slope @ slope))
        misjudged = np.clip(error / steepness, -_MAX_CORRECTION_MM, _MAX_CORRECTION_MM)
        self._turn(vertex.correction + along * vertex.heading + (across + misjudged) * (slope / steepness))
        return self._register(name)

    # --- lines ----------------------------------------------------------------------------------------

    def line(self, target: LineTarget, spots: SpotHeights) -> TracedLine:
        """Follow a road or track by its middle. Gives up if none is visible at its start."""
        start, towards, end = (self._readings_in_plan(each) for each in (target.start, target.towards, target.end))
        heading = (towards - start) / length_of(towards - start)
        self._drive(start, spots.nearest(start))
        found = self._road_at(heading, np.pi / 3.0, _WIDTHS_MM)
        if found is None:
            self._workstation.operators.give_up(
                self._active,
                f"{self._workstation.controls.model.name}: no {target.kind} is seen where the map shows {target.name}",
            )
            raise AssertionError
        vertices, ending = self._follow_road(target.name, found, end)
        readings = np.array(vertices).reshape(-1, 3).T
        return TracedLine(target.name, target.kind, None, readings, ("end", ending))

    def _readings_in_plan(self, plan: tuple[float, float]) -> Array:
        level = self.model.on_ground(
            np.array([*self._place(), self._workstation.controls.counters(self._active)[2, 0]])
        )
        return np.asarray(self.model.readings_of(np.array([*plan, level[2]]))[:2])

    def _follow_road(self, name: str, road: "_Road", end: Array) -> tuple[list[Array], Ending]:
        vertices: list[Array] = []
        step, bend = FIRST_STEP_MM, 0.0
        while len(vertices) < _MAX_VERTICES:
            (along, across), error = self._tremor(road.look)
            shaken = road.offset + along * road.heading + across * _rotate(road.heading, np.pi / 2.0)
            start = self._place()
            self._turn(shaken, road.surface.above(shaken) + error)
            vertices.append(self._register(name))
            left = end - start - road.offset
            if length_of(left) < _END_REACHED_MM and left @ road.heading < step:
                return vertices, "end"
            forward = step * _rotate(road.heading, bend / 2.0)
            cut = self.area.clip_step(start + road.offset, forward)
            if length_of(cut) < length_of(forward) - 1e-9:
                return vertices, "edge"
            going = road.offset + cut
            self._turn(start + going - self._place(), road.surface.above(going) - road.surface.above(shaken) - error)
            following = self._road_at(road.heading, 0.6, (road.width,), road.surface)
            if following is None:
                return vertices, "lost"
            bend = _angle(road.heading, following.heading)
            road = following
            gone, step = step, _next_step(step, bend)
            bend *= step / gone
        return vertices, "lost"

    def _road_at(
        self, heading: Array, within: float, widths: Sequence[float], expected: PerceivedSurface | None = None
    ) -> "_Road | None":
        """Find a light band near the mark with a direction ``(2,)``, `within` an angle in radians."""
        slope = None if expected is None else PerceivedSurface(0.0, expected.slope, 0.0, 1.0)
        seen = self._look_until_fused(slope, _ON_ROADS)
        if seen is not None and seen[0].pitch != ROAD_MM:
            self._turn(np.zeros(2), seen[1].height)
            seen = self._look_until_fused(looks=_ON_ROADS[:2])
        if seen is None:
            return None
        look, surface = seen
        bands = [_band(look, surface, self._light, heading, within, width) for width in widths]
        correlation, offset, towards, width = max(bands, key=lambda band: band[0])
        return _Road(look, surface, offset, towards, width) if correlation > _ROAD_SEEN else None


@dataclass(frozen=True)
class _Road:
    """Road near the mark: offset of its middle ``(2,)``, direction ``(2,)``, width."""

    look: StereoPatch
    surface: PerceivedSurface
    offset: Array
    heading: Array
    width: float


def _band(
    look: StereoPatch, surface: PerceivedSurface, light: float, heading: Array, within: float, width: float
) -> tuple[float, Array, Array, float]:
    """Return correlation, middle ``(2,)``, direction ``(2,)`` and width of the light band that fits best."""
    inside, grey, plan = rectify(look, surface, _ROAD_SIDE)
    radius = look.spacing * (_ROAD_SIDE - 1) / 2.0
    inside &= length_of(plan) <= radius
    grey, plan = light * grey[inside], plan[:, inside]
    grey = (grey - grey.mean()) / max(float(grey.std()), 1e-6)
    turns = np.linspace(-within, within, 25)
    offsets = np.arange(-0.7 * radius, 0.7 * radius, look.spacing)
    fits = np.array([_fit(grey, plan, _rotate(heading, turn), offsets, width, look.spacing) for turn in turns])
    k, j = np.unravel_index(int(np.argmax(fits)), fits.shape)
    turn = turns[k] + (turns[1] - turns[0]) * _peak(fits[:, j], int(k))
    towards = _rotate(heading, turn)
    fine = offsets[j] + look.spacing * np.linspace(-1.5, 1.5, 13)
    fitted = _fit(grey, plan, towards, fine, width, look.spacing)
    best = int(np.argmax(fitted))
    offset = fine[best] + (fine[1] - fine[0]) * _peak(fitted, best)
    return float(fitted[best]), offset * _rotate(towards, np.pi / 2.0), towards, width


def _fit(grey: Array, plan: Array, direction: Array, offsets: Array, width: float, spacing: float) -> Array:
    """Return the correlations ``(k,)`` of greys ``(n,)`` with bands of one direction at offsets ``(k,)``."""
    across = _rotate(direction, np.pi / 2.0) @ plan
    bands = np.clip((width / 2.0 - np.abs(across - offsets[:, None])) / spacing + 0.5, 0.0, 1.0)
    spread = bands.std(axis=1)
    return np.asarray(
        np.where(spread > 1e-3, (bands - bands.mean(axis=1, keepdims=True)) @ grey / grey.size / (spread + 1e-9), 0.0)
    )


def _peak(values: Array, at: int) -> float:
    """Return the offset of the vertex of a parabola through three values from the middle one, in steps."""
    if not 0 < at < values.size - 1:
        return 0.0
    before, here, after = values[at - 1 : at + 2]
    bend = before - 2.0 * here + after
    return float(np.clip(0.5 * (before - after) / bend, -1.0, 1.0)) if bend < 0.0 else 0.0


def _has_strayed(before: _Vertex, wanted: Array, here: Array, heading: Array) -> bool:
    """Return whether a correction led to an impossible position: perhaps another contour beyond a saddle."""
    step = float(length_of(wanted - before.place))
    return bool(
        length_of(here - wanted) > _MAX_STRAYED * step + _NEAR_ENOUGH_MM or heading @ before.heading < _SHARPEST
    )


def _at_height(place: Array, height: float) -> Array:
    return np.array([place[0], place[1], height])


def _rotate(direction: Array, angle: float) -> Array:
    sine, cosine = np.sin(angle), np.cos(angle)
    return np.array([cosine * direction[0] - sine * direction[1], sine * direction[0] + cosine * direction[1]])


def _angle(before: Array, after: Array) -> float:
    return float(np.arctan2(before[0] * after[1] - before[1] * after[0], before @ after))


def _next_step(step: float, bend: float) -> float:
    if abs(bend) > _SHARP_TURN:
        return max(0.6 * step, MIN_STEP_MM)
    return min(1.3 * step, MAX_STEP_MM) if abs(bend) < _GENTLE_TURN else step
