"""All exercises, for the two test files that share `a7sim train check` between them."""

from a7sim.training.catalogue import all_exercises
from a7sim.training.checking import check_exercise

ALL = all_exercises()
HALF = 11
"""How many exercises take about as long to check as those that come after them."""


def see_that_it_holds_what_check_asks(shelved):
    """The reference passes, every faulty one fails for its reason, nothing is dead or below the floor."""
    found = check_exercise(shelved)
    assert found.faults == ()
    assert found.reference_points is not None and found.reference_points >= shelved.exercise.pass_points
