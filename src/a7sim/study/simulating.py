"""Working replicates of a cell together on the batch bench."""

from collections.abc import Sequence

import numpy as np

from a7sim.documents import Document
from a7sim.geometry import Array
from a7sim.scenario import Scenario
from a7sim.session.ways import documents_of_all_ways
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
    return _values(documents_of_all_ways(scenario, seeds), [response_of(name) for name in responses])


def _values(documents: Sequence[Document], responses: Sequence[Response]) -> Array:
    return np.array([[response.of(document) for document in documents] for response in responses])
