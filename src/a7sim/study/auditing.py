"""An audit: replicates picked from a study are worked again, alone and over the link, and must give every digit."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from a7sim.study.loading import Laid
from a7sim.study.simulating import seed_of
from a7sim.study.tally import Tally

_STREAM = 11
"""Spawns the picks."""


@dataclass(frozen=True)
class Difference:
    """A response of a replicate that is not the same over the link."""

    cell: int
    replicate: int
    seed: int
    response: str
    on_the_bench: float
    over_the_link: float

    def __str__(self) -> str:
        where = f"cell {self.cell}, replicate {self.replicate}, seed {self.seed}"
        return (
            f"{where}: {self.response} is {self.on_the_bench:.10g} on the batch bench and "
            f"{self.over_the_link:.10g} over the link"
        )


def audited(laid: Laid, tally: Tally, picks: int, tick: Callable[[], None] = lambda: None) -> list[Difference]:
    """Work so many picked replicates over the link and return all that differs from the tally, to the last digit.

    The picks follow from the study's seed, each another replicate; fewer where the study has fewer.
    """
    samples = [tally.sample(i) for i in range(len(laid.cells))]
    there = [(i, replicate) for i, sample in enumerate(samples) for replicate in range(sample.shape[1])]
    rng = np.random.default_rng(np.random.SeedSequence(laid.study.seed, spawn_key=(_STREAM,)))
    found = []
    for pick in rng.permutation(len(there))[:picks].tolist():
        i, replicate = there[pick]
        seed = seed_of(laid.study.seed, replicate)
        task, cell = laid.task_of(i)
        again = task.alone(cell, seed)
        for name, one, other in zip(laid.study.responses, samples[i][:, replicate].tolist(), again, strict=True):
            if not np.array_equal(one, other, equal_nan=True):
                found.append(Difference(laid.cells[i].number, replicate + 1, seed, name, one, float(other)))
        tick()
    return found
