"""`a7sim send`: command lines to a served instrument, given or at a prompt."""

import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import click
import msgspec

from a7sim.cli import options
from a7sim.cli.link_options import link_options, token_from
from a7sim.link.client.client import Client
from a7sim.link.client.exchange import Exchange, send_line
from a7sim.link.client.ports import port_errors

EXIT_REFUSED = 1


@click.command("send")
@click.argument("url")
@click.argument("lines", metavar="[LINE]...", nargs=-1)
@link_options
@options.out_file("the bytes of blocks")
@options.as_document
def command(
    url: str, lines: tuple[str, ...], timeout: float, token_file: Path | None, out: Path | None, as_document: bool
) -> None:
    """Send each LINE to the instrument at URL and print its replies; errors of the instrument give exit code 1.

    Without a LINE they are read from standard input, or from a prompt on a terminal. URL is a7sim://SCENARIO?seed=N,
    tcp://HOST:PORT, rfc2217://HOST:PORT, or the path of a device or pty.

    Example: a7sim send a7sim://akwanga '*IDN?' 'BASE:BX 194.99;BX?'
    """
    with port_errors(url), Client.open(url, timeout, token_from(token_file)) as client:
        if not lines and not as_document and sys.stdin.isatty():
            from a7sim.cli.prompt import run_prompt  # readline takes hold of the terminal

            run_prompt(url, client)
            return
        exchanges = []
        for line in _lines(lines):
            exchange = send_line(client, line)
            exchanges.append(exchange)
            if not as_document and exchange.shown is not None:
                click.echo(exchange.shown)
    if out is not None:
        out.write_bytes(b"".join(_blocks(exchanges)))
    _report(exchanges, as_document)


def _lines(lines: tuple[str, ...]) -> Iterable[str]:
    source: Iterable[str] = (part for line in lines for part in line.splitlines()) if lines else sys.stdin
    return (line.strip() for line in source if line.strip())


def _blocks(exchanges: Iterable[Exchange]) -> Iterable[bytes]:
    return (part for exchange in exchanges for part in exchange.reply or () if isinstance(part, bytes))


def _report(exchanges: list[Exchange], as_document: bool) -> None:
    errors = [error for exchange in exchanges for error in exchange.errors]
    if as_document:
        click.echo(msgspec.json.format(msgspec.json.encode(_document(exchanges, errors)), indent=2))
    else:
        for error in errors:
            click.echo(f"a7sim: {error}", err=True)
    if errors:
        raise click.exceptions.Exit(EXIT_REFUSED)


def _document(exchanges: list[Exchange], errors: list[str]) -> dict[str, Any]:
    exchange_documents = [{"sent": exchange.sent, "reply": exchange.shown} for exchange in exchanges]
    return {"schema_version": 1, "command": "send", "exchanges": exchange_documents, "errors": errors}
