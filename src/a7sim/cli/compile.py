"""`a7sim compile`: the operator draws contours and lines of a model."""

from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.names import a_scenario
from a7sim.cli.operators import chosen, ended, of_a_journal, of_a_scenario, of_results, resumed, watched
from a7sim.session.durable import Durability

_POINTS = 400
"""About how many points and vertices an operator works on; the bar only needs the order of it."""


@click.command("compile")
@click.argument("scenario", required=False, shell_complete=a_scenario)
@click.option("--model", "name", metavar="NAME", default="1", show_default=True, help="Model to be compiled.")
@click.option(
    "--contour", "contours", multiple=True, type=options.HEIGHT, metavar="M", help="Height of a contour in m."
)
@click.option(
    "--interval", type=options.above(0.0), metavar="M", help="All contours whose height is a multiple of this."
)
@click.option("--line", "lines", multiple=True, metavar="NAME", help="Road or track of the scenario.")
@options.map_scale
@click.option("--tremor", type=options.Number(0.0, 500.0), metavar="UM", help="Tremor at photo scale.")
@of_a_scenario
@options.new_folder("journal, book, map and results")
@of_a_journal
@of_results
def command(
    scenario: str | None,
    name: str,
    contours: tuple[float, ...],
    interval: float | None,
    lines: tuple[str, ...],
    map_scale: float | None,
    tremor: float | None,
    seed: int | None,
    settings: tuple[str, ...],
    skill: str | None,
    perfect_observer: bool,
    out: Path | None,
    force: bool,
    resume: Path | None,
    durability: Durability,
    as_document: bool,
    quiet: bool,
) -> None:
    """Let the operator set up a model of SCENARIO, level it, and draw contours and lines from it.

    Example: a7sim compile akwanga --model 1 --contour 460 --interval 10 --line road1 --out runs/sheet
    """
    from a7sim.session.compiled_tables import of_compilation
    from a7sim.session.compiling import Wanted, compile_model
    from a7sim.session.journal import Keeping

    if resume is not None:
        session = resumed(resume)
        loaded, seed, out = session.scenario, session.seed, resume
        wanted = Wanted.of(session.settings)
    else:
        loaded, seed = chosen(scenario, seed, settings, skill, perfect_observer)
        wanted = Wanted(name, contours, interval, lines, map_scale, tremor)
    keeping = Keeping(durability, resume is not None)
    with watched(_POINTS, as_document, quiet) as watcher:
        document = compile_model(loaded, seed, wanted, out, watcher, force, keeping)
    ended(document, as_document, quiet, of_compilation)
