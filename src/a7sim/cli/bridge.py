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
def command(scenario: str | None, asked: ScenarioOptions, kept: OutputOptions, told: DisplayOptions) -> None:
    """Bridge the strip of SCENARIO with base in and out in turn, and measure independent models for comparison.

    Example: a7sim bridge bridge --seed 7 --out runs/bridge
    """
    from a7sim.session.bridge import bridge_tables, run_bridge

    order = resolve_request(scenario, asked, kept)
    with progress_bar(_POINTS_A_MODEL * len(order.scenario.models), told) as watcher:
        document = run_bridge(order.scenario, order.seed, kept.folder, watcher, kept.force, kept.journal_options)
    show_results(document, told, bridge_tables)
