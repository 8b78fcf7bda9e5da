"""`a7sim bridge`: a strip carried on at the instrument, beside independent models."""

from pathlib import Path

import click

from a7sim.cli.names import a_scenario
from a7sim.cli.operators import chosen, ended, of_a_folder, of_a_scenario, of_results, watched

_POINTS_A_MODEL = 260
"""About how many points an operator works on in a model in both ways."""


@click.command("bridge")
@click.argument("scenario", shell_complete=a_scenario)
@of_a_scenario
@of_a_folder
@of_results
def command(
    scenario: str,
    seed: int | None,
    settings: tuple[str, ...],
    skill: str | None,
    perfect_observer: bool,
    out: Path | None,
    force: bool,
    as_document: bool,
    quiet: bool,
) -> None:
    """Bridge the strip of SCENARIO with base in and out in turn, and work it as independent models for comparison.

    Example: a7sim bridge bridge --seed 7 --out runs/bridge
    """
    from a7sim.session.bridge import run_bridge, tables_of

    loaded, seed = chosen(scenario, seed, settings, skill, perfect_observer)
    with watched(_POINTS_A_MODEL * len(loaded.models), as_document, quiet) as watcher:
        document = run_bridge(loaded, seed, out, watcher, force)
    ended(document, as_document, quiet, tables_of)
