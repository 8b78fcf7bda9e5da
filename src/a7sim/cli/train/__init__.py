"""`a7sim train`: exercises, from the first counter to an independent strip, graded."""

import click

from a7sim.cli.verbs import Verbs

_VERBS = {
    "list": "a7sim.cli.train.sheets:list_",
    "start": "a7sim.cli.train.starting:start_",
    "hint": "a7sim.cli.train.working:hint_",
    "answer": "a7sim.cli.train.working:answer_",
    "verify": "a7sim.cli.train.judging:verify_",
    "watch": "a7sim.cli.train.judging:watch_",
    "report": "a7sim.cli.train.sheets:report_",
    "reset": "a7sim.cli.train.working:reset_",
    "check": "a7sim.cli.train.authoring:check_",
    "new": "a7sim.cli.train.authoring:new_",
}


@click.group("train", cls=Verbs, verbs=_VERBS)
def command() -> None:
    """Learn to work the plotter: exercises with a checklist, hints, and grades that say what to do better.

    Exit codes of verify: 0 passed, 1 not passed, 2 usage, 3 a journal that is damaged or does not happen again.

    Example: a7sim train start 1
    """
