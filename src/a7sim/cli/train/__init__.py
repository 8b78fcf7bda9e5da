"""`a7sim train`: exercises, from the first counter to an independent strip, graded."""

import click

from a7sim.cli.verbs import LazyCommand, LazyGroup

_VERBS = {
    "list": LazyCommand("a7sim.cli.train.sheets:list_", "List the exercises and how far they are done."),
    "start": LazyCommand("a7sim.cli.train.starting:start_", "Sit down at an exercise: console, script or client."),
    "hint": LazyCommand("a7sim.cli.train.working:hint_", "Give the next hint, which costs points."),
    "answer": LazyCommand("a7sim.cli.train.working:answer_", "Hand in values that are asked for."),
    "verify": LazyCommand("a7sim.cli.train.judging:verify_", "Grade the last attempt, with reasons."),
    "watch": LazyCommand("a7sim.cli.train.judging:watch_", "Grade again whenever something was done."),
    "report": LazyCommand("a7sim.cli.train.sheets:report_", "Write the sheet of a student or of the class."),
    "reset": LazyCommand("a7sim.cli.train.working:reset_", "Forget the attempts at an exercise."),
    "check": LazyCommand("a7sim.cli.train.authoring:check_", "See that exercises hold, for who writes them."),
    "new": LazyCommand("a7sim.cli.train.authoring:new_", "Write the skeleton of an exercise."),
}


@click.group("train", cls=LazyGroup, verbs=_VERBS)
def command() -> None:
    """Learn to work the plotter: exercises with a checklist, hints, and grades that say what to do better.

    Exit codes of verify: 0 passed, 1 not passed, 2 usage, 3 a journal that is damaged or does not happen again.

    Example: a7sim train start 1
    """
