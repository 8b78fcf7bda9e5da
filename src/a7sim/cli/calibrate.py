"""`a7sim calibrate`: a grid test of both projectors."""

import click

from a7sim.cli.names import a_scenario
from a7sim.cli.operators import Asked, Kept, Told, ended, kept_in_a_folder, of_a_scenario, of_results, ordered, watched
from a7sim.mistakes import Mistake

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
@kept_in_a_folder()
@of_results
def command(
    scenario: str | None,
    points: int,
    levels: int,
    pointings: int,
    asked: Asked,
    kept: Kept,
    told: Told,
) -> None:
    """Test both projectors of SCENARIO's plotter with a grid plate, as at a service.

    Example: a7sim calibrate grid-test --points 25 --out runs/grid-test
    """
    from a7sim.operator.grid_test import GridTestOrder
    from a7sim.session.grid_test import run_grid_test, sheet_of

    order = ordered(scenario, asked, kept)
    points, levels, pointings = (
        order.setting(name, given) for name, given in (("points", points), ("levels", levels), ("pointings", pointings))
    )
    camera, plate, polarity = order.scenario.camera, order.scenario.grid_plate, order.scenario.photos[0].polarity
    if points not in plate.even_counts:
        known = ", ".join(map(str, plate.even_counts))
        raise Mistake(f"--points: expected as many crosses as lie evenly on the plate ({known}), got {points}")
    test = GridTestOrder(camera, plate, points, levels, pointings, polarity)
    with watched(PROJECTORS * points * levels * pointings, told) as watcher:
        document = run_grid_test(order.scenario, order.seed, test, kept.folder, watcher, kept.force, kept.keeping)
    ended(document, told, sheet_of)
