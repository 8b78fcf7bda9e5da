"""Options, scenario and output of the commands that run the virtual operator."""

import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import msgspec
from click.core import ParameterSource

from a7sim.cli import EXIT_DOES_NOT_FIT, options
from a7sim.cli.completers import CaseInsensitiveChoice
from a7sim.cli.usage_errors import parameter_label
from a7sim.errors import A7SimError
from a7sim.journal.append_file import DURABILITIES, Durability
from a7sim.scenario import PROFILES, Observer, Provenance, Scenario, load_scenario, scenario_name, with_provenance

if TYPE_CHECKING:
    from rich.console import RenderableType

    from a7sim.journal.resuming import ResumableSession
    from a7sim.journal.writer import JournalOptions
    from a7sim.result_documents import Document
    from a7sim.session import ProgressCallbacks, RunOptions

DURABILITY = click.option(
    "--durability",
    type=click.Choice(DURABILITIES),
    default="records",
    show_default=True,
    help=(
        "When the journal is flushed to disk: always (every line), records (every registration; the rest within "
        "0.2 s) or never."
    ),
)
_RESUME = click.option(
    "--resume",
    type=options.PLACE,
    metavar="DIR",
    help="Resume the interrupted session in DIR with the options in its journal.",
)


@dataclass(frozen=True)
class ScenarioOptions:
    """Options of a scenario: seed, overrides of its values, and the operator's skill."""

    seed: int | None
    settings: tuple[str, ...]
    skill: str | None
    perfect_observer: bool


@dataclass(frozen=True)
class OutputOptions:
    """Options of the output: folder, resumption, and durability of the journal."""

    out: Path | None
    force: bool
    resume: Path | None
    durability: Durability

    @property
    def folder(self) -> Path | None:
        """Folder of the files."""
        return self.resume or self.out

    @property
    def journal_options(self) -> "JournalOptions":
        """Options of the journal."""
        from a7sim.journal.writer import JournalOptions

        return JournalOptions(self.durability, self.resume is not None)

    def run_options(self, callbacks: "ProgressCallbacks") -> "RunOptions":
        """Return the options of a session with these callbacks."""
        from a7sim.session import RunOptions

        return RunOptions(self.folder, self.force, callbacks, self.journal_options)


@dataclass(frozen=True)
class DisplayOptions:
    """Form of the results: tables, a document, or nothing."""

    as_document: bool
    quiet: bool


scenario_options = options.group_options(
    "scenario_options",
    ScenarioOptions,
    options.seed(),
    click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Override a value of the scenario."),
    click.option("--skill", type=click.Choice(list(PROFILES)), help="Skill of the operator."),
    click.option("--perfect-observer", is_flag=True, help="An operator without errors of sight and reading."),
)
"""--seed, --set, --skill, --perfect-observer, as `scenario_options`."""

orientation_options = options.combine_options(
    click.option("--case", type=CaseInsensitiveChoice("ABCDE"), help="Standard points used (thesis)."),
    click.option("--method", type=click.Choice(["independent", "dependent"]), help="Projectors rotated: both, or one."),
)
"""--case, --method."""

SESSION = "journal, book, tables and results"


def output_options(of: str = SESSION) -> options.Option[Any]:
    """Return --out, --force, --resume, --durability, as `output`, for a folder of `of`."""
    return options.group_options("output", OutputOptions, options.new_folder(of), _RESUME, DURABILITY)


display_options = options.group_options("display", DisplayOptions, options.as_document, options.quiet())
"""--json, --quiet, as `display`."""

_NOT_IN_COMMAND_LINE = {
    *("seed", "out", "force", "resume", "durability", "as_document", "quiet"),
    *("url", "timeout", "token_file"),
}
_EQUIVALENT_COMMANDS = {"operate": "run"}


@dataclass(frozen=True)
class RunRequest:
    """Requested run: scenario, seed, and, for a resumed session, the settings in its journal."""

    scenario: Scenario
    seed: int
    begun_with: Mapping[str, Any] | None = None

    def setting(self, name: str, option_value: Any) -> Any:
        """Return the setting of a resumed session's journal, or the given one for a new session."""
        return option_value if self.begun_with is None else self.begun_with.get(name)


