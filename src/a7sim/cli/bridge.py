"""`a7sim bridge`: a strip carried on at the instrument, beside independent models."""

import click

from a7sim.cli.names import a_scenario
from a7sim.cli.operators import Asked, Kept, Told, ended, kept_in_a_folder, of_a_scenario, of_results, ordered, watched

_POINTS_A_MODEL = 260
"""About how many points an operator works on in a model in both ways."""


@click.command("bridge")
@click.argument("scenario", required=False, shell_complete=a_scenario)
@of_a_scenario
@kept_in_a_folder()
@of_results
def command(scenario: str | None, asked: Asked, kept: Kept, told: Told) -> None:
    """Bridge the strip of SCENARIO with base in and out in turn, and work it as independent models for comparison.

    Example: a7sim bridge bridge --seed 7 --out runs/bridge
    """
    from a7sim.session.bridge import run_bridge, tables_of

    order = ordered(scenario, asked, kept)
    with watched(_POINTS_A_MODEL * len(order.scenario.models), told) as watcher:
        document = run_bridge(order.scenario, order.seed, kept.folder, watcher, kept.force, kept.keeping)
    ended(document, told, tables_of)
