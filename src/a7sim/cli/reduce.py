"""`a7sim reduce`: the computing room on anyone's files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeVar

import click
from rich.console import Console
from rich.table import Table

from a7sim import computing
from a7sim.documents import Document, as_json
from a7sim.mistakes import Mistake

Command = TypeVar("Command", bound=Callable[..., Any])

_FILE = click.Path(path_type=Path)


def _documented(command: Command) -> Command:
    for option in (
        click.option("--json", "as_document", is_flag=True, help="Print the results as one JSON document."),
        click.option("--out", type=_FILE, help="Folder for results.json."),
    ):
        command = option(command)
    return command


def _camera(command: Command) -> Command:
    for option in (
        click.option("--y0", type=float, default=0.0, help="Principal point, mm."),
        click.option("--x0", type=float, default=0.0, help="Principal point, mm."),
        click.option("--c", "c", type=click.FloatRange(min=1.0), required=True, help="Principal distance, mm."),
    ):
        command = option(command)
    return command


@click.group("reduce")
def command() -> None:
    """Compute orientations, centres and strips from files of measurements."""


@command.command("relative")
@click.argument("pair", type=_FILE)
@_camera
@click.option("--bx", type=click.FloatRange(min=0.001), default=92.0, show_default=True, help="Length of the base, mm.")
@click.option("--unknowns", type=click.Choice(["independent", "dependent"]), default="dependent", show_default=True)
@_documented
def relative(
    pair: Path,
    c: float,
    x0: float,
    y0: float,
    bx: float,
    unknowns: Literal["independent", "dependent"],
    out: Path | None,
    as_document: bool,
) -> None:
    """Orient the two photographs of PAIR (point,xl,yl,xr,yr) to each other.

    Example: a7sim reduce relative scenarios/dewitt-pair.csv --c 152.113
    """
    document = computing.relative(pair, c, (x0, y0), unknowns, bx)
    _deliver(document, as_document, out, _of_relative(document))


@command.command("strip")
@click.argument("pairs", type=_FILE)
@_camera
@click.option("--bx", type=click.FloatRange(min=0.001), help="bx of every model, mm; else the mean x-parallax.")
@click.option("--ground", type=_FILE, required=True, help="Ground points: point,X,Y,Z,role.")
@click.option("--polynomial", type=click.Choice(["2", "3"]), help="Adjust the strip by polynomials of this degree.")
@_documented
def strip(
    pairs: Path,
    c: float,
    x0: float,
    y0: float,
    bx: float | None,
    ground: Path,
    polynomial: str | None,
    out: Path | None,
    as_document: bool,
) -> None:
    """Form a strip from PAIRS (model,point,xl,yl,xr,yr) and orient it to the ground.

    Models named LEFT-RIGHT may come in any order; others are taken as they stand in the file.

    Example: a7sim reduce strip pairs.csv --c 153.84 --ground ground.csv
    """
    degree: Literal[2, 3] | None = None if polynomial is None else 2 if polynomial == "2" else 3
    document = computing.strip(pairs, ground, c, (x0, y0), bx, degree)
    _deliver(document, as_document, out, _of_strip(document))


@command.command("centres")
@click.argument("pointings", type=_FILE)
@click.option("--z1", type=float, default=4900.0, show_default=True, help="Z-counter reading of X1, Y1.")
@click.option("--z2", type=float, default=5100.0, show_default=True, help="Z-counter reading of X2, Y2.")
@_documented
def centres(pointings: Path, z1: float, z2: float, out: Path | None, as_document: bool) -> None:
    """Compute a perspective centre from POINTINGS (point,X1,Y1,X2,Y2) at two levels.

    Example: a7sim reduce centres pointings.csv --z1 4900 --z2 5100
    """
    document = computing.centres(pointings, z1, z2)
    rows = [(name, document[name], document[f"sigma_{name}"]) for name in ("X0", "Y0", "Z0", "T0")]
    _deliver(document, as_document, out, [_table(("", "value", "±"), rows), f"rms {document['rms']:.4f}"])


@command.command("similarity")
@click.argument("common", type=_FILE)
@_documented
def similarity(common: Path, out: Path | None, as_document: bool) -> None:
    """Compute the similarity of COMMON (point,x,y,z,X,Y,Z): X = scale R x + T.

    Example: a7sim reduce similarity common.csv
    """
    document = computing.similarity(common)
    sigma = document["sigma"]
    values = {"scale": document["scale"]} | document["angles"]
    values |= dict(zip(("Tx", "Ty", "Tz"), document["translation"], strict=True))
    shown: list[Any] = [
        _table(("", "value", "±"), [(name, value, sigma[name]) for name, value in values.items()], 6),
        _table(("point", "vX", "vY", "vZ"), [(point, *v) for point, v in document["residuals"].items()]),
        f"s0 {document['s0']:.5f}, angles in gon",
    ]
    _deliver(document, as_document, out, shown)


def _of_relative(document: Document) -> list[Any]:
    elements = [(name, each["value"], each["sigma"]) for name, each in document["elements"].items()]
    parallaxes = document["residual_y_parallax_mm"]
    points = [(name, *place, parallaxes[name]) for name, place in document["points"].items()]
    return [
        _table(("element, gon and mm", "value", "±"), elements),
        _table(("point", "X", "Y", "Z", "p"), points),
        f"s0 {document['s0_mm']:.4f} mm, {document['iterations']} iterations",
    ]


def _of_strip(document: Document) -> list[Any]:
    joins = [(" - ".join(j["models"]), j["scale"], j["max_residual_mm"]) for j in document["joins"]]
    shown: list[Any] = [
        _table(("join", "scale", "largest residual, mm"), joins, 5),
        f"absolute scale {document['absolute']['scale']:.9f}",
        _residual_table("residuals, m", document["residuals_m"]),
    ]
    if "polynomial" in document:
        polynomial = document["polynomial"]
        shown.append(
            _residual_table(f"after the polynomial of degree {polynomial['degree']}, m", polynomial["residuals_m"])
        )
    return shown + [f"warning: {warning}" for warning in document["warnings"]]


def _residual_table(title: str, residuals: Document) -> Table:
    rows = [(point, each["role"], each["X"], each["Y"], each["Z"]) for point, each in residuals.items()]
    return _table((title, "role", "X", "Y", "Z"), rows, 3)


def _table(header: tuple[str, ...], rows: list[tuple[Any, ...]], decimals: int = 4) -> Table:
    table = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0), header_style="dim")
    for i, name in enumerate(header):
        table.add_column(name, justify="right" if i else "left")
    for row in rows:
        table.add_row(*(f"{cell:.{decimals}f}" if isinstance(cell, float) else str(cell) for cell in row))
    return table


def _deliver(document: Document, as_document: bool, out: Path | None, shown: list[Any]) -> None:
    if out is not None:
        try:
            out.mkdir(parents=True, exist_ok=True)
            (out / "results.json").write_text(as_json(document), encoding="utf-8")
        except OSError as error:
            raise Mistake(f"{out}: expected a folder that can be written: {error.strerror}") from error
    if as_document:
        click.echo(as_json(document), nl=False)
    else:
        console = Console(markup=False, highlight=False)
        for each in shown:
            console.print(each)
