"""`a7sim operate`: the virtual operator at a served instrument."""

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
@click.option("--link", "url", required=True, metavar="URL", help="Address of the served instrument.")
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
    scenario_options: ScenarioOptions,
    out: Path | None,
    force: bool,
    display: DisplayOptions,
) -> None:
    """Run the virtual operator on the served instrument of SCENARIO, with the same results as `a7sim run`.

    The instrument must be newly served from the same scenario and seed. The truth never crosses the link, so a
    reference instrument in this process provides it, and a reply that differs from its replies ends the session.

    Example: a7sim operate akwanga --link tcp://127.0.0.1:5025
    """
    from a7sim.api import Operator
    from a7sim.report.session_tables import session_tables

    loaded, seed = resolve_scenario(scenario, scenario_options, {"plan.case": case, "plan.method": method})
    token = token_from(token_file)
    with progress_bar(POINTS_A_MODEL * len(loaded.models), display) as watcher:
        operator = Operator(loaded, seed)
        document = operator.run(url, out, force=force, timeout=timeout, token=token, watcher=watcher)
    show_results(document, display, session_tables)
