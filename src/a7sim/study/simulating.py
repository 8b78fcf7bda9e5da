"""Working replicates of a cell: together on the batch bench, or one alone over the link."""

from collections.abc import Sequence

import numpy as np

from a7sim.documents import Document
from a7sim.geometry import Array
from a7sim.scenario import Scenario
from a7sim.scene import Flight
from a7sim.session import results
from a7sim.session.crowd import open_crowd
from a7sim.session.ways import results_by_computing, run_all_ways
from a7sim.study.responses import Response, response_of

_STREAM = 9
"""Spawns the seeds of a study's replicates."""


def seed_of(study_seed: int, replicate: int) -> int:
    """Return the seed of a replicate, the same in every cell; `a7sim run --seed` takes it."""
    state = np.random.SeedSequence(study_seed, spawn_key=(_STREAM, replicate)).generate_state(1, np.uint64)
    return int(state[0] >> np.uint64(11))


def together(scenario: Scenario, seeds: Sequence[int], responses: Sequence[str]) -> Array:
    """Return responses ``(responses, seeds)`` of sessions worked at once; nan where a session gave up.

    Raises Mistake for a response that the results do not have.
    """
    of_strips = any(name.startswith("strip") for name in responses)
    return _values(_documents(scenario, seeds, of_strips), [response_of(name) for name in responses])


def alone(scenario: Scenario, seed: int, responses: Sequence[str]) -> Array:
    """Return responses ``(responses,)`` of one session worked over the link, as `a7sim run` does."""
    return np.asarray(_values([run_all_ways(scenario, seed)], [response_of(name) for name in responses])[:, 0])


def _documents(scenario: Scenario, seeds: Sequence[int], strips: bool = True) -> list[Document]:
    if "plotter" in scenario.work:
        documents = open_crowd(scenario, seeds).documents(strips)
    else:
        documents = [results.header(scenario, seed) | {"status": "complete", "message": ""} for seed in seeds]
    if scenario.work != ["plotter"]:
        flight = Flight.of(scenario)
        computed = [results_by_computing(scenario, flight.scene(seed), seed) for seed in seeds]
        documents = [one | other for one, other in zip(documents, computed, strict=True)]
    return documents


def _values(documents: Sequence[Document], responses: Sequence[Response]) -> Array:
    return np.array([[response.of(document) for document in documents] for response in responses])
