"""`a7sim operate`: the operator works an instrument that is served."""

from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.links import of_a_link, token_from
from a7sim.cli.names import a_scenario
from a7sim.cli.operators import (
    POINTS_A_MODEL,
    SESSION,
    Asked,
    Told,
    chosen,
    ended,
    of_a_scenario,
    of_an_orientation,
    of_results,
    watched,
)


@click.command("operate")
@click.argument("scenario", shell_complete=a_scenario)
@click.option("--link", "url", required=True, metavar="URL", help="Where the instrument is served.")
@of_a_link
@of_an_orientation
@of_a_scenario
@options.new_folder(SESSION)
@of_results
def command(
    scenario: str,
    url: str,
    timeout: float,
    token_file: Path | None,
    case: str | None,
    method: str | None,
    asked: Asked,
    out: Path | None,
    force: bool,
    told: Told,
) -> None:
    """Let the operator work the served instrument of SCENARIO, with the same results as `a7sim run`.

    The instrument must be served anew from the same scenario and seed: what is true of it never crosses the link, so a
    twin of it in this process stands for the truth, and a reply that is not the twin's ends the session.

    Example: a7sim operate akwanga --link tcp://127.0.0.1:5025
    """
    from a7sim.scripting import Operator
    from a7sim.session.tables import of_session

    loaded, seed = chosen(scenario, asked, {"plan.case": case, "plan.method": method})
    token = token_from(token_file)
    with watched(POINTS_A_MODEL * len(loaded.models), told) as watcher:
        operator = Operator(loaded, seed)
        document = operator.work(url, out, force=force, timeout=timeout, token=token, watcher=watcher)
    ended(document, told, of_session)
