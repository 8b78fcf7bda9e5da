"""`a7sim compile`: contours and lines of a model."""

import click

from a7sim.cli import options
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

_POINTS = 400
"""Approximate number of points and vertices of a model, for the progress bar."""


@click.command("compile")
@click.argument("scenario", required=False, shell_complete=scenario_argument)
@click.option("--model", "name", metavar="NAME", default="1", show_default=True, help="Model to compile.")
@click.option(
    "--contour", "contours", multiple=True, type=options.HEIGHT, metavar="M", help="Height of a contour in m."
)
@click.option(
    "--interval", type=options.greater_than(0.0), metavar="M", help="All contours whose height is a multiple of this."
)
@click.option("--line", "lines", multiple=True, metavar="NAME", help="Road or track of the scenario.")
@options.map_scale
@click.option("--tremor", type=options.NumberType(0.0, 500.0), metavar="UM", help="Tremor at photo scale.")
@scenario_options
@output_options("journal, book, map and results")
@display_options
def command(
    scenario: str | None,
    name: str,
    contours: tuple[float, ...],
    interval: float | None,
    lines: tuple[str, ...],
    map_scale: float | None,
    tremor: float | None,
    scenario_options: ScenarioOptions,
    output: OutputOptions,
    display: DisplayOptions,
) -> None:
    """Set up a model of SCENARIO with the virtual operator, level it, and draw contours and lines.

    Example: a7sim compile akwanga --model 1 --contour 460 --interval 10 --line road1 --out runs/sheet
    """
    from a7sim.report.map_tables import map_tables
    from a7sim.session.compiling import CompilationRequest, compile_model

    request = resolve_request(scenario, scenario_options, output)
    compilation = CompilationRequest(name, contours, interval, lines, map_scale, tremor)
    if request.begun_with is not None:
        compilation = CompilationRequest.from_settings(request.begun_with)
    with progress_bar(_POINTS, display) as callbacks:
        document = compile_model(request.scenario, request.seed, compilation, output.run_options(callbacks))
    show_results(document, display, map_tables)
