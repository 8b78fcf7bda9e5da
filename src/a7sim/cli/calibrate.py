"""`a7sim calibrate`: a grid test of both projectors."""

from pathlib import Path

import click

from a7sim.cli.names import a_scenario
from a7sim.cli.operators import chosen, ended, of_a_folder, of_a_journal, of_a_scenario, of_results, resumed, watched
from a7sim.mistakes import Mistake
from a7sim.session.durable import Durability

PROJECTORS = 2


@click.command("calibrate")
@click.argument("scenario", required=False, shell_complete=a_scenario)
@click.option(
    "--points", type=int, metavar="N", default=25, show_default=True, help="Crosses of the plate, evenly spaced."
)
@click.option("--levels", type=click.IntRange(1, 5), metavar="N", default=2, show_default=True, help="Levels of Z.")
@click.option(
    "--pointings",
    type=click.IntRange(1, 20),
    metavar="N",
    default=2,
    show_default=True,
    help="At each cross and level.",
)
@of_a_scenario
@of_a_folder
@of_a_journal
@of_results
def command(
    scenario: str | None,
    points: int,
    levels: int,
    pointings: int,
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
    """Test both projectors of SCENARIO's plotter with a grid plate, as at a service.

    Example: a7sim calibrate grid-test --points 25 --out runs/grid-test
    """
    from a7sim.operator.grid_test import GridTestOrder
    from a7sim.session.grid_test import run_grid_test, sheet_of
    from a7sim.session.journal import Keeping

    if resume is not None:
        session = resumed(resume)
        loaded, seed, out = session.scenario, session.seed, resume
        points, levels, pointings = (session.setting(name) for name in ("points", "levels", "pointings"))
    else:
        loaded, seed = chosen(scenario, seed, settings, skill, perfect_observer)
    if points not in loaded.grid_plate.even_counts:
        known = ", ".join(map(str, loaded.grid_plate.even_counts))
        raise Mistake(f"--points: expected as many crosses as lie evenly on the plate ({known}), got {points}")
    order = GridTestOrder(loaded.camera, loaded.grid_plate, points, levels, pointings, loaded.photos[0].polarity)
    keeping = Keeping(durability, resume is not None)
    with watched(PROJECTORS * points * levels * pointings, as_document, quiet) as watcher:
        document = run_grid_test(loaded, seed, order, out, watcher, force, keeping)
    ended(document, as_document, quiet, sheet_of)
