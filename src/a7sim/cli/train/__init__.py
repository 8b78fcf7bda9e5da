"""`a7sim train`: graded exercises, from the first counter to an independent strip."""

import click

from a7sim.cli.lazy_group import LazyCommand, LazyGroup

_VERBS = {
    "list": LazyCommand("a7sim.cli.train.reports:list_", "List the exercises and how far they are done."),
    "start": LazyCommand("a7sim.cli.train.start:start_", "Sit down at an exercise: console, script or client."),
    "hint": LazyCommand("a7sim.cli.train.attempt:hint_", "Give the next hint, which costs points."),
    "answer": LazyCommand("a7sim.cli.train.attempt:answer_", "Hand in values that are asked for."),
    "verify": LazyCommand("a7sim.cli.train.grading:verify_", "Grade the last attempt, with reasons."),
    "watch": LazyCommand("a7sim.cli.train.grading:watch_", "Grade again whenever something was done."),
    "report": LazyCommand("a7sim.cli.train.reports:report_", "Write the sheet of a student or of the class."),
    "reset": LazyCommand("a7sim.cli.train.attempt:reset_", "Forget the attempts at an exercise."),
    "check": LazyCommand("a7sim.cli.train.authoring:check_", "See that exercises hold, for who writes them."),
    "new": LazyCommand("a7sim.cli.train.authoring:new_", "Write the skeleton of an exercise."),
}


@click.group("train", cls=LazyGroup, verbs=_VERBS)
def command() -> None:
    """Train on the plotter: exercises with a checklist, hints, and grades with advice.

    Exit codes of grade: 0 passed, 1 not passed, 2 usage, 3 a journal that is damaged or whose replay differs.

    Example: a7sim train start 1
    """
