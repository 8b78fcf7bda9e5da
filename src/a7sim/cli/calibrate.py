"""`a7sim calibrate`: a grid test of both projectors."""

import click

from a7sim.cli.completers import scenario_argument
from a7sim.cli.run_options import (
    DisplayOptions,
    OutputOptions,
    ScenarioOptions,
    display_options,
    output_options,
    progress_bar,
    resolve_request,
    scenario_options,
    show_results,
)
from a7sim.errors import A7SimError

PROJECTORS = 2


@click.command("calibrate")
@click.argument("scenario", required=False, shell_complete=scenario_argument)
@click.option(
    "--points",
    type=int,
    metavar="N",
    default=25,
    show_default=True,
    help="Number of crosses, spaced evenly on the plate.",
)
@click.option("--levels", type=click.IntRange(1, 5), metavar="N", default=2, show_default=True, help="Levels of Z.")
@click.option(
    "--pointings",
    type=click.IntRange(1, 20),
    metavar="N",
    default=2,
    show_default=True,
    help="Pointings at each cross and level.",
)
@scenario_options
@output_options()
@display_options
def command(
    scenario: str | None,
    points: int,
    levels: int,
    pointings: int,
    scenario_options: ScenarioOptions,
    output: OutputOptions,
    display: DisplayOptions,
) -> None:
    """Test both projectors of SCENARIO's plotter with a grid plate, as in a service.

    Example: a7sim calibrate grid-test --points 25 --out runs/grid-test
    """
    from a7sim.operator.procedures.grid_test import GridTestPlan
    from a7sim.session.grid_test import report_tables, run_grid_test

    request = resolve_request(scenario, scenario_options, output)
    points, levels, pointings = (
        request.setting(name, given)
        for name, given in (("points", points), ("levels", levels), ("pointings", pointings))
    )
    camera, plate, polarity = request.scenario.camera, request.scenario.grid_plate, request.scenario.photos[0].polarity
    if points not in plate.even_counts:
        known = ", ".join(map(str, plate.even_counts))
        raise A7SimError(
            f"--points: expected a number of crosses that are spaced evenly on the plate ({known}), got {points}"
        )
    test = GridTestPlan(camera, plate, points, levels, pointings, polarity)
    with progress_bar(PROJECTORS * points * levels * pointings, display) as callbacks:
        document = run_grid_test(request.scenario, request.seed, test, output.run_options(callbacks))
    show_results(document, display, report_tables)
