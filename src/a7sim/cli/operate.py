"""`a7sim operate`: the operator works an instrument that is served."""

from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.completers import scenario_argument
from a7sim.cli.link_options import link_options, token_from
from a7sim.cli.run_options import (
    POINTS_A_MODEL,
    SESSION,
    DisplayOptions,
    ScenarioOptions,
    display_options,
    orientation_options,
    progress_bar,
    resolve_scenario,
    scenario_options,
    show_results,
)


@click.command("operate")
@click.argument("scenario", shell_complete=scenario_argument)
@click.option("--link", "url", required=True, metavar="URL", help="Where the instrument is served.")
@link_options
@orientation_options
@scenario_options
@options.new_folder(SESSION)
@display_options
def command(
    scenario: str,
    url: str,
    timeout: float,
    token_file: Path | None,
    case: str | None,
    method: str | None,
    asked: ScenarioOptions,
    out: Path | None,
    force: bool,
    told: DisplayOptions,
) -> None:
    """Let the operator work the served instrument of SCENARIO, with the same results as `a7sim run`.

    The instrument must be served anew from the same scenario and seed: what is true of it never crosses the link, so a
    twin of it in this process stands for the truth, and a reply that is not the twin's ends the session.

    Example: a7sim operate akwanga --link tcp://127.0.0.1:5025
    """
    from a7sim.api import Operator
    from a7sim.report.session_tables import session_tables

    loaded, seed = resolve_scenario(scenario, asked, {"plan.case": case, "plan.method": method})
    token = token_from(token_file)
    with progress_bar(POINTS_A_MODEL * len(loaded.models), told) as watcher:
        operator = Operator(loaded, seed)
        document = operator.run(url, out, force=force, timeout=timeout, token=token, watcher=watcher)
    show_results(document, told, session_tables)
