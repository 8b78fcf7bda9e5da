"""Options and commands of the previous release: each old name works for one release and warns."""

from collections.abc import Mapping, Sequence

import click


def warn_renamed(context: click.Context, old: str, new: str) -> None:
    """Print on standard error that an option or a command has a new name; print nothing during completion."""
    if not context.resilient_parsing:
        click.echo(f"a7sim: {old} is now called {new}; the old name will be removed in the next release", err=True)


def replace_renamed(context: click.Context, arguments: Sequence[str], renamed: Mapping[str, str]) -> list[str]:
    """Return the arguments with old option names, `--old` and `--old=value`, replaced; warn for each.

    Arguments after `--` are not options and stay.
    """
    replaced = list(arguments)
    for index, argument in enumerate(arguments):
        if argument == "--":
            break
        name, equals, value = argument.partition("=")
        if name in renamed:
            warn_renamed(context, name, renamed[name])
            replaced[index] = f"{renamed[name]}{equals}{value}"
    return replaced


def command_with_renamed_options(renamed: Mapping[str, str]) -> type[click.Command]:
    """Return a click command class that accepts old option names; help and completion show only the new ones."""

    class RenamedOptionsCommand(click.Command):
        def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
            return super().parse_args(ctx, replace_renamed(ctx, args, renamed))

    return RenamedOptionsCommand
