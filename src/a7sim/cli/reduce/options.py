"""Options shared by several reductions."""

from typing import Any

import click

from a7sim.cli.options import FILE, NumberType, Option, as_document, combine_options, option_help, out_folder

documented = combine_options(out_folder("results.json and tables as CSV; may exist"), as_document)

principal_point = combine_options(
    click.option("--x0", type=NumberType(-1e3, 1e3), default=0.0, show_default=True, help="Principal point, mm."),
    click.option("--y0", type=NumberType(-1e3, 1e3), default=0.0, show_default=True, help="Principal point, mm."),
)


def base(default: str, length: float | None = None) -> Option[Any]:
    """Return --bx, a length, with its default in words."""
    return click.option(
        "--bx", type=NumberType(0.001, 1e6), default=length, help=option_help("Length of the base, mm", default)
    )


def ground(required: bool) -> Option[Any]:
    """Return the option `--ground`."""
    help_text = "Ground points: point,X,Y,Z,role; role is control, plan, height or check."
    return click.option("--ground", type=FILE, metavar="FILE", required=required, help=help_text)


reference = click.option(
    "--reference",
    type=FILE,
    metavar="FILE",
    help="Coordinates (point,X,Y,Z) with which the results are compared.",
)

join_method = click.option(
    "--method",
    type=click.Choice(["points", "centre", "heights"]),
    default="points",
    show_default=True,
    help="Join on all common points and the centre alike; on the centre, with rotation and scale from the points; or "
    "likewise, but with the scale from the heights below it.",
)
