"""`a7sim bridge`: a strip carried on at the instrument, beside independent models."""

import click
import msgspec

from a7sim.cli import EXIT_DOES_NOT_FIT
from a7sim.cli.run import overrides_of, show, watched
from a7sim.scenario import Observer, load_scenario
from a7sim.session.bridge import run_bridge, tables_of

_POINTS_A_MODEL = 260
"""About how many points an operator works on in a model in both ways."""


@click.command("bridge")
@click.argument("scenario")
@click.option("--seed", type=click.IntRange(min=0), help="Draws film, instrument and operator.")
@click.option("--set", "settings", multiple=True, metavar="PATH=VALUE", help="Override a value of the scenario.")
@click.option("--perfect-observer", is_flag=True, help="An operator who sees and reads without any error.")
@click.option("--json", "as_document", is_flag=True, help="Print the results as one JSON document.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def command(
    scenario: str,
    seed: int | None,
    settings: tuple[str, ...],
    perfect_observer: bool,
    as_document: bool,
    quiet: bool,
) -> None:
    """Bridge the strip of SCENARIO with base in and out in turn, and work it as independent models for comparison.

    Example: a7sim bridge bridge --seed 7
    """
    loaded = load_scenario(scenario, overrides_of(settings, {}))
    if perfect_observer:
        loaded = msgspec.structs.replace(loaded, observer=Observer.faultless())
    chosen = loaded.seed if seed is None else seed
    with watched(_POINTS_A_MODEL * len(loaded.models), quiet or as_document) as watcher:
        document = run_bridge(loaded, chosen, watcher)
    show(document, as_document, quiet, tables_of)
    if document["status"] != "complete":
        click.echo(f"a7sim: the operator gave up: {document['message']}", err=True)
        raise click.exceptions.Exit(EXIT_DOES_NOT_FIT)
