"""Prompt of an instrument, with history and completion of headers."""

import csv
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import click

from a7sim.link.client.client import Client
from a7sim.link.client.completion import completions
from a7sim.link.client.exchange import send_line

HISTORY = "send-history"

MAX_HISTORY = 1000
"""Lines."""

_EXIT_WORDS = ("exit", "quit", "bye")


def run_prompt(url: str, client: Client) -> None:
    """Read lines and print their replies, until the end of input or `exit`."""
    identity = send_line(client, "*IDN?").shown or "an instrument that does not say what it is"
    headers = _headers(client)
    click.echo(f"{url}: {identity}. Tab completes, help lists the headers, exit leaves.")
    with _line_editing(headers):
        while True:
            try:
                line = input("a7sim> ").strip()
            except EOFError:
                click.echo()
                return
            except KeyboardInterrupt:
                click.echo()
                continue
            if line.lower() in _EXIT_WORDS:
                return
            if line.lower() in ("help", "?"):
                click.echo("\n".join(headers))
            elif line:
                _send_and_print(client, line)


def _send_and_print(client: Client, line: str) -> None:
    exchange = send_line(client, line)
    if exchange.shown is not None:
        click.echo(exchange.shown)
    for error in exchange.errors:
        number, _, text = error.partition(",")
        click.secho(f"{number}: {text.strip(chr(34)).replace(';', ': ', 1)}", fg="red")


def _headers(client: Client) -> list[str]:
    listed = send_line(client, "SYST:HELP:HEAD?").shown
    return next(csv.reader([listed])) if listed else []


@contextmanager
def _line_editing(headers: list[str]) -> Iterator[None]:
    """Give `input` completion and a persistent history, if the platform has readline."""
    try:
        import readline  # not on every platform
    except ImportError:
        yield
        return

    def complete(_: str, state: int) -> str | None:
        found = completions(readline.get_line_buffer()[: readline.get_endidx()], headers)
        return found[state] if state < len(found) else None

    readline.set_completer(complete)
    readline.set_completer_delims(" ;\t")
    readline.parse_and_bind("bind ^I rl_complete" if "libedit" in (readline.__doc__ or "") else "tab: complete")
    history = data_folder() / HISTORY
    with suppress(OSError):
        readline.read_history_file(history)
    readline.set_history_length(MAX_HISTORY)
    try:
        yield
    finally:
        with suppress(OSError):
            history.parent.mkdir(parents=True, exist_ok=True)
            readline.write_history_file(history)
            history.chmod(0o600)


def data_folder() -> Path:
    """Return the platform's folder for data of a program."""
    home = Path.home()
    if sys.platform == "win32":
        base = os.environ.get("LOCALAPPDATA") or home / "AppData" / "Local"
    elif sys.platform == "darwin":
        base = home / "Library" / "Application Support"
    else:
        base = os.environ.get("XDG_DATA_HOME") or home / ".local" / "share"
    return Path(base) / "a7sim"
