"""The check of an exercise, as `a7sim train check-exercise` does it."""

from a7sim.training.checking import check_exercise
from a7sim.training.exercise import ExerciseFolder


def assert_exercise_holds(entry: ExerciseFolder) -> None:
    """Assert that the reference passes, faulty scripts fail for their reasons, and no criterion is without effect."""
    result = check_exercise(entry)
    assert result.faults == ()
    assert result.reference_points is not None and result.reference_points >= entry.exercise.pass_points
