"""Running of a study in chunks of replicates; the result does not depend on chunk sizes or executors."""

import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a7sim.geometry import Array
from a7sim.study.checkpoint import save
from a7sim.study.loading import LoadedStudy
from a7sim.study.simulating import Task, replicate_seed
from a7sim.study.tally import Tally

STEP = 100
"""Replicates per cell between two checks of a required precision."""

_TWO_SIDED_95 = 1.959964
_FIRST_CHUNK, _FASTEST_GROWTH = 8, 4.0


@dataclass(frozen=True)
class ChunkPolicy:
    """Policy of chunk sizes; it does not change the results."""

    chunk_seconds: float = 20.0
    """Approximate duration in seconds of a chunk that opens quickly."""
    times_opening: float = 9.0
    """Minimum duration of a chunk as a multiple of its opening time."""
    save_seconds: float = 5.0
    """Minimum interval in seconds between two checkpoints."""
    largest_chunk: int = 5000


class _Size:
    """Size of a chunk in replicates, estimated from the seconds of chunks of other sizes."""

    def __init__(self, pace: ChunkPolicy) -> None:
        self._pace = pace
        self._seconds: dict[int, float] = {}
        self.best = min(_FIRST_CHUNK, pace.largest_chunk)

    def learn(self, replicates: int, seconds: float) -> None:
        """Record the duration of a chunk."""
        self._seconds[replicates] = seconds
        opening, each = self._line()
        grown = max(self._pace.chunk_seconds, self._pace.times_opening * opening) / each
        self.best = max(1, min(int(grown), int(_FASTEST_GROWTH * replicates), self._pace.largest_chunk))

    def _line(self) -> tuple[float, float]:
        """Return the seconds for opening a chunk and for one replicate, from the smallest and the largest known chunk.

        Chunks of one size do not determine them; then most of the time counts as opening time.
        """
        few, many = min(self._seconds), max(self._seconds)
        slowest = max(self._seconds[many] / many, 1e-6)
        quickest = slowest / (1.0 + self._pace.times_opening)
        seen = (self._seconds[many] - self._seconds[few]) / (many - few) if many > few else quickest
        each = min(max(seen, quickest), slowest)
        return self._seconds[many] - each * many, each


@dataclass(frozen=True)
class _Chunk:
    cells: range
    """Cells whose numbers its task gives."""
    first: int
    """First replicate of the chunk."""
    seeds: tuple[int, ...]


def run_study(
    loaded: LoadedStudy,
    tally: Tally,
    executor: Executor,
    at_once: int = 1,
    checkpoint: Path | None = None,
    tick: Callable[[int], None] = lambda _: None,
    pace: ChunkPolicy | None = None,
) -> None:
    """Continue a study from its tally until all replicates are done or its precision is reached.

    `at_once` chunks run while as many wait; results are added in the order of submission. Whatever ends the run, the
    checkpoint contains all that was added.
    """
    pace = pace or ChunkPolicy()
    saved_at = -np.inf
    try:
        for chunk, values in _results(loaded, tally, executor, 2 * at_once, pace):
            for cell, each in zip(chunk.cells, values, strict=True):
                tally.add(cell, each[:, int(tally.done[cell]) - chunk.first :])
            tick(len(chunk.seeds) * len(chunk.cells))
            if checkpoint is not None and time.monotonic() - saved_at > pace.save_seconds:
                save(tally, checkpoint, loaded.identity)
                saved_at = time.monotonic()
    finally:
        if checkpoint is not None:
            save(tally, checkpoint, loaded.identity)


def precision_reached(loaded: LoadedStudy, tally: Tally) -> bool:
    """Return whether the mean of the response of the required precision is known well enough in all cells."""
    wanted = loaded.study.precision
    if wanted is None or int(tally.done.min()) == 0:
        return False
    column = loaded.study.responses.index(wanted.response)
    half_widths = _TWO_SIDED_95 * tally.sd[:, column] / np.sqrt(np.maximum(tally.count[:, column], 1))
    return bool((half_widths <= wanted.half_width).all())


def _results(
    loaded: LoadedStudy, tally: Tally, executor: Executor, most_waiting: int, pace: ChunkPolicy
) -> Iterator[tuple[_Chunk, Array]]:
    for stop in _stops(loaded):
        if int(tally.done.min()) >= stop:
            continue
        if _on_a_step(tally) and precision_reached(loaded, tally):
            return
        yield from _up_to(stop, loaded, tally, executor, most_waiting, pace)


def _on_a_step(tally: Tally) -> bool:
    """Return whether the tally is at a checking step, also if the study was never interrupted."""
    return bool((tally.done == tally.done[0]).all()) and int(tally.done[0]) % STEP == 0


def _stops(loaded: LoadedStudy) -> Iterator[int]:
    """Yield the numbers of replicates after which the precision is checked."""
    if loaded.study.precision is not None:
        yield from range(STEP, loaded.replicates, STEP)
    yield loaded.replicates


def _up_to(
    stop: int, loaded: LoadedStudy, tally: Tally, executor: Executor, most_waiting: int, pace: ChunkPolicy
) -> Iterator[tuple[_Chunk, Array]]:
    asked = tally.done.reshape(len(loaded.tasks), -1).min(axis=1)
    size = _Size(pace)
    waiting: deque[tuple[_Chunk, Future[tuple[Array, float]]]] = deque()
    try:
        while waiting or int(asked.min()) < stop:
            while int(asked.min()) < stop and len(waiting) < most_waiting:
                at = int(asked.argmin())
                first, last = int(asked[at]), min(int(asked[at]) + size.best, stop)
                task = loaded.tasks[at]
                cells = range(at * task.cells, (at + 1) * task.cells)
                chunk = _Chunk(
                    cells, first, tuple(replicate_seed(loaded.study.seed, each) for each in range(first, last))
                )
                waiting.append((chunk, executor.submit(_timed, task, chunk.seeds)))
                asked[at] = last
            chunk, future = waiting.popleft()
            values, seconds = future.result()
            size.learn(len(chunk.seeds), seconds)
            yield chunk, values
    finally:
        for _, future in waiting:
            future.cancel()


def _timed(task: Task, seeds: Sequence[int]) -> tuple[Array, float]:
    """Return the responses ``(cells, responses, seeds)`` of replicates and the CPU seconds they took."""
    began = time.process_time()
    return task.run_batch(seeds), time.process_time() - began
