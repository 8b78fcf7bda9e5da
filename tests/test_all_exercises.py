"""`a7sim train check-exercise` over all exercises."""

import pytest

from a7sim.training.catalogue import all_exercises
from tests.support.exercises import assert_exercise_holds

EXERCISES = [
    pytest.param(entry, id=entry.name, marks=pytest.mark.xdist_group(f"exercises {number % 2}"))
    for number, entry in enumerate(all_exercises())
]
"""Every second exercise belongs to the same group, so that two workers check about half of them each."""


@pytest.mark.parametrize("entry", EXERCISES)
def test_every_exercise_passes_its_check(entry):
    """The reference passes, every faulty script fails for its reason, and every criterion has an effect."""
    assert_exercise_holds(entry)
