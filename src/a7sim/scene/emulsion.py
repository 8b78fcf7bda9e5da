"""The emulsion of a photograph: how fine it resolves, and its grain, which every film has of its own."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from a7sim.geometry import Array
from a7sim.scene.noise import value_noise

RESOLVED_MM = 0.02
"""Width of the sharpest edge that lens and film show together [assumption]."""

GRAIN_MM, GRAIN = 0.015, 0.015
"""Size of the clumps that are seen as grain, and how far one is lighter or darker than it should be, of 0..1
[assumptions]."""

_GRAIN_STREAM = 0


@dataclass(frozen=True)
class Emulsion:
    """The emulsion of a photograph whose random numbers a seed draws under a spawn key."""

    seed: int
    photograph: tuple[int, ...]

    @cached_property
    def salt(self) -> int:
        """The number that its grain is drawn with."""
        grain = np.random.SeedSequence(self.seed, spawn_key=(*self.photograph, _GRAIN_STREAM))
        return int(grain.generate_state(1)[0])

    def resolved(self, element: float) -> float:
        """Return how wide an edge is drawn in picture elements so wide, in mm on film."""
        return max(element, RESOLVED_MM)

    def exposed(self, xy: Array, light: Array, element: float) -> Array:
        """Return the greys 0..1 of film places ``(2, ...)`` in mm that got so much light, with the grain.

        A picture element that covers many clumps shows their mean: noise of elements, weaker as their side is larger.
        """
        clumps = max(1.0, element / GRAIN_MM)
        doublings = int(np.ceil(np.log2(clumps)))
        side = GRAIN_MM * 2.0**doublings
        grain = value_noise(xy[0] / side, xy[1] / side, self.salt + doublings)
        return np.asarray(np.clip(light + GRAIN / clumps * grain, 0.0, 1.0))
