"""`a7sim train`: graded exercises, from the first counter to an independent strip."""

import click

from a7sim.cli.lazy_group import LazyCommand, LazyGroup

_COMMANDS = {
    "list": LazyCommand("a7sim.cli.train.reports:list_", "List the exercises and your progress."),
    "start": LazyCommand("a7sim.cli.train.start:start_", "Start an exercise: console, script or client."),
    "hint": LazyCommand("a7sim.cli.train.attempt:hint_", "Give the next hint, which costs points."),
    "answer": LazyCommand("a7sim.cli.train.attempt:answer_", "Give the requested answers."),
    "grade": LazyCommand("a7sim.cli.train.grading:grade_", "Grade the last attempt, with reasons."),
    "watch": LazyCommand("a7sim.cli.train.grading:watch_", "Grade again after each action."),
    "report": LazyCommand("a7sim.cli.train.reports:report_", "Write the page of a student or of the class."),
    "reset": LazyCommand("a7sim.cli.train.attempt:reset_", "Close the attempt at an exercise."),
    "check-exercise": LazyCommand("a7sim.cli.train.authoring:check_", "Check exercises (for authors)."),
    "new": LazyCommand("a7sim.cli.train.authoring:new_", "Write the template of an exercise."),
}


@click.group("train", cls=LazyGroup, commands=_COMMANDS, renamed={"verify": "grade", "check": "check-exercise"})
def command() -> None:
    """Train on the plotter: exercises with a checklist, hints, and grades with advice.

    Exit codes of grade: 0 passed, 1 not passed, 2 usage, 3 a journal that is damaged or whose replay differs.

    Example: a7sim train start 1
    """
