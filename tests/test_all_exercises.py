"""`a7sim train check` over all exercises (issue 8). A file of its own, since it is the longest and so begins early."""

import pytest

from a7sim.training.checking import checked
from a7sim.training.shelf import all_exercises


@pytest.mark.parametrize("shelved", all_exercises(), ids=lambda each: each.name)
def test_every_exercise_holds_what_check_asks(shelved):
    """The reference passes, every faulty one fails for its reason, nothing is dead or below the floor."""
    found = checked(shelved)
    assert found.faults == ()
    assert found.reference_points is not None and found.reference_points >= shelved.exercise.pass_points
