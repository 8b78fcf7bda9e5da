"""Usage errors of click in the form expected, got, where."""

import re
from difflib import get_close_matches

import click

_REWORDINGS = (
    (
        r"(?P<got>.+) is not in the range (?P<low>[^<>=]+)<=?x<=?(?P<known>[^<>=]+)",
        "expected {low} to {known}, got {got}",
    ),
    (r"(?P<got>.+) is not a valid integer( range)?", "expected a whole number, got {got}"),
    (r"(?P<got>.+) is not a valid number", "expected a number, got {got}"),
    (r"(?:File|Path|Directory) (?P<got>.+) does not exist", "expected one that exists, got {got}"),
    (r"File (?P<got>.+) is a directory", "expected a file, got the folder {got}"),
    (r"Directory (?P<got>.+) is a file", "expected a folder, got the file {got}"),
    (r"Option (?P<got>.+) requires an argument", "expected a value after {got}, got none"),
    (r"Option (?P<got>.+) requires (?P<known>\d+) arguments", "expected {known} values after {got}, got fewer"),
    (r"Got unexpected extra arguments? \((?P<got>.+)\)", "expected nothing more, got {got}"),
)


def format_usage_error(error: click.ClickException) -> str:
    """Return the error message of a command, without a line end."""
    context = error.ctx if isinstance(error, click.UsageError) else None
    hint = f" ({context.command_path} --help says more)" if context else ""
    return f"{_sentence(error, context)}{hint}"


def _sentence(error: click.ClickException, context: click.Context | None) -> str:
    verb = context.command_path.removeprefix("a7sim").strip() if context else ""
    prefix = f"{verb}: " if verb else ""
    unknown = re.match(r"No such command '(.*)'", error.message, re.DOTALL)
    if unknown and context and isinstance(context.command, click.Group):
        return f"{prefix}expected a command, got {unknown[1]!r}{_suggestion(unknown[1], context)}"
    if isinstance(error, click.NoSuchOption):
        suggestion = f"; did you mean {', '.join(sorted(error.possibilities))}?" if error.possibilities else ""
        return f"{prefix}expected an option of this command, got {error.option_name}{suggestion}"
    if isinstance(error, click.MissingParameter) and error.param is not None:
        return f"{prefix}expected {parameter_label(error.param)}, got none"
    if isinstance(error, click.BadParameter) and error.param is not None:
        return f"{parameter_label(error.param)}: {_describe_bounds(error) or _reword(error.message)}"
    return f"{prefix}{_reword(error.format_message())}"


def _describe_bounds(error: click.BadParameter) -> str | None:
    """Return expected and actual value of a choice or a range, None for another error."""
    kind = error.param.type if error.param is not None else None
    got, refused, _ = error.message.partition(" is not ")
    if not refused or " is not a valid" in error.message:
        return None
    if isinstance(kind, click.Choice):
        return f"expected one of {', '.join(map(str, kind.choices))}, got {got}"
    if isinstance(kind, click.IntRange | click.FloatRange):
        return f"expected {describe_range(kind)}, got {got}"
    return None


def describe_range(bounds: click.IntRange | click.FloatRange) -> str:
    """Return a range as text: 1 to 5, or 0 or more."""
    low, high = bounds.min, bounds.max
    if low is not None and high is not None and not bounds.min_open:
        return f"{low:.12g} to {high:.12g}"
    above = "" if low is None else f"more than {low:.12g}" if bounds.min_open else f"{low:.12g} or more"
    below = "" if high is None else f"{high:.12g} at the most"
    return ", ".join(filter(None, (above, below)))


def _suggestion(word: str, context: click.Context) -> str:
    assert isinstance(context.command, click.Group)
    similar = get_close_matches(word, context.command.list_commands(context), 1)
    return f"; did you mean {similar[0]}?" if similar else ""


def parameter_label(parameter: click.Parameter) -> str:
    """Return the name of an option or an argument: --seed, SCENARIO."""
    if isinstance(parameter, click.Option):
        return max(parameter.opts, key=len)
    return parameter.metavar or parameter.human_readable_name.upper()


def _reword(message: str) -> str:
    plain = message.strip().removesuffix(".")
    for pattern, words in _REWORDINGS:
        found = re.fullmatch(pattern, plain, re.DOTALL)
        if found:
            parts = found.groupdict()
            return words.format(**parts | {"known": parts.get("known", "").replace("'", "")})
    return plain[:1].lower() + plain[1:] if plain[1:2].islower() else plain
