"""The reference page of the commands, made from the click tree."""

import re
from inspect import cleandoc

import click

from a7sim.cli import cli
from a7sim.cli.usage_errors import describe_range

OPENING = """# Commands

`COMMAND --help` prints what this page contains. For bad input a command prints one sentence and ends with exit code 2; `--debug` anywhere on the line shows the traceback instead.

| exit code | meaning |
| --- | --- |
| 0 | done |
| 1 | not completed: the operator gave up, an instrument rejected a line, an exercise is not passed |
| 2 | bad input, or a file that cannot be read or written |
| 3 | a replay, a grade or an audit differs from the record |
| 130 | interrupted by Ctrl-C; the journal contains all observations made until then |
"""

EXAMPLE = re.compile(r"^Example: (.*)", re.MULTILINE | re.DOTALL)


def page():
    """Return the page as Markdown."""
    context = click.Context(cli, info_name="a7sim")
    return "\n".join([OPENING, *_group_lines(cli, context, "##")]).rstrip() + "\n"


def _group_lines(group, context, level):
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = click.Context(command, info_name=name, parent=context)
        yield from _command_lines(command, inner, level)
        if isinstance(command, click.Group):
            yield from _group_lines(command, inner, level + "#")


def _command_lines(command, context, level):
    text = cleandoc(command.help or "")
    example = EXAMPLE.search(text)
    about = EXAMPLE.sub("", text).strip()
    yield f"{level} {context.command_path}"
    yield ""
    yield f"`{' '.join([context.command_path, *command.collect_usage_pieces(context)])}`"
    yield ""
    yield _escape(about)
    yield ""
    if example:
        yield from ("```sh", " ".join(example[1].split()), "```", "")
    options = [option for option in command.params if isinstance(option, click.Option) and not option.hidden]
    if options:
        yield from ("| option | what it does | default |", "| --- | --- | --- |")
        yield from (_row(option, context) for option in options)
        yield ""


def _row(option, context):
    words, about = option.get_help_record(context)
    extra = option.get_help_extra(context)
    bracketed = re.compile(r"\s*\[(?:[^\[\]]|\[[^\]]*\])*\]$")
    meaning = bracketed.sub("", about) if any(extra.values()) else about
    limits = ", ".join(
        filter(None, (describe_range(option.type) if "range" in extra else "", extra.get("required", "")))
    )
    meaning, separator, stated = meaning.partition("  [default: ")
    meaning += "." if separator else ""
    default = str(extra.get("default", stated.removesuffix("]")))
    meaning = f"{meaning} ({limits})" if limits else meaning
    words = words.replace(" RANGE", "")
    return f"| <code>{_table_cell(words)}</code> | {_table_cell(_escape(meaning))} | {default} |"


def _escape(text):
    return text.replace("<", "&lt;").replace("\b\n", "")


def _table_cell(text):
    return text.replace("|", "&#124;")
