"""What is kept of a study's replicates: moments of all of them and a sample, the same however they came in."""

from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array
from a7sim.mistakes import Mistake

SAMPLE = 10_000
"""Replicates of a cell that are kept one by one: the first, since replicates come in no order."""

Counts = npt.NDArray[np.int64]
_ARRAYS = ("done", "count", "mean", "squares", "low", "high")


@dataclass
class Tally:
    """Running moments by cell and response ``(cells, responses)`` and the sample of each cell.

    Replicates of a cell are added in their order one by one, so that no sum depends on how they were cut in chunks.
    """

    done: Counts
    """Replicates added, by cell ``(cells,)``."""
    count: Counts
    """Of them, those with a number: the others gave up."""
    mean: Array
    squares: Array
    """Sums of the squared deviations from the mean."""
    low: Array
    high: Array
    samples: list[list[Array]]
    """Blocks ``(responses, n)`` of the first replicates, by cell."""

    @classmethod
    def empty(cls, cells: int, responses: int) -> "Tally":
        """Return a tally of nothing."""
        shape = (cells, responses)
        return cls(
            np.zeros(cells, dtype=np.int64),
            np.zeros(shape, dtype=np.int64),
            np.zeros(shape),
            np.zeros(shape),
            np.full(shape, np.inf),
            np.full(shape, -np.inf),
            [[] for _ in range(cells)],
        )

    def add(self, cell: int, values: Array) -> None:
        """Add the next replicates ``(responses, n)`` of a cell; nan is one that gave up (Welford's recurrence)."""
        room = max(0, SAMPLE - int(self.done[cell]))
        if room:
            self.samples[cell].append(values[:, :room])
        for one in values.T:
            there = np.isfinite(one)
            self.count[cell] += there
            before = np.where(there, one - self.mean[cell], 0.0)
            self.mean[cell] += before / np.maximum(self.count[cell], 1)
            self.squares[cell] += before * np.where(there, one - self.mean[cell], 0.0)
            self.low[cell] = np.fmin(self.low[cell], one)
            self.high[cell] = np.fmax(self.high[cell], one)
        self.done[cell] += values.shape[1]

    def sample(self, cell: int) -> Array:
        """Return the first replicates ``(responses, n)`` of a cell, in their order."""
        blocks = self.samples[cell]
        return np.concatenate(blocks, axis=1) if blocks else np.zeros((self.mean.shape[1], 0))

    @property
    def sd(self) -> Array:
        """Standard deviations ``(cells, responses)``, nan for fewer than two numbers."""
        freedom = np.where(self.count > 1, self.count - 1, np.nan)
        return np.asarray(np.sqrt(self.squares / freedom))

    def save(self, path: Path, identity: str) -> None:
        """Write all of it so that the file is there whole or not at all; the same tally gives the same bytes."""
        arrays = {name: getattr(self, name) for name in _ARRAYS}
        samples = {f"sample{cell}": self.sample(cell) for cell in range(len(self.done))}
        held = BytesIO()
        np.savez(held, allow_pickle=False, identity=np.array(identity), **arrays, **samples)
        temporary = path.with_name(path.name + ".part")
        temporary.write_bytes(held.getvalue())
        temporary.replace(path)

    @classmethod
    def load(cls, path: Path, identity: str) -> "Tally":
        """Return what `save` wrote. Raises Mistake for a damaged file or one of another study."""
        try:
            with np.load(path, allow_pickle=False) as held:
                whose = str(held["identity"])
                arrays = {name: held[name] for name in _ARRAYS}
                samples = [[held[f"sample{cell}"]] for cell in range(len(arrays["done"]))]
        except (OSError, ValueError, KeyError, EOFError) as error:
            raise Mistake(f"{path}: expected the checkpoint of a study, got a file that is none: {error}") from error
        if whose != identity:
            raise Mistake(f"{path}: expected the checkpoint of this study, got that of another (--force begins anew)")
        return cls(**arrays, samples=samples)
