"""Lines on the ground: roads and tracks, smooth in plan, lighter than their surroundings."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array, dots
from a7sim.scenario.schema import LinePlan
from a7sim.scene.coverage import within_band

TONE, TEXTURE = 0.85, 0.3
"""Mean grey of a road (bare ground has a mean of 0.5), and its share of the ground's texture [assumptions]."""

_PIECES = 24
"""Number of straight pieces of a line between two vertices."""

_POINT_M2 = 1e-12
"""Squared length below which a piece counts as a point."""


@dataclass(frozen=True)
class GroundLine:
    """Line in plan: its middle as a polyline ``(2, n)`` and its width, all in m."""

    name: str
    kind: str
    width: float
    middle: Array

    def distance(self, plan: Array, within: float | None = None) -> Array:
        """Return the distance of positions ``(2, ...)`` from the middle, in m; infinity where it may exceed `within`.

        The default of `within` is the width.
        """
        return distance_from(self.middle, plan, self.width if within is None else within)


def distance_from(chain: Array, plan: Array, within: float) -> Array:
    """Return the distance of positions ``(2, ...)`` from a polyline ``(2, n)``.

    Infinity where it may exceed `within`.
    """
    places = plan.reshape(2, -1)
    low, high = places.min(axis=1)[:, None] - within, places.max(axis=1)[:, None] + within
    begins, ends = chain[:, :-1], chain[:, 1:]
    near = ((np.maximum(begins, ends) >= low) & (np.minimum(begins, ends) <= high)).all(axis=0)
    nearest = np.full(places.shape[1], np.inf)
    for begin, end in zip(begins[:, near].T, ends[:, near].T, strict=True):
        piece, offset = end - begin, places - begin[:, None]
        share = np.clip(piece @ offset / max(piece @ piece, _POINT_M2), 0.0, 1.0)
        offset -= piece[:, None] * share
        nearest = np.minimum(nearest, dots(offset, offset))
    return np.asarray(np.sqrt(nearest).reshape(plan.shape[1:]))


def make_lines(lines: Sequence[LinePlan]) -> dict[str, GroundLine]:
    """Return the lines of a scenario by name. Raises A7SimError if two have the same name."""
    found: dict[str, GroundLine] = {}
    for line in lines:
        if line.name in found:
            raise A7SimError(f"lines: expected every name once, got {line.name!r} twice")
        found[line.name] = GroundLine(line.name, line.kind, line.width, _smooth(np.array(line.vertices).T))
    return found


def _smooth(vertices: Array) -> Array:
    """Return the polyline ``(2, n)`` of a Catmull-Rom curve through vertices ``(2, m)``."""
    before = np.concatenate([2.0 * vertices[:, :1] - vertices[:, 1:2], vertices], axis=1)
    points = np.concatenate([before, 2.0 * vertices[:, -1:] - vertices[:, -2:-1]], axis=1)
    t = np.arange(_PIECES) / _PIECES
    p0, p1, p2, p3 = (points[:, i : points.shape[1] - 3 + i, None] for i in range(4))
    curve = 0.5 * (
        2.0 * p1 + (p2 - p0) * t + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t**2 + (3.0 * p1 - p0 - 3.0 * p2 + p3) * t**3
    )
    return np.concatenate([curve.reshape(2, -1), vertices[:, -1:]], axis=1)


def with_lines(lines: Sequence[GroundLine], plan: Array, grey: Array, element: float) -> Array:
    """Return the grey ``(...)`` of ground positions ``(2, ...)`` with the lines drawn over it.

    Edges are as wide as a picture element on the ground, in m.
    """
    for line in lines:
        distance = line.distance(plan, line.width + element)
        cover = within_band(distance, line.width / 2.0, element)
        grey = grey + cover * (TONE + TEXTURE * (grey - 0.5) - grey)
    return grey
