"""`a7sim run`: the operator works through a scenario."""

from pathlib import Path

import click

from a7sim.cli.names import a_scenario
from a7sim.cli.operators import (
    POINTS_A_MODEL,
    chosen,
    ended,
    of_a_folder,
    of_a_journal,
    of_a_scenario,
    of_an_orientation,
    of_results,
    resumed,
    watched,
)
from a7sim.mistakes import Mistake
from a7sim.session.durable import Durability
from a7sim.standard_points import CASES


@click.command("run")
@click.argument("scenario", required=False, shell_complete=a_scenario)
@of_an_orientation
@click.option(
    "--strips",
    type=click.Choice(["one", "all"]),
    default="one",
    show_default=True,
    help="all: every case of one model with every case of the next, 25 strips of two models.",
)
@of_a_scenario
@of_a_folder
@of_a_journal
@of_results
def command(
    scenario: str | None,
    case: str | None,
    method: str | None,
    strips: str,
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
    """Let the operator set up the models of SCENARIO, a file or the name of one that comes with a7sim.

    A session that was cut off goes on with --resume, and nothing else: its journal says what was asked for.

    Example: a7sim run akwanga --case E --seed 7 --out runs/akwanga-e
    """
    from a7sim.session.combinations import run_combinations
    from a7sim.session.journal import Keeping
    from a7sim.session.tables import of_session, of_strips
    from a7sim.session.ways import run_all_ways

    every_case = strips == "all"
    if resume is not None:
        session = resumed(resume)
        loaded, seed, every_case, out = session.scenario, session.seed, session.setting("strips") == "all", resume
    else:
        others = {"plan.case": case, "plan.method": method}
        loaded, seed = chosen(scenario, seed, settings, skill, perfect_observer, others)
        if every_case and case is not None:
            raise Mistake("--strips all: expected no --case beside it, since every case is worked")
    keeping = Keeping(durability, resume is not None)
    sessions = len(CASES) if every_case else 1
    with watched(POINTS_A_MODEL * sessions * len(loaded.models), as_document, quiet) as watcher:
        if every_case:
            document = run_combinations(loaded, seed, out, watcher, force, keeping)
        else:
            document = run_all_ways(loaded, seed, out, watcher, force, keeping=keeping)
    ended(document, as_document, quiet, of_strips if every_case else of_session)
