"""What the commands that seat an operator share: options, the scenario that they choose, and how they end."""

import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click
import msgspec
from click.core import ParameterSource

from a7sim.cli import EXIT_DOES_NOT_FIT, options
from a7sim.cli.complaints import name_of
from a7sim.cli.names import OneOf
from a7sim.mistakes import Mistake
from a7sim.scenario import PROFILES, Observer, Request, Scenario, bare_name, load_scenario, requested
from a7sim.session.durable import DURABILITIES

if TYPE_CHECKING:
    from rich.console import RenderableType

    from a7sim.documents import Document
    from a7sim.session import Watcher
    from a7sim.session.resuming import Begun

DURABILITY = click.option(
    "--durability",
    type=click.Choice(DURABILITIES),
    default="records",
    show_default=True,
    help="When the journal is on the disk: every line, every registration and the rest within 0.2 s, or never.",
)
_RESUME = click.option("--resume", type=options.PLACE, metavar="DIR", help="Go on with the session in DIR, cut off.")

of_a_scenario = options.together(
    options.seed(),
    click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Override a value of the scenario."),
    click.option("--skill", type=click.Choice(list(PROFILES)), help="How good the operator is."),
    click.option("--perfect-observer", is_flag=True, help="An operator who sees and reads without any error."),
)
"""--seed, --set, --skill, --perfect-observer: what `chosen` takes."""

of_an_orientation = options.together(
    click.option("--case", type=OneOf("ABCDE"), help="Standard points used (thesis)."),
    click.option("--method", type=click.Choice(["independent", "dependent"]), help="Projectors turned: both, or one."),
)
"""--case, --method."""

of_a_folder = options.new_folder("journal, book, tables and results")
"""--out, --force, where a session is left."""

of_a_journal = options.together(_RESUME, DURABILITY)
"""--resume, --durability."""

of_results = options.together(options.as_document, options.quiet())
"""--json, --quiet: what `ended` takes."""

_NOT_OF_THE_RESULTS = {
    *("seed", "out", "force", "resume", "durability", "as_document", "quiet"),
    *("url", "timeout", "token_file"),
}
_SAME_RESULTS_AS = {"operate": "run"}


def chosen(
    scenario: str | None,
    seed: int | None,
    settings: tuple[str, ...],
    skill: str | None,
    perfect_observer: bool,
    others: Mapping[str, str | None] | None = None,
) -> tuple[Scenario, int]:
    """Return the scenario and the seed that the options choose; `others` are texts by path. Raises Mistake."""
    if scenario is None:
        raise Mistake(f"{click.get_current_context().info_name}: expected SCENARIO or --resume DIR, got none")
    overrides = _overrides(settings, {**(others or {}), "observer.skill": skill})
    loaded = load_scenario(scenario, overrides)
    if perfect_observer:
        loaded = msgspec.structs.replace(loaded, observer=Observer.faultless())
        overrides["observer"] = "perfect"
    seed = loaded.seed if seed is None else seed
    return requested(loaded, Request(command_line=_command_line(bare_name(scenario), seed), settings=overrides)), seed


def _command_line(scenario: str, seed: int) -> str:
    """Return the command under way as anybody could type it for the same results."""
    ctx = click.get_current_context()
    verb = ctx.info_name or ""
    words = ["a7sim", _SAME_RESULTS_AS.get(verb, verb), scenario, "--seed", str(seed)]
    for option in ctx.command.params:
        name = option.name or ""
        given = ctx.get_parameter_source(name) is not ParameterSource.DEFAULT
        if given and isinstance(option, click.Option) and name not in _NOT_OF_THE_RESULTS:
            value = ctx.params[name]
            flag = max(option.opts, key=len)
            for each in value if option.multiple else [value]:
                words += [flag] if option.is_flag else [flag, f"{each:.12g}" if isinstance(each, float) else str(each)]
    return shlex.join(words)


def _overrides(settings: tuple[str, ...], texts: Mapping[str, str | None]) -> dict[str, str]:
    overrides = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key:
            raise Mistake(f"--set: expected PATH=VALUE such as plan.bx=190.0, got {setting!r}")
        overrides[key] = value
    return overrides | {key: f'"{value}"' for key, value in texts.items() if value is not None}


def resumed(folder: Path, *beside: str) -> "Begun":
    """Return the session of the command under way that --resume goes on with.

    Raises Mistake where anything but what is named stands `beside` it, since the journal says what was asked for.
    """
    from a7sim.session.resuming import begun_in

    _see_that_resume_stands_alone(beside)
    return begun_in(folder, click.get_current_context().info_name or "")


def _see_that_resume_stands_alone(beside: tuple[str, ...]) -> None:
    ctx = click.get_current_context()
    allowed = {"resume", "durability", "as_document", "quiet", *beside}
    for name in ctx.params:
        if name not in allowed and ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            said = next(each for each in ctx.command.params if each.name == name)
            raise Mistake(f"--resume: expected no {name_of(said)} beside it, since the journal says what was asked for")


POINTS_A_MODEL = 130
"""About how many points an operator works on in a model; the bar only needs the order of it."""


@contextmanager
def watched(points: int, as_document: bool, quiet: bool) -> "Iterator[Watcher]":
    """Show on a terminal how the operator gets on with about so many points."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from a7sim.session import Watcher

    columns = (TextColumn("{task.description:<38}", markup=False), BarColumn(), TimeElapsedColumn())
    unwatched = quiet or as_document or not sys.stderr.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=unwatched) as progress:
        task = progress.add_task("sitting down", total=points)
        yield Watcher(
            lambda activity: progress.update(task, description=activity),
            lambda: progress.advance(task),
        )


def ended(document: "Document", as_document: bool, quiet: bool, tables: "Callable[[Document], RenderableType]") -> None:
    """Show the results, and end with exit code 1 where the operator gave up."""
    from rich.console import Console

    from a7sim.documents import as_json

    if as_document:
        click.echo(as_json(document), nl=False)
    elif not quiet:
        Console().print(tables(document))
    if document["status"] != "complete":
        click.echo(f"a7sim: the operator gave up: {document['message']}", err=True)
        raise click.exceptions.Exit(EXIT_DOES_NOT_FIT)
