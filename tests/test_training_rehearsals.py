"""Rehearsals, by which `a7sim train check` judges faulty attempts: nothing is kept, and nothing is otherwise."""

import pytest

from a7sim.training.attempts import run_attempt, seed_for
from a7sim.training.catalogue import find_exercise
from a7sim.training.dry_runs import DryRuns
from a7sim.training.grading import evaluate_metrics, load_record


def seen(account):
    witness = account.witness
    return witness.deeds, witness.readings, witness.sides, account.seconds, account.answers, account.autograph.state()


@pytest.mark.parametrize("number", ["4", "9", "12"])
def test_a_rehearsal_comes_to_what_the_journal_of_the_same_attempt_gives(number, tmp_path):
    """By a script and by a procedure, after an opening and without: every deed, reading and measure, to the digit.

    The second rehearsal begins from an opening that was done for the first.
    """
    shelved = find_exercise(number)
    played = shelved.exercise.faulty[0]
    rehearsals = DryRuns(shelved)
    rehearsals.run_attempt(shelved.exercise.reference)
    rehearsed, trouble = rehearsals.run_attempt(played)
    seed = seed_for(shelved, played)
    assert run_attempt(shelved, played, tmp_path, seed) == trouble
    journalled = load_record(shelved, seed, tmp_path)
    assert len(journalled.actions) > 0
    assert seen(rehearsed) == seen(journalled)
    assert evaluate_metrics(rehearsed) == evaluate_metrics(journalled)


def test_what_is_rehearsed_leaves_the_opening_as_it_was():
    rehearsals = DryRuns(find_exercise("9"))
    seed = seed_for(rehearsals.shelved, rehearsals.shelved.exercise.reference)
    before = rehearsals.run_and_leave(seed, None)
    rehearsals.run_attempt(rehearsals.shelved.exercise.reference)
    assert seen(rehearsals.run_and_leave(seed, None)) == seen(before)
