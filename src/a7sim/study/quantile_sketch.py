"""Quantiles of any number of values from a few thousand stored values, with a bound on the rank error (KLL sketch)."""

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array

CAPACITY = 2048
"""Number of values of a level before it is halved; even."""

Counts = npt.NDArray[np.int64]


@dataclass
class QuantileSketch:
    """Values in levels; a value of a level stands for ``2**level`` added values.

    A full level is sorted and each second value moves one level up: alternately the odd and the even ones, so that rank
    errors cancel. The same values in the same order give the same sketch, whatever the sizes of the added arrays.
    """

    levels: list[Array] = field(default_factory=list)
    halved: list[int] = field(default_factory=list)
    """Number of halvings of each level."""

    def add(self, values: Array) -> None:
        """Add numbers ``(n,)`` without nan."""
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
        """Stored values ``(n,)`` in no order."""
        return np.concatenate([np.zeros(0), *self.levels])

    @property
    def counts(self) -> Counts:
        """Number of added values that each stored value stands for ``(n,)``; the sum is the number of added values."""
        return np.repeat(2 ** np.arange(len(self.levels), dtype=np.int64), [level.size for level in self.levels])

    @property
    def rank_error(self) -> int:
        """Return the maximum error of the rank of any number, in values.

        Halving a level moves a rank by ``2**level`` or not at all, alternately up and down. For a million values the
        error is below 0.25 %.
        """
        return sum((times + 1) // 2 * 2**level for level, times in enumerate(self.halved))
