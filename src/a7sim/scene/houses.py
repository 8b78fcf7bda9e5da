"""Houses: hamlets along the lines on the ground, seen from above as flat roofs."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array, length_of
from a7sim.scene.coverage import within_band
from a7sim.scene.lines import GroundLine
from a7sim.scene.terrain import GroundSurface

HOUSES_STREAM = 8
"""Spawn key of the houses' random numbers, under the seed of the terrain."""

HAMLET_EVERY_M, HAMLET_M = 220.0, 45.0
"""Mean distance of hamlets along a line, and their extent on each side [assumptions]."""

_MIN_HOUSES, _MAX_HOUSES = 3, 7
"""Number of houses of a hamlet."""

_LONG_M, _DEEP_M = (9.0, 15.0), (8.0, 11.0)
_SETBACK_M = (7.0, 18.0)
_SKEWED = 0.12
_ROOFS = (0.2, 0.34)
"""Greys of weathered tin and thatch: darker than bare ground and unlike a road."""

_TEXTURE = 0.3
"""Share of the ground's texture on a roof [assumption]: detail for the mark."""

_APART_M = 2.0


@dataclass(frozen=True)
class Houses:
    """Roofs in plan: middles ``(2, n)``, directions of the longer side ``(2, n)``, half sides ``(2, n)`` and greys."""

    middle: Array
    towards: Array
    half: Array
    roof: Array

    @property
    def reach(self) -> Array:
        """Distance of corners from the middle ``(n,)``, m."""
        return length_of(self.half)

    def over(self, plan: Array, grey: Array, element: float) -> Array:
        """Return the grey ``(...)`` of ground positions ``(2, ...)`` with roofs drawn over it.

        Edges are as wide as a picture element on the ground, in m.
        """
        places = plan.reshape(2, -1)
        reach = self.reach + element
        low, high = places.min(axis=1)[:, None] - reach, places.max(axis=1)[:, None] + reach
        near = np.flatnonzero(((self.middle > low) & (self.middle < high)).all(axis=0))
        if not near.size:
            return grey
        roofed = grey.reshape(-1).copy()
        for i in near:
            offset = places - self.middle[:, i, None]
            here = np.flatnonzero((np.abs(offset) <= reach[i]).all(axis=0))
            along, across = self.towards[:, i] @ offset[:, here], _left_of(self.towards[:, i]) @ offset[:, here]
            cover = within_band(along, self.half[0, i], element) * within_band(across, self.half[1, i], element)
            roofed[here] += cover * (self.roof[i] + _TEXTURE * (roofed[here] - 0.5) - roofed[here])
        return roofed.reshape(grey.shape)


NO_HOUSES = Houses(np.zeros((2, 0)), np.zeros((2, 0)), np.zeros((2, 0)), np.zeros(0))
"""No house."""


def houses_along(lines: Iterable[GroundLine], ground: GroundSurface, seed: int) -> Houses:
    """Return the houses along lines: on dry ground, beside all lines and apart from each other.

    The same lines on the same terrain have the same houses.
    """
    lines = tuple(lines)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(HOUSES_STREAM,)))
    plots = [_plots(line, rng) for line in lines]
    drawn = Houses(*(np.concatenate(each, axis=-1) for each in zip(*plots, strict=True))) if plots else NO_HOUSES
    reach = drawn.reach
    free = ~ground.under_water(drawn.middle)
    for line in lines:
        chain = line.middle[:, :, None] - drawn.middle[:, None, :]
        free &= length_of(chain).min(axis=0, initial=np.inf) > line.width / 2.0 + reach + _APART_M
    kept: list[int] = []
    for i in np.flatnonzero(free):
        apart = length_of(drawn.middle[:, kept] - drawn.middle[:, i, None]) - reach[kept] - reach[i]
        if (apart > _APART_M).all():
            kept.append(int(i))
    return Houses(drawn.middle[:, kept], drawn.towards[:, kept], drawn.half[:, kept], drawn.roof[kept])


def _plots(line: GroundLine, rng: np.random.Generator) -> tuple[Array, Array, Array, Array]:
    """Draw middles, directions, half sides and roofs of the houses along a line."""
    pieces = length_of(np.diff(line.middle))
    mileage = np.concatenate([[0.0], np.cumsum(pieces)])
    hamlets = np.arange(HAMLET_EVERY_M * rng.uniform(0.2, 0.6), mileage[-1], HAMLET_EVERY_M)
    hamlets = hamlets + HAMLET_EVERY_M * rng.uniform(-0.25, 0.25, hamlets.size)
    at = np.repeat(hamlets, rng.integers(_MIN_HOUSES, _MAX_HOUSES, hamlets.size, endpoint=True))
    at = np.clip(at + rng.uniform(-HAMLET_M, HAMLET_M, at.size), 0.0, mileage[-1])
    half = np.array([rng.uniform(*_LONG_M, at.size), rng.uniform(*_DEEP_M, at.size)]) / 2.0
    side = rng.choice([-1.0, 1.0], at.size)
    setback = side * (line.width / 2.0 + half[1] + rng.uniform(*_SETBACK_M, at.size))
    roof = rng.uniform(*_ROOFS, at.size)
    turn = rng.uniform(-_SKEWED, _SKEWED, at.size)
    step = np.minimum(np.searchsorted(mileage, at, side="right") - 1, pieces.size - 1)
    along = np.diff(line.middle)[:, step] / pieces[step]
    foot = line.middle[:, step] + (at - mileage[step]) * along
    towards = np.cos(turn) * along + np.sin(turn) * _left_of(along)
    return foot + setback * _left_of(along), towards, half, roof


def _left_of(direction: Array) -> Array:
    return np.array([-direction[1], direction[0]])
