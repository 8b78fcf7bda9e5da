"""Simulation of the replicates of a cell as a batch of sessions."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.result_documents import Document
from a7sim.scenario import Scenario
from a7sim.scene import build_scene
from a7sim.session.all_methods import (
    measure_all_methods,
    measure_all_methods_batch,
    run_all_methods,
    run_all_methods_batch,
)
from a7sim.session.combination_batch import Cases, Replicate, cases_of_strips, combine_strips
from a7sim.session.strip_combinations import with_case
from a7sim.standard_points import CASES
from a7sim.strip_methods.strip import ground_control
from a7sim.study.responses import find_response, is_path, needs_strip

_STREAM = 9
"""Spawn key of the seeds of a study's replicates."""


def replicate_seed(study_seed: int, replicate: int) -> int:
    """Return the seed of a replicate, the same in all cells and valid for `a7sim run --seed`."""
    state = np.random.SeedSequence(study_seed, spawn_key=(_STREAM, replicate)).generate_state(1, np.uint64)
    return int(state[0] >> np.uint64(11))


@dataclass(frozen=True)
class Task:
    """Work of a worker for some seeds: sessions of a scenario that give the numbers of one or several cells."""

    scenario: Scenario
    responses: tuple[str, ...]
    strips: bool = False
    """Sessions are run in all cases, and cells are the strips of all combinations of their models."""

    @property
    def cells(self) -> int:
        """Number of cells whose numbers it gives."""
        return len(cases_of_strips(tuple(CASES), len(self.scenario.models))) if self.strips else 1

    def run_batch(self, seeds: Sequence[int]) -> Array:
        """Return responses ``(cells, responses, seeds)`` of a batch of sessions; nan where the operator gave up.

        Raises A7SimError for a response that the results do not have.
        """
        strips, whole = any(map(needs_strip, self.responses)), any(map(is_path, self.responses))
        return self._values(self._crowded(seeds, tuple(CASES), strips, whole))

    def run_single(self, cell: int, seed: int) -> Array:
        """Return responses ``(responses,)`` of one cell; its sessions run over the link as in `a7sim run`."""
        return np.asarray(self._values([[self.link_document(cell, seed)]])[0, :, 0])

    def batch_documents(self, cell: int, seeds: Sequence[int]) -> list[Document]:
        """Return the documents of one cell by seed, of a batch of sessions."""
        cases, place = self._cases_of(cell)
        return [each[place] for each in self._crowded(seeds, cases, strips=True, whole=True)]

    def link_document(self, cell: int, seed: int) -> Document:
        """Return the document of one cell, of sessions over the link."""
        if not self.strips:
            return run_all_methods(self.scenario, seed)
        cases, place = self._cases_of(cell)
        (strips,) = self._strips(
            [{case: measure_all_methods(with_case(self.scenario, case), seed) for case in cases}], [seed]
        )
        return strips[place]

    def _cases_of(self, cell: int) -> tuple[Cases, int]:
        """Return the cases of the models of a cell, each once, and the index of the cell among all strips of these
        cases.
        """
        if not self.strips:
            return (), 0
        models = len(self.scenario.models)
        of_cell = cases_of_strips(tuple(CASES), models)[cell]
        cases = tuple(dict.fromkeys(of_cell))
        return cases, cases_of_strips(cases, models).index(of_cell)

    def _crowded(self, seeds: Sequence[int], cases: Cases, strips: bool, whole: bool) -> Iterator[list[Document]]:
        if not self.strips:
            return ([each] for each in run_all_methods_batch(self.scenario, seeds, strips, whole))
        by_case = {
            case: measure_all_methods_batch(with_case(self.scenario, case), seeds, strips=False) for case in cases
        }
        replicates = [{case: each[i] for case, each in by_case.items()} for i in range(len(seeds))]
        return self._strips(replicates, seeds, whole)

    def _strips(
        self, replicates: Sequence[Replicate], seeds: Sequence[int], whole: bool = True
    ) -> Iterator[list[Document]]:
        scenario = self.scenario
        ground = ground_control(scenario, build_scene(scenario, seeds[0]))
        return combine_strips(replicates, len(scenario.models), ground, scenario.strip, brief=not whole)

    def _values(self, replicates: Iterable[Sequence[Document]]) -> Array:
        """Return responses ``(cells, responses, replicates)`` of documents by replicate and cell."""
        responses = [find_response(name) for name in self.responses]
        read = [np.array([response.of_all(cells) for response in responses]).T for cells in replicates]
        return np.stack(read, axis=-1)
