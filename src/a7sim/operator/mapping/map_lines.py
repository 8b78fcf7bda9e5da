"""What a compilation is asked for and what comes of it: errands, traced lines, the area, its spot heights, and chains.

A chain is the vertices of a line in their order; lengths are mm at model scale unless said otherwise.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from a7sim.geometry import Array, length_of
from a7sim.scenario import Observer

TREMOR_SHARE = 2.0
"""Tremor of a moving hand for the error of a stereoscopic pointing at rest [assumption; no source at hand]."""

CONTOUR = "contour"
"""Kind of a line of one height."""


@dataclass(frozen=True)
class Tracing:
    """How a person follows lines: tremor in um at photo scale, along and across, and the time a vertex takes."""

    tremor_um: float
    seconds_per_vertex: float = 1.5
    """[assumption; no source at hand]"""

    @classmethod
    def of(cls, observer: Observer, tremor_um: float | None = None) -> "Tracing":
        """Return how an observer follows lines where nothing else is said."""
        return cls(TREMOR_SHARE * observer.stereo_um if tremor_um is None else tremor_um)


@dataclass(frozen=True)
class LineTarget:
    """A line to be compiled, from an old map: east and north in m of its start, of a place further on, and its end."""

    name: str
    kind: str
    start: tuple[float, float]
    towards: tuple[float, float]
    end: tuple[float, float]


Ending = Literal["closed", "edge", "end", "joined", "lost"]
"""At its own beginning, the edge of the area, the end on the old map, a line drawn before, or where it is lost."""


@dataclass(frozen=True)
class TracedLine:
    """A line as it was registered: readings of the counters ``(3, n)``; a closed one ends with its first vertex."""

    name: str
    kind: str
    height: float | None
    """In m; None for a line of changing height."""
    readings: Array
    endings: tuple[Ending, Ending]

    @property
    def closed(self) -> bool:
        """Whether it returns to where it begins."""
        return self.endings[1] == "closed"


@dataclass(frozen=True)
class Area:
    """The part of the model that is compiled, in readings of X and Y ``(2,)``."""

    low: Array
    high: Array

    @classmethod
    def within(cls, standard_points: Mapping[str, str], places: Mapping[str, tuple[float, float, float]]) -> "Area":
        """Return the rectangle between the outer standard points 3, 4, 5 and 6, or what there is of them.

        Every side must have one.
        """

        def along(axis: int, corners: str) -> list[float]:
            there = [standard_points[label] for label in corners if label in standard_points]
            return [places[name][axis] for name in there if name in places]

        low = [max(along(0, "35")), max(along(1, "56"))]
        high = [min(along(0, "46")), min(along(1, "34"))]
        return cls(np.array(low), np.array(high))

    def contains(self, place: Array) -> bool:
        """Return whether a place ``(2,)`` lies in it."""
        return bool((place >= self.low - 1e-6).all() and (place <= self.high + 1e-6).all())

    def clip_step(self, place: Array, step: Array) -> Array:
        """Return a step ``(2,)`` cut off at the border; the place lies within."""
        beyond = np.where(step > 0.0, self.high - place, self.low - place)
        with np.errstate(divide="ignore", invalid="ignore"):
            shares = np.where(step != 0.0, beyond / step, np.inf)
        return np.asarray(step * min(1.0, max(0.0, float(shares.min()))))

    def grid(self, spacing: float) -> tuple[Array, Array]:
        """Return X ``(k,)`` and Y ``(l,)`` of a grid over it, as nearly `spacing` apart as comes out even."""
        counts = np.maximum(2, np.round((self.high - self.low) / spacing).astype(int) + 1)
        return np.linspace(self.low[0], self.high[0], counts[0]), np.linspace(self.low[1], self.high[1], counts[1])


@dataclass(frozen=True)
class SpotHeights:
    """Spot heights on a grid: readings ``(3, k, l)``, nan where the ground was not seen; heights in m ``(k, l)``."""

    readings: Array
    heights: Array

    @property
    def range(self) -> tuple[float, float]:
        """Lowest and highest."""
        return float(np.nanmin(self.heights)), float(np.nanmax(self.heights))

    def crossings(self, height: float) -> Iterator[tuple[Array, Array, Array]]:
        """Yield place ``(2,)``, and the two spots ``(2,)`` between which ground of a height must lie."""
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
        """Return the Z reading of the spot nearest to a place ``(2,)``."""
        distance = length_of(self.readings[:2] - place[:, None, None])
        return float(self.readings[2].flat[np.nanargmin(np.where(np.isnan(self.heights), np.nan, distance))])


def intersects(chain: Array, begin: Array, end: Array) -> bool:
    """Return whether a chain ``(2, n)`` crosses the straight piece between two places ``(2,)``."""
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
    """Return vertices ``(3,)`` as a chain ``(3, n)``."""
    return np.array(vertices).reshape(-1, 3).T


def length_along(chain: Array) -> float:
    """Return how long a chain ``(2, n)`` is."""
    return float(length_of(np.diff(chain, axis=1)).sum())


def distance_to(chain: Array, place: Array) -> float:
    """Return how far a place ``(2,)`` lies from a chain ``(2, n)``."""
    begins, pieces = chain[:, :-1], np.diff(chain, axis=1)
    squares = np.maximum((pieces * pieces).sum(axis=0), 1e-12)
    shares = np.clip(((place[:, None] - begins) * pieces).sum(axis=0) / squares, 0.0, 1.0)
    return float(length_of(place[:, None] - begins - pieces * shares).min())
