"""`a7sim reduce`: reductions of measurements from files."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import click
from rich.console import Console

from a7sim import processing
from a7sim.cli.options import FILE, HEIGHT, NumberType, principal_distance
from a7sim.cli.reduce import options, tables
from a7sim.cli.renamed import command_with_renamed_options
from a7sim.errors import A7SimError
from a7sim.processing import ProcessingResult
from a7sim.processing.interior import FlightHeights
from a7sim.processing.strips import PairCamera
from a7sim.reduction.strips import JoinMethod
from a7sim.result_documents import Document, as_json

MIN_WIDTH = 80
"""Width in columns that all tables fit."""


_WITH_REFERENCE = command_with_renamed_options({"--against": "--reference"})


@click.group("reduce")
def command() -> None:
    """Compute orientations, centres, strips and blocks from files of measurements.

    Tables are CSV with a header line, or TOML with the columns as keys of an array of tables [[rows]]; decimal points,
    UTF-8, comments after #. Strips are also read from N.R.C. cards (.crd, .cards, or recognised by content). With --out
    DIR the results are written to results.json and CSV files.

    Example: a7sim reduce relative scenarios/dewitt-pair.csv --c 152.113
    """


@command.command("interior")
@click.argument("counts", type=FILE)
@click.option(
    "--camera",
    type=FILE,
    metavar="FILE",
    required=True,
    help="TOML with c, fiducials (name, x, y in mm), principal_point and distortion; a scenario's [camera] will do.",
)
@click.option(
    "--method",
    type=click.Choice(["conformal", "affine", "projective"]),
    default="affine",
    show_default=True,
    help="Transformation of counts to mm: rotation and scale; a scale in each axis and a shear; or perspective.",
)
@click.option(
    "--count-mm",
    type=NumberType(min=0.0, min_open=True, max=10.0),
    help="Size of a count, mm (1 for counts in mm); gives the film shrinkage and the principal distance to set.",
)
@click.option(
    "--correct",
    type=click.Choice(processing.CORRECTIONS),
    multiple=True,
    help="Correct the points and refer them to the principal point; repeatable.",
)
@click.option("--flying-height", type=NumberType(1.0, 30000.0), help="Height of the camera above the sea, m.")
@click.option(
    "--ground-height",
    type=NumberType(-500.0, 9000.0),
    default=0.0,
    show_default=True,
    help="Height of the ground above the sea, m.",
)
@options.documented
def interior(
    counts: Path,
    camera: Path,
    method: str,
    count_mm: float | None,
    correct: tuple[str, ...],
    flying_height: float | None,
    ground_height: float,
    out: Path | None,
    as_document: bool,
) -> None:
    """Refine comparator COUNTS (photo,point,x,y) to mm by the fiducials, named as in the camera.

    Writes image.csv (photo,point,x,y) and, for photographs of consecutive numbers, pairs.csv for `reduce strip`.

    Example: a7sim reduce interior counts.csv --camera scenarios/akwanga.toml --out refined
    """
    if flying_height is not None and flying_height <= ground_height:
        raise A7SimError(
            f"--flying-height: expected more than the ground height of {ground_height:g} m, got {flying_height:g}"
        )
    flight = None if flying_height is None else FlightHeights(flying_height, ground_height)
    outcome = processing.interior(counts, camera, method, count_mm, correct, flight)
    _deliver(outcome, as_document, out, tables.interior_tables)


@command.command("relative")
@click.argument("pair", type=FILE)
@principal_distance(required=True)
@options.principal_point
@options.base("92.0", 92.0)
@click.option(
    "--unknowns",
    type=click.Choice(["independent", "dependent"]),
    default="dependent",
    show_default=True,
    help="Photographs rotated: both, or the right one alone.",
)
@click.option(
    "--method",
    type=click.Choice(processing.RELATIVE_METHODS),
    default="coplanarity",
    show_default=True,
    help="robust removes the points with blunders and lists them; all compares the methods.",
)
@options.documented
def relative(
    pair: Path,
    c: float,
    x0: float,
    y0: float,
    bx: float,
    unknowns: Literal["independent", "dependent"],
    method: processing.RelativeMethod,
    out: Path | None,
    as_document: bool,
) -> None:
    """Orient the two photographs of PAIR (point,xl,yl,xr,yr) to each other.

    Writes the model with its centres to models.csv for `reduce connect`; a column `model` names it, preferably
    LEFT-RIGHT.

    Example: a7sim reduce relative scenarios/dewitt-pair.csv --c 152.113
    """
    _deliver(processing.relative(pair, c, (x0, y0), unknowns, bx, method), as_document, out, tables.relative_tables)


@command.command("centres")
@click.argument("pointings", type=FILE)
@click.option(
    "--method",
    type=click.Choice(processing.CENTRE_METHODS),
    default="two-levels",
    show_default=True,
    help="Method and columns, as listed above.",
)
@click.option("--z1", type=HEIGHT, default=4900.0, show_default=True, help="Z-counter reading of X1, Y1.")
@click.option("--z2", type=HEIGHT, default=5100.0, show_default=True, help="Z-counter reading of X2, Y2.")
@principal_distance(required=False)
@options.documented
def centres(
    pointings: Path,
    method: processing.CentreMethod,
    z1: float,
    z2: float,
    c: float | None,
    out: Path | None,
    as_document: bool,
) -> None:
    """Compute perspective centres from POINTINGS.

    \b
    two-levels  point,X1,Y1,X2,Y2     pointings at the levels --z1 and --z2
    levels      point,level,X,Y       at any number of levels, every point at each
    grid        point,x,y,X,Y,Z       crosses of a grid plate in mm, readings in mm; needs --c
    a8          model,base,column,height  from the A8's base scale and column, mm

    Example: a7sim reduce centres pointings.csv --z1 4900 --z2 5100
    """
    _deliver(processing.centres(pointings, z1, z2, method, c), as_document, out, tables.centres_tables)


@command.command("similarity")
@click.argument("common", type=FILE)
@click.option(
    "--method",
    type=click.Choice(processing.SIMILARITY_METHODS),
    default="iteration",
    show_default=True,
    help="both compares the methods.",
)
@options.documented
def similarity(common: Path, method: processing.SimilarityMethod, out: Path | None, as_document: bool) -> None:
    """Compute the similarity of COMMON (point,x,y,z,X,Y,Z): X = scale R x + T.

    Example: a7sim reduce similarity common.csv --method both
    """
    _deliver(processing.similarity(common, method), as_document, out, tables.similarity_tables)


@command.command("connect")
@click.argument("models", type=FILE, nargs=-1, required=True)
@options.join_method
@options.documented
def connect(models: tuple[Path, ...], method: JoinMethod, out: Path | None, as_document: bool) -> None:
    """Join two or more MODELS (model,point,X,Y,Z; or one deck of cards) in the system of the first.

    Neighbours share a projection centre, a point named PHOTO:centre; without centres the models are sorted by name.

    Example: a7sim reduce connect models.csv --method centre
    """
    _deliver(processing.connect(models, method), as_document, out, tables.connection_tables)


@command.command("strip", cls=_WITH_REFERENCE)
@click.argument("file", type=FILE)
@principal_distance(required=False)
@options.principal_point
@options.base("of pairs, their mean x-parallax")
@options.ground(required=False)
@options.join_method
@click.option("--polynomial", type=click.Choice(["2", "3"]), help="Adjust the strip by polynomials of this degree.")
@options.reference
@options.documented
def strip(
    file: Path,
    c: float | None,
    x0: float,
    y0: float,
    bx: float | None,
    ground: Path | None,
    method: JoinMethod,
    polynomial: str | None,
    reference: Path | None,
    out: Path | None,
    as_document: bool,
) -> None:
    """Form a strip and orient it to the ground, from a FILE of one of three kinds.

    \b
    pairs    model,point,xl,yl,xr,yr  needs --c and --ground
    models   model,point,X,Y,Z        needs --ground; centres are points PHOTO:centre
    cards    of the N.R.C. program    with their own ground control

    Models named LEFT-RIGHT may come in any order; other pairs keep the order of the file. --out also writes
    output cards (strip.crd) and PAT-M free format (strip.pat), if names and numbers fit the formats.

    Example: a7sim reduce strip pairs.csv --c 153.84 --ground ground.csv
    """
    degree: Literal[2, 3] | None = None if polynomial is None else 2 if polynomial == "2" else 3
    camera = None if c is None else PairCamera(c, (x0, y0), bx)
    outcome = processing.strip(file, ground, camera, method, degree, reference)
    _deliver(outcome, as_document, out, tables.strip_tables)


@command.command("absolute", cls=_WITH_REFERENCE)
@click.argument("model", type=FILE)
@options.ground(required=True)
@options.reference
@options.documented
def absolute(model: Path, ground: Path, reference: Path | None, out: Path | None, as_document: bool) -> None:
    """Orient one MODEL or strip (point,X,Y,Z) to the ground.

    Example: a7sim reduce absolute model.csv --ground ground.csv
    """
    _deliver(processing.absolute(model, ground, reference), as_document, out, tables.absolute_tables)


@command.command("block", cls=_WITH_REFERENCE)
@click.argument("models", type=FILE, nargs=-1, required=True)
@options.ground(required=True)
@click.option(
    "--height-weight",
    type=NumberType(min=1e-6, max=1e6),
    default=1.0,
    show_default=True,
    help="Weight of equations in height against those in plan.",
)
@options.reference
@options.documented
def block(
    models: tuple[Path, ...],
    ground: Path,
    height_weight: float,
    reference: Path | None,
    out: Path | None,
    as_document: bool,
) -> None:
    """Adjust MODELS (model,point,X,Y,Z) of one or several strips to the ground at once, 500 at most.

    Models should be nearly level; --out writes output cards of each strip (strip-1.crd ...).

    Example: a7sim reduce block strip1.csv strip2.csv --ground ground.csv
    """
    _deliver(processing.block(models, ground, height_weight, reference), as_document, out, tables.block_tables)


def _deliver(
    outcome: ProcessingResult, as_document: bool, out: Path | None, to_tables: Callable[[Document], list[Any]]
) -> None:
    """Write a result to its folder, if any, and print it as JSON or as tables."""
    document = outcome.document if out is None else processing.write_result(outcome, out)
    if as_document:
        click.echo(as_json(document), nl=False)
        return
    console = Console(markup=False, highlight=False, emoji=False)
    console.width = max(console.width, MIN_WIDTH)
    for each in [*to_tables(document), *tables.warning_lines(document)]:
        console.print(each)
