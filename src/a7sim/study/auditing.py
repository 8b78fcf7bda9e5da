"""Audit of a study: selected replicates are run again in a batch and over the link, and must agree."""

import math
from collections import defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from a7sim.study.loading import LoadedStudy
from a7sim.study.responses import SIGNIFICANT
from a7sim.study.simulating import replicate_seed
from a7sim.study.tally import Tally

_STREAM = 11
"""Spawn key of the random selection."""
_AS_NOTHING = 1e-9
"""Tolerance for sums that cancel; a least count is far larger."""


@dataclass(frozen=True)
class AuditDifference:
    """First difference of a session between batch and link."""

    cell: int
    replicate: int
    seed: int
    place: str
    """Name of a response, or path of a value in the results."""
    batch_value: Any
    link_value: Any
    others: int = 0
    """Number of further values that differ."""

    def __str__(self) -> str:
        more = f" ({self.others} values more differ)" if self.others else ""
        return (
            f"cell {self.cell}, replicate {self.replicate}, seed {self.seed}: {self.place} is "
            f"{_describe(self.batch_value)} on the batch bench and {_describe(self.link_value)} over the link{more}"
        )


def audit_study(
    loaded: LoadedStudy, tally: Tally, picks: int, tick: Callable[[], None] = lambda: None
) -> list[AuditDifference]:
    """Run `picks` selected replicates in a batch and over the link;

    return one difference for each session that disagrees.

    Over the link a replicate must give the responses in the tally, to the last digit, and all values in the batch
    results: settings, readings, centres, model coordinates, strip. The selection follows from the seed of the study;
    each replicate is selected once at most.
    """
    picked = _picked(loaded, tally, picks)
    found = []
    for i, replicates in picked.items():
        seeds = [replicate_seed(loaded.study.seed, replicate) for replicate in replicates]
        sample = tally.sample(i)
        task, cell = loaded.task_of(i)
        for replicate, seed, on_the_bench in zip(replicates, seeds, task.batch_documents(cell, seeds), strict=True):
            linked = task.link_document(cell, seed)
            kept = zip(loaded.responses, sample[:, replicate].tolist(), strict=True)
            differences = [
                *((response.name, one, other) for response, one in kept if _off(one, other := response.of(linked))),
                *_different(on_the_bench, linked),
            ]
            if differences:
                where = (loaded.cells[i].number, replicate + 1, seed)
                found.append(AuditDifference(*where, *differences[0], others=len(differences) - 1))
            tick()
    return found


def _picked(loaded: LoadedStudy, tally: Tally, picks: int) -> Mapping[int, list[int]]:
    """Return the selected replicates by the index of their cell."""
    existing = [(i, replicate) for i in range(len(loaded.cells)) for replicate in range(tally.sample(i).shape[1])]
    rng = np.random.default_rng(np.random.SeedSequence(loaded.study.seed, spawn_key=(_STREAM,)))
    picked = defaultdict(list)
    for pick in rng.permutation(len(existing))[:picks].tolist():
        i, replicate = existing[pick]
        picked[i].append(replicate)
    return picked


def _off(one: float, other: float) -> bool:
    return one != other and not (math.isnan(one) and math.isnan(other))


def _different(bench: Any, link: Any, place: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield path and both values where the batch results differ from the link results, which contain more keys."""
    if isinstance(bench, Mapping) and isinstance(link, Mapping):
        for name, value in bench.items():
            yield from _different(value, link.get(name), f"{place}.{name}".lstrip("."))
    elif isinstance(bench, list | tuple) and isinstance(link, list | tuple) and len(bench) == len(link):
        for i, (one, other) in enumerate(zip(bench, link, strict=True)):
            yield from _different(one, other, f"{place}.{i}")
    elif isinstance(bench, float) and isinstance(link, float):
        if not (math.isclose(bench, link, rel_tol=10.0**-SIGNIFICANT, abs_tol=_AS_NOTHING) or not _off(bench, link)):
            yield place, bench, link
    elif bench != link:
        yield place, bench, link


def _describe(value: Any) -> str:
    return f"{value:.{SIGNIFICANT}g}" if isinstance(value, float) else str(value)[:60]
