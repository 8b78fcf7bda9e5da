"""`a7sim bridge`: a strip carried on at the instrument, beside independent models."""

from pathlib import Path

import click

from a7sim.cli.names import a_scenario
from a7sim.cli.operators import chosen, ended, of_a_folder, of_a_journal, of_a_scenario, of_results, resumed, watched
from a7sim.session.durable import Durability

_POINTS_A_MODEL = 260
"""About how many points an operator works on in a model in both ways."""


@click.command("bridge")
@click.argument("scenario", required=False, shell_complete=a_scenario)
@of_a_scenario
@of_a_folder
@of_a_journal
@of_results
def command(
    scenario: str | None,
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
    """Bridge the strip of SCENARIO with base in and out in turn, and work it as independent models for comparison.

    Example: a7sim bridge bridge --seed 7 --out runs/bridge
    """
    from a7sim.session.bridge import run_bridge, tables_of
    from a7sim.session.journal import Keeping

    if resume is not None:
        session = resumed(resume)
        loaded, seed, out = session.scenario, session.seed, resume
    else:
        loaded, seed = chosen(scenario, seed, settings, skill, perfect_observer)
    keeping = Keeping(durability, resume is not None)
    with watched(_POINTS_A_MODEL * len(loaded.models), as_document, quiet) as watcher:
        document = run_bridge(loaded, seed, out, watcher, force, keeping)
    ended(document, as_document, quiet, tables_of)
