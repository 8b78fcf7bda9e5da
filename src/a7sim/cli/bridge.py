"""`a7sim bridge`: a strip bridged at the instrument, compared with independent models."""

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

_POINTS_A_MODEL = 260
"""Approximate number of points of a model in both methods, for the progress bar."""


@click.command("bridge")
@click.argument("scenario", required=False, shell_complete=scenario_argument)
@scenario_options
@output_options()
@display_options
def command(
    scenario: str | None, scenario_options: ScenarioOptions, output: OutputOptions, display: DisplayOptions
) -> None:
    """Bridge the strip of SCENARIO with base in and out in turn, and measure independent models for comparison.

    Example: a7sim bridge bridge --seed 7 --out runs/bridge
    """
    from a7sim.session.bridge import bridge_tables, run_bridge

    request = resolve_request(scenario, scenario_options, output)
    with progress_bar(_POINTS_A_MODEL * len(request.scenario.models), display) as callbacks:
        document = run_bridge(request.scenario, request.seed, output.run_options(callbacks))
    show_results(document, display, bridge_tables)
