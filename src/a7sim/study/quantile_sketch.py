"""Quantiles of any number of values from a few thousand of them, with a bound on how wrong a rank can be."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array

CAPACITY = 2048
"""Values that a level holds before it is halved; even."""

Counts = npt.NDArray[np.int64]


@dataclass
class QuantileSketch:
    """Values in levels, each of which stands for ``2**level`` of those that were added.

    A level that is full is put in order, and every second value goes one level up: the first, third ... and the next
    time the second, fourth ..., so that what this does to a rank cancels as far as it can. The same values in the same
    order give the same sketch, however many were added at once.
    """

    levels: list[Array] = field(default_factory=list)
    halved: list[int] = field(default_factory=list)
    """How often each level was."""

    def add(self, values: Array) -> None:
        """Add numbers ``(n,)``, none of them nan."""
        while values.size:
            room = CAPACITY - self.levels[0].size if self.levels else CAPACITY
            self._put(0, values[:room])
            values = values[room:]

    def _put(self, level: int, values: Array) -> None:
        if level == len(self.levels):
            self.levels.append(np.zeros(0))
            self.halved.append(0)
        held = np.concatenate([self.levels[level], values])
        if held.size < CAPACITY:
            self.levels[level] = held
            return
        every_second = np.sort(held)[self.halved[level] % 2 :: 2]
        self.levels[level] = np.zeros(0)
        self.halved[level] += 1
        self._put(level + 1, every_second)

    @property
    def values(self) -> Array:
        """Values kept ``(n,)``, in no order."""
        return np.concatenate([np.zeros(0), *self.levels])

    @property
    def counts(self) -> Counts:
        """For how many values each one that is kept stands ``(n,)``; their sum is how many were added."""
        return np.repeat(2 ** np.arange(len(self.levels), dtype=np.int64), [level.size for level in self.levels])

    @property
    def rank_error(self) -> int:
        """Return by how many values the rank of any number can be wrong, at most.

        Halving a level moves a rank by ``2**level`` or not at all, up and down by turns. Of a million values it is less
        than 0.25 %.
        """
        return sum((times + 1) // 2 * 2**level for level, times in enumerate(self.halved))
