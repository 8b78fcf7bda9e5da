"""`a7sim run`: the operator works through a scenario."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import msgspec
from rich.console import Console, RenderableType
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from a7sim.cli import EXIT_DOES_NOT_FIT
from a7sim.documents import as_json
from a7sim.mistakes import Mistake
from a7sim.scenario import PROFILES, Observer, load_scenario
from a7sim.session import Watcher
from a7sim.session.combinations import run_combinations
from a7sim.session.tables import of_session, of_strips
from a7sim.session.ways import run_all_ways
from a7sim.standard_points import CASES

_POINTS_A_MODEL = 130
"""About how many points an operator works on in a model; the bar only needs the order of it."""


@click.command("run")
@click.argument("scenario")
@click.option("--case", type=click.Choice(list("ABCDE"), case_sensitive=False), help="Standard points used (thesis).")
@click.option("--method", type=click.Choice(["independent", "dependent"]), help="Projectors turned: both, or one.")
@click.option(
    "--strips",
    type=click.Choice(["one", "all"]),
    default="one",
    show_default=True,
    help="all: every case of one model with every case of the next, 25 strips of two models.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Draws film, instrument and operator.")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Override a value of the scenario.")
@click.option("--skill", type=click.Choice(list(PROFILES)), help="How good the operator is.")
@click.option("--perfect-observer", is_flag=True, help="An operator who sees and reads without any error.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for journal, book, models and results.")
@click.option("--force", is_flag=True, help="Write into a folder that exists.")
@click.option("--json", "as_document", is_flag=True, help="Print the results as one JSON document.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def command(
    scenario: str,
    case: str | None,
    method: str | None,
    strips: str,
    seed: int | None,
    settings: tuple[str, ...],
    skill: str | None,
    perfect_observer: bool,
    out: Path | None,
    force: bool,
    as_document: bool,
    quiet: bool,
) -> None:
    """Let the operator set up the models of SCENARIO, a file or the name of one that comes with a7sim.

    Example: a7sim run akwanga --case E --seed 7 --out runs/akwanga-e
    """
    overrides = overrides_of(settings, {"plan.case": case, "plan.method": method, "observer.skill": skill})
    loaded = load_scenario(scenario, overrides)
    if perfect_observer:
        loaded = msgspec.structs.replace(loaded, observer=Observer.faultless())
    chosen = loaded.seed if seed is None else seed
    if strips == "all" and case is not None:
        raise Mistake("--strips all: expected no --case beside it, since every case is worked")
    unwatched = quiet or as_document
    sessions = len(CASES) if strips == "all" else 1
    with watched(_POINTS_A_MODEL * sessions * len(loaded.models), unwatched) as watcher:
        document = (run_combinations if strips == "all" else run_all_ways)(loaded, chosen, out, watcher, force)
    show(document, as_document, quiet, of_strips if strips == "all" else of_session)
    if document["status"] != "complete":
        click.echo(f"a7sim: the operator gave up: {document['message']}", err=True)
        raise click.exceptions.Exit(EXIT_DOES_NOT_FIT)


def overrides_of(settings: tuple[str, ...], options: dict[str, str | None]) -> dict[str, str]:
    """Return what --set and other options say, by path. Raises Mistake for a setting that is none."""
    overrides = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key:
            raise Mistake(f"--set: expected PATH=VALUE such as plan.bx=190.0, got {setting!r}")
        overrides[key] = value
    return overrides | {key: f'"{value}"' for key, value in options.items() if value is not None}


@contextmanager
def watched(points: int, unwatched: bool) -> Iterator[Watcher]:
    """Show on a terminal how work on about so many points goes on, and give the watcher that is told."""
    unwatched = unwatched or not sys.stderr.isatty()
    columns = (TextColumn("{task.description:<38}", markup=False), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=unwatched) as progress:
        task = progress.add_task("sitting down", total=points)
        yield Watcher(
            lambda activity: progress.update(task, description=activity),
            lambda: progress.advance(task),
        )


def show(
    document: dict[str, Any], as_document: bool, quiet: bool, tables: Callable[[dict[str, Any]], RenderableType]
) -> None:
    """Print a document, or its tables, or nothing."""
    if as_document:
        click.echo(as_json(document), nl=False)
    elif not quiet:
        Console().print(tables(document))
