"""`a7sim serve`: the instrument of a scenario on TCP, RFC 2217 and pseudo-terminals."""

import asyncio
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from a7sim.cli import options
from a7sim.cli.completers import scenario_argument
from a7sim.cli.link_options import token_from
from a7sim.cli.options import TOKEN_VARIABLE
from a7sim.cli.renamed import command_with_renamed_options
from a7sim.cli.run_options import (
    OutputOptions,
    ScenarioOptions,
    output_options,
    resolve_resume,
    resolve_scenario,
    scenario_options,
)
from a7sim.errors import A7SimError
from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.instrument.language.shared_instrument import POLL_SECONDS
from a7sim.journal.append_file import JournalWriteError
from a7sim.journal.resuming import ResumableSession, restore_instrument
from a7sim.journal.writer import Journal, JournalOptions, make_header
from a7sim.link.clock import Clock, WallClock
from a7sim.link.server.addresses import Address, parse_address
from a7sim.link.server.client_session import ServerLimits
from a7sim.link.server.event_loop import run
from a7sim.link.server.faults import EXAMPLE, parse_faults
from a7sim.link.server.serving import Endpoints, Server
from a7sim.result_documents import Document, as_json, document_header
from a7sim.scenario import Scenario

DEFAULT_ADDRESS = Address("127.0.0.1", 5025)

_SERVER_OPTIONS = (
    "tcp",
    "rfc2217",
    "pty",
    "baud",
    "allow_remote",
    "token_file",
    "clients",
    "idle",
    "fault",
    "fault_seed",
)
"""Options of a resumed server that may change."""

_STOPPING = ("SIGTERM", "SIGINT", "SIGHUP")


@click.command("serve", cls=command_with_renamed_options({"--listen-anyway": "--allow-remote"}))
@click.argument("scenario", required=False, shell_complete=scenario_argument)
@options.tcp(str(DEFAULT_ADDRESS), multiple=True)
@click.option("--rfc2217", multiple=True, metavar="HOST:PORT", help="Listen as a serial port over telnet (RFC 2217).")
@click.option(
    "--pty", multiple=True, type=options.PLACE, metavar="PATH", help="Create a pseudo-terminal and a link to it."
)
@click.option("--baud", type=click.IntRange(50, 10_000_000), metavar="N", help="Pace each line at this baud rate.")
@click.option("--realtime", is_flag=True, help="Run movement in real time.")
@click.option("--allow-remote", is_flag=True, help="Allow other machines; clients must log in with a token.")
@options.token_file
@click.option(
    "--clients", type=options.COUNT, metavar="N", default=64, show_default=True, help="Maximum number of clients."
)
@click.option(
    "--idle",
    type=options.greater_than(0.0),
    default=3600.0,
    show_default=True,
    metavar="SECONDS",
    help="Disconnect a client after this many idle seconds.",
)
@click.option("--fault", metavar="FAULTS", help=f"Inject faults: {EXAMPLE}")
@click.option(
    "--fault-seed", type=click.IntRange(min=0), metavar="N", default=0, show_default=True, help="Seed of the faults."
)
@scenario_options
@output_options("the journal")
@options.as_document
@options.quiet()
def command(
    scenario: str | None,
    tcp: tuple[str, ...],
    rfc2217: tuple[str, ...],
    pty: tuple[Path, ...],
    baud: int | None,
    realtime: bool,
    allow_remote: bool,
    token_file: Path | None,
    clients: int,
    idle: float,
    fault: str | None,
    fault_seed: int,
    scenario_options: ScenarioOptions,
    output: OutputOptions,
    as_document: bool,
    quiet: bool,
) -> None:
    """Serve the instrument of SCENARIO until it is stopped: Ctrl-C and kill end it with exit code 0.

    With --resume it is the instrument of an interrupted session in the state of its journal; clients must reconnect.

    Example: a7sim serve akwanga --tcp 127.0.0.1:5025 --pty ./a7
    """
    endpoints = _endpoints(tcp, rfc2217, pty)
    token = token_from(token_file)
    _check_remote_access(endpoints, allow_remote, token)
    limits = ServerLimits(
        baud, parse_faults(fault) if fault is not None else None, fault_seed, idle, max_clients=clients
    )
    if output.resume is not None:
        served = _resumed_instrument(resolve_resume(output.resume, *_SERVER_OPTIONS), token, output.journal_options)
    else:
        loaded, seed = resolve_scenario(scenario, scenario_options)
        output.journal_options.prepare(output.out, output.force)
        served = _new_instrument(loaded, seed, token, realtime, output)
    with served.journal:
        run(serve(served, endpoints, limits, StartupMessages(served.head, as_document, quiet)))


