"""Emulsion of a photograph: resolution, and grain that differs for each film."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from a7sim.geometry import Array
from a7sim.scene.noise import value_noise

RESOLVED_MM = 0.02
"""Width of the sharpest edge that lens and film resolve together [assumption]."""

GRAIN_MM, GRAIN = 0.015, 0.015
"""Size of the grains, and their deviation in grey, of 0..1 [assumptions]."""

_GRAIN_STREAM = 0


@dataclass(frozen=True)
class Emulsion:
    """Emulsion of a photograph; seed and spawn key determine its random numbers."""

    seed: int
    photograph: tuple[int, ...]

    @cached_property
    def stream(self) -> int:
        """Number of the noise of its grain."""
        grain = np.random.SeedSequence(self.seed, spawn_key=(*self.photograph, _GRAIN_STREAM))
        return int(grain.generate_state(1)[0])

    def resolved(self, element: float) -> float:
        """Return the width of an edge in mm on film, for picture elements of this width."""
        return max(element, RESOLVED_MM)

    def exposed(self, xy: Array, light: Array, element: float) -> Array:
        """Return the greys 0..1 of film positions ``(2, ...)`` in mm exposed to this light, with grain.

        A picture element that covers many grains shows their mean: its noise decreases with its side.
        """
        clumps = max(1.0, element / GRAIN_MM)
        doublings = int(np.ceil(np.log2(clumps)))
        side = GRAIN_MM * 2.0**doublings
        grain = value_noise(xy[0] / side, xy[1] / side, self.stream + doublings)
        return np.asarray(np.clip(light + GRAIN / clumps * grain, 0.0, 1.0))
