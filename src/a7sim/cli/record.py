"""`a7sim record`: a journal of the traffic between a client and an instrument."""

import signal
import socket
import threading
from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.run_options import DURABILITY
from a7sim.errors import A7SimError
from a7sim.journal.append_file import Durability
from a7sim.journal.session_files import prepare_folder
from a7sim.journal.writer import Header, Journal, JournalOptions, make_header, make_header_without_scenario
from a7sim.link.client.ports import open_port
from a7sim.link.client.recording_proxy import RecordingProxy
from a7sim.link.clock import WallClock
from a7sim.link.server.addresses import Address, parse_address
from a7sim.result_documents import as_json, document_header
from a7sim.scenario import load_scenario

_STOPPING = ("SIGTERM", "SIGINT", "SIGHUP")


@click.command("record")
@click.argument("url")
@options.tcp("127.0.0.1:0")
@options.instrument_of
@options.seed()
@options.new_folder("the journal", required=True)
@DURABILITY
@options.as_document
def command(
    url: str,
    tcp: str,
    scenario: str | None,
    seed: int | None,
    out: Path,
    force: bool,
    durability: Durability,
    as_document: bool,
) -> None:
    """Record the traffic between a client and the instrument at URL until stopped by Ctrl-C or kill.

    Clients connect one after the other; each line and each reply is journalled before it is passed on.

    Example: a7sim record tcp://127.0.0.1:5025 --tcp 127.0.0.1:5026 --out runs/recorded
    """
    header = _header(url, scenario, seed)
    open_port(url).close()
    address = parse_address(tcp, "--tcp")
    if not address.loopback:
        raise A7SimError(f"--tcp {address}: expected an address of this machine alone")
    stop = threading.Event()
    for name in _STOPPING:
        signal.signal(getattr(signal, name), lambda *_: stop.set())
    with _listen(address) as listener:
        prepare_folder(out, force)
        with Journal(JournalOptions(durability)).recording(out, header, None) as journal:
            host, port = listener.getsockname()[:2]
            where = f"tcp://{Address(host, port)}"
            click.echo(
                as_json(document_header("record") | {"url": where, "instrument": url}) if as_document else where,
                nl=False,
            )
            click.echo("" if as_document else "\nready")
            RecordingProxy(url, journal.on_link_event, WallClock(), stop).serve(listener)


def _header(url: str, scenario: str | None, seed: int | None) -> Header:
    if scenario is None:
        if seed is not None:
            raise A7SimError("--seed: expected a --scenario beside it, got none")
        return make_header_without_scenario("record", instrument=url)
    loaded = load_scenario(scenario)
    return make_header("record", loaded, loaded.seed if seed is None else seed, instrument=url)


def _listen(address: Address) -> socket.socket:
    try:
        return socket.create_server((address.host, address.port), backlog=1)
    except OSError as error:
        raise A7SimError(f"--tcp {address}: expected an address to listen on: {error.strerror}") from error
