"""Options shared by the commands for served instruments; light, so that `a7sim send` starts quickly."""

import os
import re
from pathlib import Path

import click

from a7sim.cli.options import TOKEN_VARIABLE, NumberType, combine_options, token_file
from a7sim.errors import A7SimError
from a7sim.link.client.ports import TIMEOUT_S

MAX_TOKEN_LENGTH = 1000
"""Characters: they fit into a line of the language even if all are doubled quotes."""

_SENDABLE = re.compile(f"[ -~]{{1,{MAX_TOKEN_LENGTH}}}")

_TIMEOUT = click.option(
    "--timeout",
    type=NumberType(min=0.0, min_open=True, max=1e6),
    default=TIMEOUT_S,
    show_default=True,
    metavar="SECONDS",
    help="Seconds to wait for a reply.",
)

link_options = combine_options(_TIMEOUT, token_file)
"""--timeout, --token-file: connection to a served instrument."""


def token_from(file: Path | None) -> str | None:
    """Return the token in a file, otherwise that of the environment, None without one. Raises A7SimError."""
    if file is None:
        return _token(os.environ[TOKEN_VARIABLE], TOKEN_VARIABLE) if os.environ.get(TOKEN_VARIABLE) else None
    try:
        text = file.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise A7SimError(f"--token-file {file}: expected a file with a token: {error.strerror}") from error
    return _token(text, f"--token-file {file}")


def _token(text: str, where: str) -> str:
    token = text.strip()
    if not _SENDABLE.fullmatch(token):
        raise A7SimError(f"{where}: expected a token of 1 to {MAX_TOKEN_LENGTH} printable ASCII characters on one line")
    return token
