"""`a7sim calibrate`: a grid test of both projectors."""

from pathlib import Path

import click
import msgspec

from a7sim.cli import EXIT_DOES_NOT_FIT
from a7sim.cli.run import overrides_of, show, watched
from a7sim.mistakes import Mistake
from a7sim.operator.grid_test import GridTestOrder
from a7sim.scenario import Observer, load_scenario
from a7sim.session.grid_test import run_grid_test, sheet_of

PROJECTORS = 2


@click.command("calibrate")
@click.argument("scenario")
@click.option("--points", type=int, default=25, show_default=True, help="Crosses of the plate, evenly spaced.")
@click.option("--levels", type=click.IntRange(1, 5), default=2, show_default=True, help="Levels of Z.")
@click.option("--pointings", type=click.IntRange(1, 20), default=2, show_default=True, help="At each cross and level.")
@click.option("--seed", type=click.IntRange(min=0), help="Draws instrument and operator.")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Override a value of the scenario.")
@click.option("--perfect-observer", is_flag=True, help="An operator who sees and reads without any error.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for journal, book, residuals and results.")
@click.option("--force", is_flag=True, help="Write into a folder that exists.")
@click.option("--json", "as_document", is_flag=True, help="Print the sheet as one JSON document.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def command(
    scenario: str,
    points: int,
    levels: int,
    pointings: int,
    seed: int | None,
    settings: tuple[str, ...],
    perfect_observer: bool,
    out: Path | None,
    force: bool,
    as_document: bool,
    quiet: bool,
) -> None:
    """Test both projectors of SCENARIO's plotter with a grid plate, as at a service.

    Example: a7sim calibrate grid-test --points 25 --out runs/grid-test
    """
    loaded = load_scenario(scenario, overrides_of(settings, {}))
    if perfect_observer:
        loaded = msgspec.structs.replace(loaded, observer=Observer.faultless())
    if points not in loaded.grid_plate.even_counts:
        known = ", ".join(map(str, loaded.grid_plate.even_counts))
        raise Mistake(f"--points: expected as many crosses as lie evenly on the plate ({known}), got {points}")
    order = GridTestOrder(loaded.camera, loaded.grid_plate, points, levels, pointings, loaded.photos[0].polarity)
    chosen = loaded.seed if seed is None else seed
    with watched(PROJECTORS * points * levels * pointings, quiet or as_document) as watcher:
        document = run_grid_test(loaded, chosen, order, out, watcher, force)
    show(document, as_document, quiet, sheet_of)
    if document["status"] != "complete":
        click.echo(f"a7sim: the operator gave up: {document['message']}", err=True)
        raise click.exceptions.Exit(EXIT_DOES_NOT_FIT)
