"""`a7sim compile`: the operator draws contours and lines of a model."""

import click

from a7sim.cli import options
from a7sim.cli.names import a_scenario
from a7sim.cli.operators import Asked, Kept, Told, ended, kept_in_a_folder, of_a_scenario, of_results, ordered, watched

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
@kept_in_a_folder("journal, book, map and results")
@of_results
def command(
    scenario: str | None,
    name: str,
    contours: tuple[float, ...],
    interval: float | None,
    lines: tuple[str, ...],
    map_scale: float | None,
    tremor: float | None,
    asked: Asked,
    kept: Kept,
    told: Told,
) -> None:
    """Let the operator set up a model of SCENARIO, level it, and draw contours and lines from it.

    Example: a7sim compile akwanga --model 1 --contour 460 --interval 10 --line road1 --out runs/sheet
    """
    from a7sim.session.compiled_tables import of_compilation
    from a7sim.session.compiling import Wanted, compile_model

    order = ordered(scenario, asked, kept)
    wanted = Wanted(name, contours, interval, lines, map_scale, tremor)
    if order.begun_with is not None:
        wanted = Wanted.of(order.begun_with)
    with watched(_POINTS, told) as watcher:
        document = compile_model(order.scenario, order.seed, wanted, kept.folder, watcher, kept.force, kept.keeping)
    ended(document, told, of_compilation)
