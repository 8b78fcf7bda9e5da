"""Commands that are imported when they are asked for."""

import importlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import click
from click.shell_completion import CompletionItem


class LazyCommand(NamedTuple):
    """Where a command stands, as `module:name`, and what a list of commands says of it."""

    import_path: str
    short_help: str


class LazyGroup(click.Group):
    """A group whose commands are imported when they are asked for; to list them nothing is imported."""

    def __init__(self, *args: Any, verbs: Mapping[str, LazyCommand], **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self._verbs = verbs

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the verbs in their order."""
        return list(self._verbs)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a verb's command."""
        if cmd_name not in self._verbs:
            return None
        module, _, name = self._verbs[cmd_name].import_path.partition(":")
        command = getattr(importlib.import_module(module), name)
        return command if isinstance(command, click.Command) else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write what the verbs are about."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, verb.short_help) for name, verb in self._verbs.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the verbs that begin so, and the group's own options."""
        named = ((name, verb) for name, verb in self._verbs.items() if name.startswith(incomplete))
        own = click.Command.shell_complete(self, ctx, incomplete)
        return [*(CompletionItem(name, help=verb.short_help) for name, verb in named), *own]
