"""`a7sim train`: exercises, from the first counter to an independent strip, graded."""

import importlib

import click

_VERBS = {
    "list": "sheets",
    "start": "starting",
    "hint": "working",
    "answer": "working",
    "verify": "judging",
    "watch": "judging",
    "report": "sheets",
    "reset": "working",
    "check": "authoring",
    "new": "authoring",
}


class _Verbs(click.Group):
    """Commands imported when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in their order."""
        return list(_VERBS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a verb's command."""
        if cmd_name not in _VERBS:
            return None
        module = importlib.import_module(f"a7sim.cli.train.{_VERBS[cmd_name]}")
        command = getattr(module, f"{cmd_name}_")
        return command if isinstance(command, click.Command) else None


@click.group("train", cls=_Verbs)
def command() -> None:
    """Learn to work the plotter: exercises with a checklist, hints, and grades that say what to do better.

    Exit codes of verify: 0 passed, 1 not passed, 2 usage, 3 a journal that is damaged or does not happen again.

    Example: a7sim train start 1
    """