def resolve_request(
    scenario: str | None,
    scenario_options: ScenarioOptions,
    output: OutputOptions,
    others: Mapping[str, str | None] | None = None,
) -> RunRequest:
    """Return the requested run: a new session, or with --resume the one in its folder. Raises A7SimError.

    `others` are overrides of the scenario as texts by path.
    """
    if output.resume is None:
        return RunRequest(*resolve_scenario(scenario, scenario_options, others))
    session = resolve_resume(output.resume)
    return RunRequest(session.scenario, session.seed, session.settings)


def resolve_scenario(
    scenario: str | None, scenario_options: ScenarioOptions, others: Mapping[str, str | None] | None = None
) -> tuple[Scenario, int]:
    """Return the scenario and the seed of the options; `others` are texts by path. Raises A7SimError."""
    if scenario is None:
        raise A7SimError(f"{click.get_current_context().info_name}: expected SCENARIO or --resume DIR, got none")
    overrides = _overrides(scenario_options.settings, {**(others or {}), "observer.skill": scenario_options.skill})
    loaded = load_scenario(scenario, overrides)
    if scenario_options.perfect_observer:
        loaded = msgspec.structs.replace(loaded, observer=Observer.faultless())
        overrides["observer"] = "perfect"
    seed = loaded.seed if scenario_options.seed is None else scenario_options.seed
    return with_provenance(
        loaded, Provenance(command_line=_command_line(scenario_name(scenario), seed), settings=overrides)
    ), seed


def _command_line(scenario: str, seed: int) -> str:
    """Return a command line that repeats the results of the present command."""
    ctx = click.get_current_context()
    verb = ctx.info_name or ""
    words = ["a7sim", _EQUIVALENT_COMMANDS.get(verb, verb), scenario, "--seed", str(seed)]
    for option in ctx.command.params:
        name = option.name or ""
        is_given = ctx.get_parameter_source(name) is not ParameterSource.DEFAULT
        if is_given and isinstance(option, click.Option) and name not in _NOT_IN_COMMAND_LINE:
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
            raise A7SimError(f"--set: expected PATH=VALUE such as plan.bx=190.0, got {setting!r}")
        overrides[key] = value
    return overrides | {key: f'"{value}"' for key, value in texts.items() if value is not None}


def resolve_resume(folder: Path, *beside: str) -> "ResumableSession":
    """Return the session that --resume continues.

    Raises A7SimError if other options than those named in `beside` are given, because the journal contains them.
    """
    from a7sim.journal.resuming import find_resumable

    _check_resume_alone(beside)
    return find_resumable(folder, click.get_current_context().info_name or "")


def _check_resume_alone(beside: tuple[str, ...]) -> None:
    ctx = click.get_current_context()
    allowed = {"resume", "durability", "as_document", "quiet", *beside}
    for name in ctx.params:
        if name not in allowed and ctx.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            parameter = next(each for each in ctx.command.params if each.name == name)
            raise A7SimError(
                f"--resume: expected no {parameter_label(parameter)} with it, because the journal contains the options"
            )


POINTS_A_MODEL = 130
"""Approximate number of points of a model, for the progress bar."""


@contextmanager
def progress_bar(points: int, display: DisplayOptions) -> "Iterator[ProgressCallbacks]":
    """Show the progress of about `points` points on a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    from a7sim.session import ProgressCallbacks

    columns = (TextColumn("{task.description:<38}", markup=False), BarColumn(), TimeElapsedColumn())
    is_hidden = display.quiet or display.as_document or not sys.stderr.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=is_hidden) as progress:
        task = progress.add_task("starting", total=points)
        yield ProgressCallbacks(
            lambda activity: progress.update(task, description=activity),
            lambda: progress.advance(task),
        )


def show_results(document: "Document", display: DisplayOptions, tables: "Callable[[Document], RenderableType]") -> None:
    """Print the results, and end with exit code 1 if the operator gave up."""
    from rich.console import Console

    from a7sim.result_documents import as_json

    if display.as_document:
        click.echo(as_json(document), nl=False)
    elif not display.quiet:
        Console().print(tables(document))
    if document["status"] != "complete":
        click.echo(f"a7sim: the operator gave up: {document['message']}", err=True)
        raise click.exceptions.Exit(EXIT_DOES_NOT_FIT)
