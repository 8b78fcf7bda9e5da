"""The page of commands, from the click tree."""

import re
from inspect import cleandoc

import click

from a7sim.cli import cli
from a7sim.cli.usage_errors import describe_range

OPENING = """# Commands

Every command answers `--help` with what stands here. Bad input gets one sentence and exit code 2; `--debug` in any place shows the traceback instead.

| exit code | what it says |
| --- | --- |
| 0 | done |
| 1 | the work did not come to its end: the operator gave up, an instrument refused a line, an exercise is not passed |
| 2 | what was asked for is no good, or a file cannot be read or written |
| 3 | a replay, a grade or an audit found something else than was written down |
| 130 | interrupted by Ctrl-C; what was observed is in the journal |
"""

EXAMPLE = re.compile(r"^Example: (.*)", re.MULTILINE | re.DOTALL)


def page():
    """Return the page."""
    context = click.Context(cli, info_name="a7sim")
    return "\n".join([OPENING, *_of_group(cli, context, "##")]).rstrip() + "\n"


def _of_group(group, context, level):
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        inner = click.Context(command, info_name=name, parent=context)
        yield from _of_command(command, inner, level)
        if isinstance(command, click.Group):
            yield from _of_group(command, inner, level + "#")


def _of_command(command, context, level):
    text = cleandoc(command.help or "")
    example = EXAMPLE.search(text)
    about = EXAMPLE.sub("", text).strip()
    yield f"{level} {context.command_path}"
    yield ""
    yield f"`{' '.join([context.command_path, *command.collect_usage_pieces(context)])}`"
    yield ""
    yield _escaped(about)
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
    told = bracketed.sub("", about) if any(extra.values()) else about
    limits = ", ".join(
        filter(None, (describe_range(option.type) if "range" in extra else "", extra.get("required", "")))
    )
    told, spoken, said = told.partition("  [default: ")
    told += "." if spoken else ""
    default = str(extra.get("default", said.removesuffix("]")))
    meaning = f"{told} ({limits})" if limits else told
    words = words.replace(" RANGE", "")
    return f"| <code>{_celled(words)}</code> | {_celled(_escaped(meaning))} | {default} |"


def _escaped(text):
    return text.replace("<", "&lt;").replace("\b\n", "")


def _celled(text):
    return text.replace("|", "&#124;")
