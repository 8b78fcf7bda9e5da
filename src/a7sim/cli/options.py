"""Options shared by several commands, each defined once; light to import."""

import functools
import math
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeVar

import click

from a7sim.cli.completers import CaseInsensitiveChoice, scenario_argument

Command = TypeVar("Command", bound=Callable[..., Any])
Option = Callable[[Command], Command]

TOKEN_VARIABLE = "A7SIM_TOKEN"

PLOTTERS = ("A7", "A8")
"""Plotters, repeated here to avoid importing their data."""

FILE = click.Path(path_type=Path, dir_okay=False)
FOLDER = click.Path(path_type=Path, file_okay=False)
PLACE = click.Path(path_type=Path)
"""File or folder; the code that opens it checks which."""


class NumberType(click.FloatRange):
    """Finite number within a range."""

    name = "number"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """Return the number; click accepts nan in any range."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"expected a finite number, got {value}", param, ctx)
        return number


def greater_than(bound: float) -> NumberType:
    """Return the type of numbers above a bound."""
    return NumberType(min=bound, min_open=True)


HEIGHT = NumberType(-1e6, 1e6)
"""Height or counter reading of either sign."""

COUNT = click.IntRange(min=1)


def combine_options(*options: Option[Any]) -> Option[Any]:
    """Return several options as one decorator, in their order."""

    def decorated(command: Command) -> Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


def group_options(name: str, record: type[Any], *options: Option[Any]) -> Option[Any]:
    """Return options whose values are passed as one dataclass parameter `name` with a field for each."""

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def called(*arguments: Any, **values: Any) -> Any:
            given = {field.name: values.pop(field.name) for field in fields(record)}
            return command(*arguments, **values, **{name: record(**given)})

        with_options: Callable[..., Any] = combine_options(*options)(called)
        return with_options

    return decorated


def option_help(option: str, default: str | None = None) -> str:
    """Return the help of an option, with its default."""
    return f"{option}." if default is None else f"{option}  [default: {default}]"


def seed(default: str = "the scenario's") -> Option[Any]:
    """Return --seed with its default in words."""
    return click.option(
        "--seed",
        type=click.IntRange(min=0),
        metavar="N",
        help=option_help("Seed of all random draws", default),
    )


def out_folder(of: str, default: str | None = None, required: bool = False) -> Option[Any]:
    """Return --out DIR for the contents `of`."""
    return click.option(
        "--out", type=PLACE, metavar="DIR", required=required, help=option_help(f"Folder for {of}", default)
    )


def out_file(of: str, default: str | None = None) -> Option[Any]:
    """Return --out FILE for the contents `of`."""
    return click.option("--out", type=FILE, metavar="FILE", help=option_help(f"File for {of}", default))


force = click.option("--force", is_flag=True, help="Write into an existing folder.")


def new_folder(of: str, required: bool = False) -> Option[Any]:
    """Return --out DIR and --force, for a new folder."""
    return combine_options(out_folder(of, required=required), force)


as_document = click.option("--json", "as_document", is_flag=True, help="Print the result as one JSON document.")


def quiet(but: str = "") -> Option[Any]:
    """Return --quiet, which prints nothing except `but`."""
    return click.option("--quiet", is_flag=True, help=f"Print nothing{f' but {but}' if but else ''}.")


def variant(default: str | None = None) -> Option[Any]:
    """Return --variant; without a default it is that of the scenario."""
    text = option_help("Plotter", None if default else "the scenario's")
    return click.option(
        "--variant", type=CaseInsensitiveChoice(PLOTTERS), default=default, show_default=default is not None, help=text
    )


instrument_of = click.option(
    "--scenario",
    metavar="SCENARIO",
    shell_complete=scenario_argument,
    help="Scenario of the instrument; needed to replay the journal.",
)

map_scale = click.option("--map-scale", type=greater_than(99.0), metavar="N", help="Scale number of the map.")

plain = click.option("--plain", is_flag=True, help="Describe the view in text, without animation (for screen readers).")


def principal_distance(required: bool) -> Option[Any]:
    """Return --c."""
    return click.option("--c", "c", type=NumberType(1.0, 1e5), required=required, help="Principal distance, mm.")


def tcp(default: str, multiple: bool = False) -> Option[Any]:
    """Return --tcp, the endpoint of a raw socket, with its default."""
    text = option_help("Listen on a raw socket", default)
    return click.option(
        "--tcp", default=None if multiple else default, multiple=multiple, metavar="HOST:PORT", help=text
    )


token_file = click.option(
    "--token-file",
    type=FILE,
    help=f"File with the login token; by default the token is read from {TOKEN_VARIABLE}.",
)
