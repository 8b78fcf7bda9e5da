"""`a7sim run`: the virtual operator on a scenario."""

import click

from a7sim.cli.completers import scenario_argument
from a7sim.cli.run_options import (
    POINTS_A_MODEL,
    DisplayOptions,
    OutputOptions,
    ScenarioOptions,
    display_options,
    orientation_options,
    output_options,
    progress_bar,
    resolve_request,
    scenario_options,
    show_results,
)
from a7sim.errors import A7SimError
from a7sim.standard_points import CASES


@click.command("run")
@click.argument("scenario", required=False, shell_complete=scenario_argument)
@orientation_options
@click.option(
    "--strips",
    type=click.Choice(["one", "all"]),
    default="one",
    show_default=True,
    help="all: every case of one model with every case of the next, 25 strips of two models.",
)
@scenario_options
@output_options()
@display_options
def command(
    scenario: str | None,
    case: str | None,
    method: str | None,
    strips: str,
    scenario_options: ScenarioOptions,
    output: OutputOptions,
    display: DisplayOptions,
) -> None:
    """Run the virtual operator on SCENARIO, a file or the name of one that comes with a7sim, through to the strip.

    Example: a7sim run akwanga --case E --seed 7 --out runs/akwanga-e
    """
    from a7sim.report.session_tables import session_tables, strips_table
    from a7sim.session.all_methods import run_all_methods
    from a7sim.session.strip_combinations import run_combinations

    request = resolve_request(scenario, scenario_options, output, {"plan.case": case, "plan.method": method})
    every_case = request.setting("strips", strips) == "all"
    if every_case and case is not None:
        raise A7SimError("--strips all: expected no --case beside it, since every case is worked")
    run_session = run_combinations if every_case else run_all_methods
    session_count = len(CASES) if every_case else 1
    with progress_bar(POINTS_A_MODEL * session_count * len(request.scenario.models), display) as callbacks:
        document = run_session(request.scenario, request.seed, output.run_options(callbacks))
    show_results(document, display, strips_table if every_case else session_tables)
