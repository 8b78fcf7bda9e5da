"""Tally of a study's replicates: moments and quantiles of all, and a sample of single replicates."""

from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.study.quantile_sketch import Counts, QuantileSketch

SAMPLE = 10_000
"""Number of replicates of a cell stored one by one: the first ones, since replicates have no order."""


@dataclass
class Tally:
    """Running moments by cell and response ``(cells, responses)``, the sample of each cell, and sketches of the rest.

    Replicates of a cell are added one by one in their order, so that no sum depends on chunk sizes.
    """

    done: Counts
    """Number of added replicates by cell ``(cells,)``."""
    count: Counts
    """Number of replicates with a value; in the others the operator gave up."""
    origin: Array
    """First value, from which deviations are taken."""
    total: Array
    """Sums of the deviations."""
    squares: Array
    """Sums of their squares."""
    low: Array
    high: Array
    samples: list[list[Array]]
    """Blocks ``(responses, n)`` of the first replicates, by cell."""
    sketches: list[list[QuantileSketch]]
    """Sketches of the replicates beyond the sample, by cell and response."""

    @classmethod
    def empty(cls, cells: int, responses: int) -> "Tally":
        """Return an empty tally."""
        shape = (cells, responses)
        return cls(
            np.zeros(cells, dtype=np.int64),
            np.zeros(shape, dtype=np.int64),
            np.zeros(shape),
            np.zeros(shape),
            np.zeros(shape),
            np.full(shape, np.inf),
            np.full(shape, -np.inf),
            [[] for _ in range(cells)],
            [[QuantileSketch() for _ in range(responses)] for _ in range(cells)],
        )

    def add(self, cell: int, values: Array) -> None:
        """Add the next replicates ``(responses, n)`` of a cell; nan marks a replicate that gave up."""
        if not values.size:
            return
        room = max(0, SAMPLE - int(self.done[cell]))
        if room:
            self.samples[cell].append(values[:, :room])
        present = np.isfinite(values)
        for sketch, one, known in zip(self.sketches[cell], values[:, room:], present[:, room:], strict=True):
            sketch.add(one[known])
        begun = (self.count[cell] == 0) & present.any(axis=1)
        self.origin[cell, begun] = values[begun, present[begun].argmax(axis=1)]
        deviations = np.where(present, values - self.origin[cell][:, None], 0.0)
        self.total[cell] = _one_by_one(self.total[cell], deviations)
        self.squares[cell] = _one_by_one(self.squares[cell], deviations**2)
        self.low[cell] = np.minimum(self.low[cell], np.where(present, values, np.inf).min(axis=1, initial=np.inf))
        self.high[cell] = np.maximum(self.high[cell], np.where(present, values, -np.inf).max(axis=1, initial=-np.inf))
        self.count[cell] += present.sum(axis=1)
        self.done[cell] += values.shape[1]

    def sample(self, cell: int) -> Array:
        """Return the first replicates ``(responses, n)`` of a cell, in their order."""
        blocks = self.samples[cell]
        return np.concatenate(blocks, axis=1) if blocks else np.zeros((self.mean.shape[1], 0))

    def spread(self, cell: int, response: int) -> tuple[Array, Counts]:
        """Return values of a response ``(n,)``, in no order, and the number of replicates that each stands for.

        Up to `SAMPLE` replicates each value stands for itself; beyond, a rank has the `rank_error` of its sketch.
        """
        first = self.sample(cell)[response]
        first = first[np.isfinite(first)]
        beyond = self.sketches[cell][response]
        counts = np.concatenate([np.ones(first.size, dtype=np.int64), beyond.counts])
        return np.concatenate([first, beyond.values]), counts

    @property
    def mean(self) -> Array:
        """Means ``(cells, responses)``, 0 without values."""
        return np.asarray(self.origin + self.total / np.maximum(self.count, 1))

    @property
    def sd(self) -> Array:
        """Standard deviations ``(cells, responses)``, nan for fewer than two values."""
        about_the_mean = self.squares - self.total**2 / np.maximum(self.count, 1)
        freedom = np.where(self.count > 1, self.count - 1, np.nan)
        return np.asarray(np.sqrt(np.maximum(about_the_mean, 0.0) / freedom))


def _one_by_one(sums: Array, terms: Array) -> Array:
    """Return sums ``(n,)`` after terms ``(n, k)``, each added to all before it."""
    return np.asarray(np.add.accumulate(np.column_stack([sums, terms]), axis=1)[:, -1])
