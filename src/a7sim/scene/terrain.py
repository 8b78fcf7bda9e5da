"""Ground surface under the flight."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array
from a7sim.scenario.schema import Terrain

BoolArray = npt.NDArray[np.bool_]

_WAVES = 7

_MAX_ROUNDS, _SETTLED_M = 8, 0.01
"""Maximum number of iterations of the intersection of a ray with the ground; each reduces the error to a tenth or less.
"""


@dataclass(frozen=True)
class GroundSurface:
    """Rolling ground: a sum of plane waves that stays within mean_height -+ relief."""

    mean_height: float
    amplitudes: Array
    wave_numbers: Array
    phases: Array
    shores: tuple[Array, ...] = ()
    """Shore of each water surface: closed polyline ``(2, n)`` in m."""

    @classmethod
    def of(cls, terrain: Terrain) -> "GroundSurface":
        """Return the ground of a scenario; the same terrain gives the same ground."""
        rng = np.random.default_rng(terrain.seed)
        azimuths = rng.uniform(0.0, 2.0 * np.pi, _WAVES)
        lengths = terrain.wavelength * rng.uniform(0.5, 1.5, _WAVES)
        shares = rng.uniform(0.5, 1.0, _WAVES)
        return cls(
            terrain.mean_height,
            terrain.relief * shares / shares.sum(),
            2.0 * np.pi / lengths * np.array([np.cos(azimuths), np.sin(azimuths)]),
            rng.uniform(0.0, 2.0 * np.pi, _WAVES),
            tuple(np.array(water.shore).T for water in terrain.water),
        )

    def height(self, east: Array, north: Array) -> Array:
        """Return the heights in m at positions of any shape, in m."""
        plan = np.array([east, north], dtype=float)
        phases = np.einsum("iw,i...->w...", self.wave_numbers, plan)
        waves = np.sin(phases + self.phases.reshape((_WAVES,) + (1,) * (plan.ndim - 1)))
        return np.asarray(self.mean_height + np.einsum("w,w...->...", self.amplitudes, waves))

    def intersect(self, centre: Array, direction: Array) -> Array:
        """Return the intersections of rays ``(3, ...)`` going down from a centre ``(3,)`` with the ground, ``(3, ...)``
        in m.
        """
        rays = direction.reshape(3, -1)
        middle = rays[:, rays.shape[1] // 2, None]
        level = self._met(centre[:, None], middle, np.array([self.mean_height]))[2]
        return self._met(centre[:, None], rays, level).reshape(direction.shape)

    def _met(self, centre: Array, rays: Array, level: Array) -> Array:
        """Return the intersections of rays ``(3, n)`` with the ground, starting near a height ``(1,)``."""
        for _ in range(_MAX_ROUNDS):
            met = centre + (level - centre[2]) / rays[2] * rays
            ground = self.height(met[0], met[1])
            settled = np.abs(ground - level).max() < _SETTLED_M
            level = ground
            if settled:
                break
        return np.asarray(centre + (level - centre[2]) / rays[2] * rays)

    def under_water(self, plan: Array) -> BoolArray:
        """Return which positions ``(2, ...)`` in m lie within a shore."""
        wet = np.zeros(plan.shape[1:], dtype=bool)
        for shore in self.shores:
            wet |= _within(shore, plan)
        return wet


def _within(border: Array, plan: Array) -> BoolArray:
    """Return which positions ``(2, ...)`` a closed border ``(2, n)`` encloses:

    a line to the east crosses it an odd number of times.
    """
    east, north = plan
    odd = np.zeros(plan.shape[1:], dtype=bool)
    for (x1, y1), (x2, y2) in zip(border.T, np.roll(border, -1, axis=1).T, strict=True):
        if y1 != y2:
            crossing = x1 + (north - y1) / (y2 - y1) * (x2 - x1)
            odd ^= ((y1 > north) != (y2 > north)) & (east < crossing)
    return odd
