"""Options that several reductions share."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Command = TypeVar("Command", bound=Callable[..., Any])

FILE = click.Path(path_type=Path)


class Number(click.FloatRange):
    """A finite number within a range."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; click lets nan through any range."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"expected a finite number, got {value}", param, ctx)
        return number


LENGTH = Number(min=0.001, max=1e6)
PLACE = Number(-1e6, 1e6)


def _with(*options: Callable[[Any], Any]) -> Callable[[Command], Command]:
    def decorated(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


documented = _with(
    click.option(
        "--out", type=FILE, metavar="DIR", help="Folder for results.json and the tables as CSV; may be there already."
    ),
    click.option("--json", "as_document", is_flag=True, help="Print the results as one JSON document."),
)

principal_point = _with(
    click.option("--x0", type=Number(-1e3, 1e3), default=0.0, show_default=True, help="Principal point, mm."),
    click.option("--y0", type=Number(-1e3, 1e3), default=0.0, show_default=True, help="Principal point, mm."),
)


def principal_distance(required: bool, help_text: str = "Principal distance, mm.") -> Callable[[Command], Command]:
    """Return the option `--c`."""
    return _with(click.option("--c", "c", type=Number(min=1.0, max=1e5), required=required, help=help_text))


def ground(required: bool) -> Callable[[Command], Command]:
    """Return the option `--ground`."""
    words = "Ground points: point,X,Y,Z,role; role is control, plan, height or check."
    return _with(
        click.option(
            "--ground", type=FILE, required=required, help=words if required else f"{words} Cards have theirs."
        )
    )


against = _with(
    click.option("--against", type=FILE, help="Coordinates (point,X,Y,Z) to table the differences of the results to.")
)

join_method = _with(
    click.option(
        "--method",
        type=click.Choice(["points", "centre", "heights"]),
        default="points",
        show_default=True,
        help="Join on all common points and the centre alike; on the centre, turned and scaled on the points; or so "
        "with the scale from the heights below it.",
    )
)
