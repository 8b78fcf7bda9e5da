"""Groups of commands that are imported on use."""

import importlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import click
from click.shell_completion import CompletionItem


class LazyCommand(NamedTuple):
    """Import path of a command, as `module:name`, and its short help."""

    import_path: str
    short_help: str


class LazyGroup(click.Group):
    """Group whose commands are imported on use; listing them imports nothing."""

    def __init__(self, *args: Any, verbs: Mapping[str, LazyCommand], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._verbs = verbs

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands in order."""
        return list(self._verbs)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command."""
        if cmd_name not in self._verbs:
            return None
        module, _, name = self._verbs[cmd_name].import_path.partition(":")
        command = getattr(importlib.import_module(module), name)
        return command if isinstance(command, click.Command) else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the short help of all commands."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, verb.short_help) for name, verb in self._verbs.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the matching commands, and the group's own options."""
        named = ((name, verb) for name, verb in self._verbs.items() if name.startswith(incomplete))
        own = click.Command.shell_complete(self, ctx, incomplete)
        return [*(CompletionItem(name, help=verb.short_help) for name, verb in named), *own]