@dataclass(frozen=True)
class ServedInstrument:
    """Served instrument with its clock and journal."""

    head: Document
    instrument: SharedInstrument
    clock: Clock | WallClock
    journal: Journal


def _new_instrument(
    scenario: Scenario, seed: int, token: str | None, realtime: bool, output: OutputOptions
) -> ServedInstrument:
    autograph = Autograph.from_scenario(scenario, seed)
    journal = Journal(output.journal_options)
    instrument = SharedInstrument(
        autograph, journal.on_link_event if output.out else None, token, 0.0 if realtime else POLL_SECONDS
    )
    header = make_header("serve", scenario, seed, realtime=realtime, login=token is not None)
    return ServedInstrument(
        _document(scenario, seed), instrument, _clock(realtime), journal.recording(output.out, header, instrument)
    )


def _resumed_instrument(
    session: ResumableSession, token: str | None, journal_options: JournalOptions
) -> ServedInstrument:
    if session.setting("login") != (token is not None):
        expected, found = ("a", "none") if token is None else ("no", "one")
        raise A7SimError(
            f"{session.journalled.location(1)}: expected {expected} token, as the session was begun with, got {found}"
        )
    journal = Journal(journal_options)
    instrument, now, _ = restore_instrument(session, journal)
    instrument.token = token
    return ServedInstrument(
        _document(session.scenario, session.seed), instrument, _clock(session.setting("realtime"), now), journal
    )


def _clock(realtime: bool, now: float = 0.0) -> Clock | WallClock:
    return WallClock(now=now) if realtime else Clock(now)


async def serve(
    served: ServedInstrument, endpoints: Endpoints, limits: ServerLimits, messages: "StartupMessages"
) -> None:
    """Serve an instrument until the process is stopped. Raises JournalWriteError if the journal cannot be written."""
    stop = asyncio.Event()
    write_errors: list[JournalWriteError] = []
    loop = asyncio.get_running_loop()

    def fail(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if isinstance(error, JournalWriteError):
            write_errors.append(error)
            stop.set()
        else:
            loop.default_exception_handler(context)

    loop.set_exception_handler(fail)
    for name in _STOPPING:
        loop.add_signal_handler(getattr(signal, name), stop.set)
    server = Server(served.instrument, served.clock, limits)
    opened = await server.open(endpoints)
    try:
        messages.print_ready(opened)
        await stop.wait()
    finally:
        await server.close()
    if write_errors:
        raise write_errors[0]


@dataclass(frozen=True)
class StartupMessages:
    """Messages printed once all endpoints are open."""

    head: Document
    as_document: bool
    quiet: bool

    def print_ready(self, opened: list[dict[str, Any]]) -> None:
        """Print the addresses of all endpoints."""
        if self.as_document:
            click.echo(as_json(self.head | {"listening": opened}), nl=False)
        elif not self.quiet:
            for endpoint in opened:
                click.echo(f"{endpoint['kind']:<8}{endpoint['url']}")
            click.echo("ready")
        sys.stdout.flush()


def _document(scenario: Scenario, seed: int) -> Document:
    return document_header("serve") | {"scenario": scenario.title, "seed": seed, "variant": scenario.instrument.variant}


def _endpoints(tcp: tuple[str, ...], rfc2217: tuple[str, ...], pty: tuple[Path, ...]) -> Endpoints:
    sockets = [parse_address(text, "--tcp") for text in tcp]
    if not (tcp or rfc2217 or pty):
        sockets = [DEFAULT_ADDRESS]
    if len({path.absolute() for path in pty}) < len(pty):
        raise A7SimError(f"--pty: expected a path of its own for each, got {', '.join(map(str, pty))}")
    return Endpoints(sockets, [parse_address(text, "--rfc2217") for text in rfc2217], pty)


def _check_remote_access(endpoints: Endpoints, allow_remote: bool, token: str | None) -> None:
    addresses = [("--tcp", each) for each in endpoints.tcp] + [("--rfc2217", each) for each in endpoints.rfc2217]
    for option, address in addresses:
        if not address.loopback and not allow_remote:
            raise A7SimError(
                f"{option} {address}: expected an address of this machine alone (--allow-remote allows others)"
            )
    if allow_remote and token is None:
        raise A7SimError(
            f"--allow-remote: expected a token, from --token-file or in the environment as {TOKEN_VARIABLE}"
        )
