"""`a7sim compile`: the operator draws contours and lines of a model."""

from pathlib import Path

import click
import msgspec
from rich.console import Console

from a7sim.cli import EXIT_DOES_NOT_FIT
from a7sim.documents import as_json
from a7sim.scenario import PROFILES, Observer, load_scenario
from a7sim.session.compiled_tables import of_compilation
from a7sim.session.compiling import Wanted, compile_model

_ABOVE_ZERO = click.FloatRange(min=0.0, min_open=True)


@click.command("compile")
@click.argument("scenario")
@click.option("--model", "name", default="1", show_default=True, help="Model to be compiled.")
@click.option("--contour", "contours", multiple=True, type=float, metavar="M", help="Height of a contour in m.")
@click.option("--interval", type=_ABOVE_ZERO, metavar="M", help="All contours whose height is a multiple of this.")
@click.option("--line", "lines", multiple=True, metavar="NAME", help="Road or track of the scenario.")
@click.option("--map-scale", type=click.FloatRange(min=100.0), metavar="N", help="Scale number of the map.")
@click.option("--tremor", type=click.FloatRange(min=0.0, max=500.0), metavar="UM", help="Tremor at photo scale.")
@click.option("--seed", type=click.IntRange(min=0), help="Draws film, instrument and operator.")
@click.option("--skill", type=click.Choice(list(PROFILES)), help="How good the operator is.")
@click.option("--perfect-observer", is_flag=True, help="An operator who sees, reads and follows without any error.")
@click.option("--out", type=click.Path(path_type=Path), help="Folder for map.geojson, map.svg, journal, book, results.")
@click.option("--force", is_flag=True, help="Write into a folder that exists.")
@click.option("--json", "as_document", is_flag=True, help="Print the results as one JSON document.")
def command(
    scenario: str,
    name: str,
    contours: tuple[float, ...],
    interval: float | None,
    lines: tuple[str, ...],
    map_scale: float | None,
    tremor: float | None,
    seed: int | None,
    skill: str | None,
    perfect_observer: bool,
    out: Path | None,
    force: bool,
    as_document: bool,
) -> None:
    """Let the operator set up a model of SCENARIO, level it, and draw contours and lines from it.

    Example: a7sim compile akwanga --model 1 --contour 460 --interval 10 --line road1 --out runs/sheet
    """
    loaded = load_scenario(scenario, {"observer": f'"{skill}"'} if skill else {})
    if perfect_observer:
        loaded = msgspec.structs.replace(loaded, observer=Observer.faultless())
    wanted = Wanted(name, contours, interval, lines, map_scale, tremor)
    document = compile_model(loaded, loaded.seed if seed is None else seed, wanted, out, force=force)
    if as_document:
        click.echo(as_json(document), nl=False)
    else:
        Console().print(of_compilation(document))
    if document["status"] != "complete":
        click.echo(f"a7sim: the operator gave up: {document['message']}", err=True)
        raise click.exceptions.Exit(EXIT_DOES_NOT_FIT)
