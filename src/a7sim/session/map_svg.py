"""Compiled model as a map: GeoJSON in ground coordinates, and the map on the plotting table as SVG in mm."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from a7sim.geometry import Array, length_of
from a7sim.operator.mapping.map_lines import CONTOUR, TracedLine
from a7sim.operator.mapping.plotting import CompiledMap

INDEX_EVERY = 5
"""Every n-th contour of an equal interval is an index contour: heavier, and labelled with its height."""

_ROUND = (1.0, 2.0, 5.0)
_MARGIN_MM, _HEAD_MM, _FOOT_MM = 12.0, 16.0, 24.0
_CROSS_MM, _LABEL_MM = 2.0, 30.0

_STYLE = """
text { font-family: 'Liberation Sans', Arial, sans-serif; fill: #222; }
.paper { fill: #fff; } .neat { fill: none; stroke: #222; stroke-width: 0.35; }
.limit { fill: none; stroke: #888; stroke-width: 0.15; stroke-dasharray: 2 1.2; }
.grid { stroke: #555; stroke-width: 0.12; }
.contour { fill: none; stroke: #9c5a1e; stroke-width: 0.15; stroke-linejoin: round; }
.index { stroke-width: 0.32; }
.height { fill: #7a4212; font-size: 2.2px; text-anchor: middle; paint-order: stroke; stroke: #fff; stroke-width: 0.7; }
.casing { fill: none; stroke: #222; stroke-linejoin: round; }
.surface { fill: none; stroke: #f6e7b4; stroke-linejoin: round; }
.track { fill: none; stroke: #222; stroke-width: 0.3; stroke-dasharray: 2.4 0.9; }
.spot { fill: #222; } .spots text { font-size: 1.5px; fill: #555; }
.control { fill: none; stroke: #b01010; stroke-width: 0.2; } .controls text { font-size: 2.2px; fill: #b01010; }
.bar { stroke: #222; stroke-width: 0.2; } .small { font-size: 2.3px; }
"""


def to_geojson(sheet: CompiledMap) -> str:
    """Return lines, spot heights and control as GeoJSON: east, north and height in m of the control's own system."""
    features = [
        *(_line_feature(each, sheet) for each in sheet.lines if each.readings.shape[1] > 1),
        *_spot_features(sheet),
        *_control_features(sheet),
    ]
    collection = {
        "type": "FeatureCollection",
        "name": f"model {sheet.record.model.name}",
        "coordinates": "east, north and height in m, local system of the ground control; no EPSG code",
        "features": features,
    }
    return json.dumps(collection, indent=1, ensure_ascii=False) + "\n"


def _common_properties(sheet: CompiledMap) -> dict[str, Any]:
    return {"model": sheet.record.model.name, "scale": round(sheet.map_scale)}


def _line_feature(traced: TracedLine, sheet: CompiledMap) -> dict[str, Any]:
    coordinates = sheet.model.on_ground(traced.readings)
    if traced.height is not None:
        coordinates = np.array([coordinates[0], coordinates[1], np.full(coordinates.shape[1], traced.height)])
    sigma = sheet.sigma_height if traced.kind == CONTOUR else sheet.sigma_plan
    properties = {"name": traced.name, "kind": traced.kind, "height": traced.height, **_common_properties(sheet)}
    properties |= {"sigma": round(sigma, 4), "closed": traced.closed, "endings": list(traced.endings)}
    return _feature("LineString", [_rounded_metres(place) for place in coordinates.T], properties)


def _spot_features(sheet: CompiledMap) -> Iterator[dict[str, Any]]:
    for place in sheet.model.on_ground(sheet.spots.readings).reshape(3, -1).T:
        if np.isfinite(place).all():
            properties = {"kind": "spot height", "height": round(float(place[2]), 3), **_common_properties(sheet)}
            yield _feature("Point", _rounded_metres(place), properties | {"sigma": round(sheet.sigma_height, 4)})


def _control_features(sheet: CompiledMap) -> Iterator[dict[str, Any]]:
    ground = sheet.model.absolute.fit.ground
    for name, role, place in zip(ground.points, ground.roles, ground.coordinates.T, strict=True):
        if np.isfinite(place[:2]).all():
            height = float(place[2]) if math.isfinite(place[2]) else None
            properties = {
                "name": name,
                "kind": "control",
                "role": role,
                "height": height,
                **_common_properties(sheet),
                "sigma": 0.0,
            }
            yield _feature("Point", _rounded_metres(place[: 2 if height is None else 3]), properties)


def _feature(geometry: str, coordinates: Any, properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": {"type": geometry, "coordinates": coordinates}, "properties": properties}


def _rounded_metres(place: Array) -> list[float]:
    return [round(float(value), 3) for value in place]


# --- the sheet ---------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Paper:
    """Positions on the paper: mm from its upper left corner, y downward."""

    sheet: CompiledMap
    low: Array
    high: Array
    """Upper limit of the drawing, on the table ``(2,)``, mm."""

    @classmethod
    def of(cls, sheet: CompiledMap) -> "_Paper":
        corners = _corners(sheet)
        return cls(sheet, corners.min(axis=1) - 2.0, corners.max(axis=1) + 2.0)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the paper."""
        width, height = self.high - self.low
        return float(width) + 2.0 * _MARGIN_MM, float(height) + _HEAD_MM + _FOOT_MM

    def on_paper(self, readings: Array) -> Array:
        """Return positions on the paper ``(2, n)`` of readings ``(2 or 3, n)``, as the table's pencil draws them."""
        x, y = self.sheet.on_table(readings)
        return np.array([x - self.low[0] + _MARGIN_MM, self.high[1] - y + _HEAD_MM])

    def of_ground(self, ground: Array) -> Array:
        """Return positions on the paper ``(2, n)`` of ground coordinates ``(3, n)``."""
        return self.on_paper(self.sheet.model.readings_of(ground))


def _corners(sheet: CompiledMap) -> Array:
    (x0, y0), (x1, y1) = sheet.area.low, sheet.area.high
    return sheet.on_table(np.array([[x0, x1, x1, x0], [y0, y0, y1, y1]]))


def to_svg(sheet: CompiledMap, title: str) -> str:
    """Return the map in mm at map scale, with neat line, grid, contours, lines, control, scale bar and north."""
    paper = _Paper.of(sheet)
    width, height = paper.size
    name = f"{title}, model {sheet.record.model.name}"
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width:.1f}mm" height="{height:.1f}mm" '
        f'viewBox="0 0 {width:.3f} {height:.3f}" role="img" aria-labelledby="title desc">',
        f'<title id="title">{escape(name)}, 1:{sheet.map_scale:.0f}</title>',
        f'<desc id="desc">{escape(_description(sheet))}</desc>',
        f"<style>{_STYLE}</style>",
        f'<rect class="paper" width="{width:.3f}" height="{height:.3f}"/>',
        *_grid(paper),
        f'<polygon class="limit" points="{_points(_corners_on(paper))}"/>',
        *_contours(paper),
        *_roads(paper),
        *_spots(paper),
        *_controls(paper),
        *_frame(paper, name),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


def _description(sheet: CompiledMap) -> str:
    contours = ", ".join(f"{height:g}" for height in sheet.heights) or "none"
    lines = ", ".join(each.name for each in sheet.lines if each.kind != CONTOUR) or "none"
    low, high = sheet.spots.range
    return (
        f"Map at 1:{sheet.map_scale:.0f}, north up, compiled on the plotter from photographs {sheet.record.model.left} "
        f"and {sheet.record.model.right}. Contours in m: {contours}. Lines: {lines}. "
        f"The ground lies between {low:.1f} and {high:.1f} m."
    )


def _corners_on(paper: _Paper) -> Array:
    (x0, y0), (x1, y1) = paper.sheet.area.low, paper.sheet.area.high
    return paper.on_paper(np.array([[x0, x1, x1, x0], [y0, y0, y1, y1]]))


def _points(places: Array) -> str:
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in places.T)


def index_contours(heights: Sequence[float]) -> set[float]:
    """Return the index contours: every fifth of their interval; all without an interval."""
    if len(heights) < 2:
        return set(heights)
    interval = min(np.diff(heights))
    counts = [height / interval for height in heights]
    if any(abs(count - round(count)) > 1e-6 for count in counts):
        return set(heights)
    return {height for height, count in zip(heights, counts, strict=True) if round(count) % INDEX_EVERY == 0}


def _contours(paper: _Paper) -> Iterator[str]:
    index = index_contours(paper.sheet.heights)
    labelled = index or set(paper.sheet.heights)
    labels: list[str] = []
    yield '<g id="contours">'
    for traced in paper.sheet.lines:
        if traced.kind != CONTOUR or traced.height is None or traced.readings.shape[1] < 2:
            continue
        places = paper.on_paper(traced.readings)
        index_class = " index" if traced.height in index else ""
        tag = "polygon" if traced.closed else "polyline"
        yield f'<{tag} class="contour{index_class}" points="{_points(places[:, :-1] if traced.closed else places)}"/>'
        if traced.height in labelled:
            labels += _label(places, f"{traced.height:g}")
    yield from labels
    yield "</g>"


def _label(places: Array, text: str) -> list[str]:
    """Return a height label along the middle of a line that is long enough for it."""
    along = np.concatenate([[0.0], np.cumsum(length_of(np.diff(places, axis=1)))])
    if along[-1] < _LABEL_MM:
        return []
    middle = int(np.clip(np.searchsorted(along, along[-1] / 2.0), 1, places.shape[1] - 1))
    (x, y), (dx, dy) = places[:, middle], places[:, middle] - places[:, middle - 1]
    angle = (math.degrees(math.atan2(dy, dx)) + 90.0) % 180.0 - 90.0
    return [f'<text class="height" transform="translate({x:.2f} {y:.2f}) rotate({angle:.1f})" dy="0.8">{text}</text>']


def _roads(paper: _Paper) -> Iterator[str]:
    lines = [each for each in paper.sheet.lines if each.kind != CONTOUR and each.readings.shape[1] > 1]
    yield '<g id="lines">'
    for kind, widths in (("track", ()), ("road", (("casing", 1.3), ("surface", 0.9)))):
        for symbol, width in widths or (("track", 0.3),):
            for traced in (each for each in lines if each.kind == kind):
                yield (
                    f'<polyline class="{symbol}" stroke-width="{width}" '
                    f'points="{_points(paper.on_paper(traced.readings))}">'
                    f"<title>{escape(traced.name)}</title></polyline>"
                )
    yield "</g>"


def _spots(paper: _Paper) -> Iterator[str]:
    readings, heights = paper.sheet.spots.readings, paper.sheet.spots.heights
    yield '<g id="spot-heights" class="spots">'
    for i in range(1, heights.shape[0] - 1, 2):
        for j in range(1, heights.shape[1] - 1, 2):
            if math.isfinite(heights[i, j]):
                ((x,), (y,)) = paper.on_paper(readings[:, i, j][:, None])
                yield f'<circle class="spot" cx="{x:.2f}" cy="{y:.2f}" r="0.25"/>'
                yield f'<text x="{x + 0.6:.2f}" y="{y + 0.5:.2f}">{heights[i, j]:.1f}</text>'
    yield "</g>"


def _controls(paper: _Paper) -> Iterator[str]:
    ground = paper.sheet.model.absolute.fit.ground
    level = float(np.mean(paper.sheet.spots.range))
    yield '<g id="control" class="controls">'
    for name, place in zip(ground.points, ground.coordinates.T, strict=True):
        if not np.isfinite(place[:2]).all():
            continue
        ((x,), (y,)) = paper.of_ground(np.array([place[0], place[1], level])[:, None])
        width, height = paper.size
        if not (_MARGIN_MM < x < width - _MARGIN_MM and _HEAD_MM < y < height - _FOOT_MM):
            continue
        yield (
            f'<path class="control" d="M{x - 1.3:.2f} {y + 0.75:.2f}L{x:.2f} {y - 1.5:.2f}'
            f'L{x + 1.3:.2f} {y + 0.75:.2f}ZM{x - 0.15:.2f} {y:.2f}h0.3"/>'
            f'<text x="{x + 1.8:.2f}" y="{y + 0.8:.2f}">{escape(name)}</text>'
        )
    yield "</g>"


def _grid(paper: _Paper) -> Iterator[str]:
    """Draw grid crosses of the ground's own system, about a decimetre apart, with coordinates on the neat line."""
    spacing = _round_below(0.1 * paper.sheet.map_scale)
    level = float(np.mean(paper.sheet.spots.range))
    (x0, y0), (x1, y1) = paper.sheet.area.low, paper.sheet.area.high
    z = paper.sheet.spots.readings[2]
    corners = paper.sheet.model.on_ground(
        np.array([[x0, x1, x1, x0], [y0, y0, y1, y1], np.full(4, z[np.isfinite(z)][0])])
    )
    easts, norths = (
        spacing * np.arange(np.ceil(c.min() / spacing), np.floor(c.max() / spacing) + 1) for c in corners[:2]
    )
    left, right = _MARGIN_MM, paper.size[0] - _MARGIN_MM
    top, bottom = _HEAD_MM, paper.size[1] - _FOOT_MM
    if not (easts.size and norths.size):
        return
    yield '<g id="grid">'
    for east in easts:
        xs, ys = paper.of_ground(np.array([np.full(norths.size, east), norths, np.full(norths.size, level)]))
        for x, y in zip(xs, ys, strict=True):
            yield (
                f'<path class="grid" d="M{x - _CROSS_MM:.2f} {y:.2f}h{2 * _CROSS_MM:g}'
                f'M{x:.2f} {y - _CROSS_MM:.2f}v{2 * _CROSS_MM:g}"/>'
            )
        yield f'<text class="small" text-anchor="middle" x="{xs[0]:.2f}" y="{bottom + 3.2:.2f}">{east:.0f} E</text>'
        yield f'<path class="grid" d="M{xs[0]:.2f} {bottom:.2f}v1M{xs[-1]:.2f} {top:.2f}v-1"/>'
    for north in norths:
        ((x,), (y,)) = paper.of_ground(np.array([[easts[0]], [north], [level]]))
        yield (
            f'<text class="small" text-anchor="middle" transform="translate({left - 1.6:.2f} {y:.2f}) rotate(-90)">'
            f"{north:.0f} N</text>"
        )
        yield f'<path class="grid" d="M{left:.2f} {y:.2f}h-1M{right:.2f} {y:.2f}h1"/>'
    yield "</g>"


def _frame(paper: _Paper, name: str) -> Iterator[str]:
    width, height = paper.size
    sheet = paper.sheet
    bottom = height - _FOOT_MM
    yield (
        f'<rect class="neat" x="{_MARGIN_MM:.2f}" y="{_HEAD_MM:.2f}" width="{width - 2 * _MARGIN_MM:.3f}" '
        f'height="{bottom - _HEAD_MM:.3f}"/>'
    )
    yield f'<text x="{_MARGIN_MM:.2f}" y="10" font-size="5" font-weight="bold">{escape(name)}</text>'
    yield (
        f'<text x="{width - _MARGIN_MM - 9:.2f}" y="10" font-size="4" text-anchor="end">1:{sheet.map_scale:.0f}</text>'
    )
    x, y = width - _MARGIN_MM - 3.0, 12.5
    yield (
        f'<g id="north"><path d="M{x:.2f} {y - 8.5:.2f}l1.6 7l-1.6 -1.4l-1.6 1.4z" fill="#222"/>'
        f'<text x="{x:.2f}" y="{y + 1.6:.2f}" font-size="3" text-anchor="middle">N</text></g>'
    )
    yield from _scale_bar(paper, bottom + 8.0)
    for row, text in enumerate(_legend(sheet)):
        yield (
            f'<text class="small" x="{width - _MARGIN_MM:.2f}" y="{bottom + 9.0 + 3.4 * row:.2f}" text-anchor="end">'
            f"{escape(text)}</text>"
        )


def _legend(sheet: CompiledMap) -> list[str]:
    contours = ""
    if sheet.heights:
        steps = {round(float(step), 6) for step in np.diff(sheet.heights)}
        contours = f"Contours every {steps.pop():g} m" if len(steps) == 1 else "Contours as labelled"
        contours += f", expected good to {sheet.sigma_height:.2f} m; "
    return [
        f"Wild A7, photographs {sheet.record.model.left} and {sheet.record.model.right}, "
        f"model 1:{sheet.model.scale_number:.0f}",
        f"{contours}heights in m",
        "Local system of the ground control",
    ]


def _scale_bar(paper: _Paper, y: float) -> Iterator[str]:
    step = _round_below(0.02 * paper.sheet.map_scale)
    step_mm = 1e3 * step / paper.sheet.map_scale
    yield '<g id="scale-bar">'
    for k in range(4):
        fill = "#222" if k % 2 == 0 else "#fff"
        yield (
            f'<rect class="bar" x="{_MARGIN_MM + k * step_mm:.3f}" y="{y:.2f}" width="{step_mm:.3f}" height="1.4" '
            f'fill="{fill}"/>'
        )
    for k in range(5):
        unit = " m" if k == 4 else ""
        yield (
            f'<text class="small" text-anchor="middle" x="{_MARGIN_MM + k * step_mm:.3f}" y="{y + 4.4:.2f}">'
            f"{k * step:g}{unit}</text>"
        )
    yield "</g>"


def _round_below(metres: float) -> float:
    """Return the largest of 1, 2, 5, 10, 20 ... that does not exceed a value."""
    decade = 10.0 ** math.floor(math.log10(metres))
    return max(each * decade for each in _ROUND if each * decade <= metres * (1.0 + 1e-9))
