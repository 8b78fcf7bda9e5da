"""Rehearsals, by which `a7sim train check` judges faulty attempts: nothing is kept, and nothing is otherwise."""

import pytest

from a7sim.training.attempts import run_attempt, seed_for
from a7sim.training.catalogue import find_exercise
from a7sim.training.dry_runs import DryRuns
from a7sim.training.grading import evaluate_metrics, load_record


def seen(account):
    witness = account.action_log
    return witness.actions, witness.readings, witness.sides, account.seconds, account.answers, account.autograph.state()


@pytest.mark.parametrize("number", ["4", "9", "12"])
def test_a_rehearsal_comes_to_what_the_journal_of_the_same_attempt_gives(number, tmp_path):
    """By a script and by a procedure, after an opening and without: every deed, reading and measure, to the digit.

    The second rehearsal begins from an opening that was done for the first.
    """
    exercise_folder = find_exercise(number)
    played = exercise_folder.exercise.faulty[0]
    rehearsals = DryRuns(exercise_folder)
    rehearsals.run_attempt(exercise_folder.exercise.reference)
    rehearsed, error = rehearsals.run_attempt(played)
    seed = seed_for(exercise_folder, played)
    assert run_attempt(exercise_folder, played, tmp_path, seed) == error
    journalled = load_record(exercise_folder, seed, tmp_path)
    assert len(journalled.actions) > 0
    assert seen(rehearsed) == seen(journalled)
    assert evaluate_metrics(rehearsed) == evaluate_metrics(journalled)


def test_what_is_rehearsed_leaves_the_opening_as_it_was():
    rehearsals = DryRuns(find_exercise("9"))
    seed = seed_for(rehearsals.exercise_folder, rehearsals.exercise_folder.exercise.reference)
    before = rehearsals.run_and_leave(seed, None)
    rehearsals.run_attempt(rehearsals.exercise_folder.exercise.reference)
    assert seen(rehearsals.run_and_leave(seed, None)) == seen(before)
