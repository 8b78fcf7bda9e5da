"""`a7sim train check` over the exercises to the last (issue 8): a file of its own, for another worker."""

import pytest

from tests.exercises import ALL, HALF, see_that_it_holds_what_check_asks


@pytest.mark.parametrize("shelved", ALL[HALF:], ids=lambda each: each.name)
def test_every_exercise_holds_what_check_asks(shelved):
    """The reference passes, every faulty one fails for its reason, nothing is dead or below the floor."""
    see_that_it_holds_what_check_asks(shelved)
