"""Groups of commands that are imported on use."""

import importlib
from collections.abc import Mapping
from typing import Any, NamedTuple

import click
from click.shell_completion import CompletionItem

from a7sim.cli.renamed import warn_renamed


class LazyCommand(NamedTuple):
    """Import path of a command, as `module:name`, and its short help."""

    import_path: str
    short_help: str


class LazyGroup(click.Group):
    """Group whose commands are imported on use; listing them imports nothing."""

    def __init__(
        self, *args: Any, commands: Mapping[str, LazyCommand], renamed: Mapping[str, str] | None = None, **kwargs: Any
    ) -> None:
        super().__init__(*args, **kwargs)
        self._commands = commands
        self._renamed = renamed or {}

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the commands in order."""
        return list(self._commands)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import and return a command."""
        if cmd_name not in self._commands:
            return None
        module, _, name = self._commands[cmd_name].import_path.partition(":")
        found = getattr(importlib.import_module(module), name)
        return found if isinstance(found, click.Command) else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command that the arguments name; an old name warns and means the new one."""
        if args and args[0] in self._renamed:
            old, new = args[0], self._renamed[args[0]]
            warn_renamed(ctx, f"{ctx.info_name} {old}", f"{ctx.info_name} {new}")
            args = [new, *args[1:]]
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the short help of all commands."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, command.short_help) for name, command in self._commands.items()])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Return the matching commands, and the group's own options."""
        matches = ((name, command) for name, command in self._commands.items() if name.startswith(incomplete))
        options = click.Command.shell_complete(self, ctx, incomplete)
        return [*(CompletionItem(name, help=command.short_help) for name, command in matches), *options]
