"""What the commands that talk to a served instrument share; light, so that `a7sim send` starts quickly."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from a7sim.link.opening import TIMEOUT_S

TOKEN_VARIABLE = "A7SIM_TOKEN"

Command = TypeVar("Command", bound=Callable[..., Any])

_TIMEOUT = click.option(
    "--timeout",
    type=click.FloatRange(min=0.0, min_open=True, max=1e6),
    default=TIMEOUT_S,
    show_default=True,
    metavar="SECONDS",
    help="How long a reply is waited for.",
)
_TOKEN_FILE = click.option(
    "--token-file",
    type=click.Path(path_type=Path, dir_okay=False),
    help=f"File with the token of a server that asks for one; without it, the token is {TOKEN_VARIABLE}'s.",
)


def of_a_link(command: Command) -> Command:
    """Add --timeout and --token-file: how to talk to a served instrument."""
    return _TIMEOUT(_TOKEN_FILE(command))


def token_from(file: Path | None) -> str | None:
    """Return the token in a file, else that of the environment, None where there is neither."""
    token = os.environ.get(TOKEN_VARIABLE) if file is None else file.read_text(encoding="utf-8").strip()
    return token or None
