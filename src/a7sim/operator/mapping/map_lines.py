"""Requests and results of a compilation: targets, traced lines, area, spot heights, and polylines.

A polyline is the ordered vertices of a line; lengths are mm at model scale unless stated otherwise.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from a7sim.geometry import Array, length_of
from a7sim.scenario import Observer

TREMOR_SHARE = 2.0
"""Ratio of the tremor of a moving hand to the error of a stereoscopic pointing at rest.

[assumption; no source at hand]
"""

CONTOUR = "contour"
"""Kind of a line of constant height."""


@dataclass(frozen=True)
class Tracing:
    """Tracing of lines: tremor in um at photo scale, along and across, and the time per vertex."""

    tremor_um: float
    seconds_per_vertex: float = 1.5
    """[assumption; no source at hand]"""

    @classmethod
    def of(cls, observer: Observer, tremor_um: float | None = None) -> "Tracing":
        """Return the tracing of an observer, with the given tremor if any."""
        return cls(TREMOR_SHARE * observer.stereo_um if tremor_um is None else tremor_um)


@dataclass(frozen=True)
class LineTarget:
    """Line to be compiled, from an old map: east and north in m of its start, of a second position, and its end."""

    name: str
    kind: str
    start: tuple[float, float]
    towards: tuple[float, float]
    end: tuple[float, float]


Ending = Literal["closed", "edge", "end", "joined", "lost"]
"""Ending of a line.

In this order: its own start, the edge of the area, the end on the old map, another line, or where it is lost.
"""


@dataclass(frozen=True)
class TracedLine:
    """Registered line: counter readings ``(3, n)``; a closed line ends with its first vertex."""

    name: str
    kind: str
    height: float | None
    """In m; None for a line of changing height."""
    readings: Array
    endings: tuple[Ending, Ending]

    @property
    def closed(self) -> bool:
        """Whether the line is closed."""
        return self.endings[1] == "closed"


@dataclass(frozen=True)
class Area:
    """Compiled part of the model, in readings of X and Y ``(2,)``."""

    low: Array
    high: Array

    @classmethod
    def within(cls, standard_points: Mapping[str, str], places: Mapping[str, tuple[float, float, float]]) -> "Area":
        """Return the rectangle between the outer standard points 3, 4, 5 and 6, or those that exist.

        Each side needs one.
        """

        def along(axis: int, corners: str) -> list[float]:
            present = [standard_points[label] for label in corners if label in standard_points]
            return [places[name][axis] for name in present if name in places]

        low = [max(along(0, "35")), max(along(1, "56"))]
        high = [min(along(0, "46")), min(along(1, "34"))]
        return cls(np.array(low), np.array(high))

    def contains(self, place: Array) -> bool:
        """Return whether a position ``(2,)`` is inside."""
        return bool((place >= self.low - 1e-6).all() and (place <= self.high + 1e-6).all())

    def clip_step(self, place: Array, step: Array) -> Array:
        """Return a step ``(2,)`` clipped at the border; the position is inside."""
        beyond = np.where(step > 0.0, self.high - place, self.low - place)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.where(step != 0.0, beyond / step, np.inf)
        return np.asarray(step * min(1.0, max(0.0, float(shares.min()))))

    def grid(self, spacing: float) -> tuple[Array, Array]:
        """Return X ``(k,)`` and Y ``(l,)`` of a grid over it, with a spacing near `spacing`."""
        counts = np.maximum(2, np.round((self.high - self.low) / spacing).astype(int) + 1)
        return np.linspace(self.low[0], self.high[0], counts[0]), np.linspace(self.low[1], self.high[1], counts[1])


@dataclass(frozen=True)
class SpotHeights:
    """Spot heights on a grid: readings ``(3, k, l)``, nan where the ground was not visible; heights in m ``(k, l)``."""

    readings: Array
    heights: Array

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest."""
        return float(np.nanmin(self.heights)), float(np.nanmax(self.heights))

    def crossings(self, height: float) -> Iterator[tuple[Array, Array, Array]]:
        """Yield position ``(2,)``, and the two spots ``(2,)`` between which ground of a height must lie."""
        for axis in (0, 1):
            count = self.heights.shape[axis] - 1
            first, second = (self.heights.take(range(i, i + count), axis=axis) for i in (0, 1))
            begins, ends = (self.readings[:2].take(range(i, i + count), axis=axis + 1) for i in (0, 1))
            for i, j in np.argwhere((first < height) != (second < height)):
                if np.isnan(first[i, j] + second[i, j]):
                    continue
                share = (height - first[i, j]) / (second[i, j] - first[i, j])
                begin, end = begins[:, i, j], ends[:, i, j]
                yield begin + share * (end - begin), begin, end

    def nearest(self, place: Array) -> float:
        """Return the Z reading of the spot nearest to a position ``(2,)``."""
        distance = length_of(self.readings[:2] - place[:, None, None])
        return float(self.readings[2].flat[np.nanargmin(np.where(np.isnan(self.heights), np.nan, distance))])


def intersects(chain: Array, begin: Array, end: Array) -> bool:
    """Return whether a polyline ``(2, n)`` crosses the straight line between two positions ``(2,)``."""
    piece = end - begin

    def sides(origin: Array, direction: Array, places: Array) -> Array:
        off = places - (origin[:, None] if origin.ndim == 1 else origin)
        return np.asarray(direction[0] * off[1] - direction[1] * off[0])

    of_chain = sides(begin, piece, chain)
    parts, starts = np.diff(chain, axis=1), chain[:, :-1]
    of_begin = sides(starts, parts, np.broadcast_to(begin[:, None], starts.shape))
    of_end = sides(starts, parts, np.broadcast_to(end[:, None], starts.shape))
    return bool(((of_chain[:-1] * of_chain[1:] <= 0.0) & (of_begin * of_end <= 0.0)).any())


def as_polyline(vertices: Sequence[Array]) -> Array:
    """Return vertices ``(3,)`` as a polyline ``(3, n)``."""
    return np.array(vertices).reshape(-1, 3).T


def length_along(chain: Array) -> float:
    """Return the length of a polyline ``(2, n)``."""
    return float(length_of(np.diff(chain, axis=1)).sum())


def distance_to(chain: Array, place: Array) -> float:
    """Return the distance of a position ``(2,)`` from a polyline ``(2, n)``."""
    begins, pieces = chain[:, :-1], np.diff(chain, axis=1)
    squares = np.maximum((pieces * pieces).sum(axis=0), 1e-12)
    shares = np.clip(((place[:, None] - begins) * pieces).sum(axis=0) / squares, 0.0, 1.0)
    return float(length_of(place[:, None] - begins - pieces * shares).min())
