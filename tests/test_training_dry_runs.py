"""Dry runs, with which `a7sim train check` grades faulty runs: the same results without a journal."""

import pytest

from a7sim.training.attempts import run_attempt, seed_for
from a7sim.training.catalogue import find_exercise
from a7sim.training.dry_runs import DryRuns
from a7sim.training.grading import evaluate_metrics, load_record


def state_of(account):
    witness = account.action_log
    return witness.actions, witness.readings, witness.sides, account.seconds, account.answers, account.autograph.state()


@pytest.mark.parametrize("number", ["4", "9", "12"])
def test_a_dry_run_gives_the_results_of_the_journal_of_the_same_attempt(number, tmp_path):
    """Compare every action, reading and metric to the digit, for scripts and procedures, with and without opening.

    The second dry run starts from the opening of the first.
    """
    exercise_folder = find_exercise(number)
    played = exercise_folder.exercise.faulty[0]
    dry_runs = DryRuns(exercise_folder)
    dry_runs.run_attempt(exercise_folder.exercise.reference)
    dry_record, error = dry_runs.run_attempt(played)
    seed = seed_for(exercise_folder, played)
    assert run_attempt(exercise_folder, played, tmp_path, seed) == error
    journalled = load_record(exercise_folder, seed, tmp_path)
    assert len(journalled.actions) > 0
    assert state_of(dry_record) == state_of(journalled)
    assert evaluate_metrics(dry_record) == evaluate_metrics(journalled)


def test_a_dry_run_does_not_change_the_stored_opening():
    dry_runs = DryRuns(find_exercise("9"))
    seed = seed_for(dry_runs.exercise_folder, dry_runs.exercise_folder.exercise.reference)
    before = dry_runs.run_and_leave(seed, None)
    dry_runs.run_attempt(dry_runs.exercise_folder.exercise.reference)
    assert state_of(dry_runs.run_and_leave(seed, None)) == state_of(before)
