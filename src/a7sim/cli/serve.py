"""`a7sim serve`: the instrument of a scenario on TCP, RFC 2217 and pseudo-terminals."""

import asyncio
import signal
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import click

from a7sim.cli.links import TOKEN_VARIABLE, token_from
from a7sim.cli.options import Above, chosen, of_a_folder, of_a_scenario
from a7sim.documents import Document, as_json, head
from a7sim.instrument import Autograph, build_autograph
from a7sim.instrument.language import Desk
from a7sim.instrument.language.desk import POLL_TAKES
from a7sim.link.addresses import Address, address_of
from a7sim.link.clock import Clock, WallClock
from a7sim.link.conversation import Terms
from a7sim.link.faults import EXAMPLE, faults_of
from a7sim.link.serving import Doors, Server
from a7sim.mistakes import Mistake
from a7sim.scenario import Scenario
from a7sim.scene import build_scene
from a7sim.session.folder import JOURNAL, prepare_folder
from a7sim.session.journal import Journal

USUAL = Address("127.0.0.1", 5025)

_STOPPING = ("SIGTERM", "SIGINT", "SIGHUP")


@click.command("serve")
@click.argument("scenario")
@click.option("--tcp", multiple=True, metavar="HOST:PORT", help="Listen on a bare socket  [default: 127.0.0.1:5025]")
@click.option("--rfc2217", multiple=True, metavar="HOST:PORT", help="Listen as a serial port over telnet.")
@click.option("--pty", multiple=True, type=click.Path(path_type=Path), help="Make a link to a pseudo-terminal.")
@click.option("--baud", type=click.IntRange(50, 10_000_000), help="As slow as a wire of so many bits a second.")
@click.option("--realtime", is_flag=True, help="Movement lasts as long on the wall as on the simulated clock.")
@click.option("--listen-anyway", is_flag=True, help="Let other machines in; clients must log in with a token.")
@click.option(
    "--token-file", type=click.Path(path_type=Path), help=f"The token; or in the environment as {TOKEN_VARIABLE}."
)
@click.option("--clients", type=click.IntRange(min=1), default=64, show_default=True, help="Most at a time.")
@click.option("--idle", type=Above(), default=3600.0, show_default=True, help="Drop who is silent for so many s.")
@click.option("--fault", metavar="FAULTS", help=f"Fail now and then: {EXAMPLE}")
@click.option("--fault-seed", type=click.IntRange(min=0), default=0, show_default=True, help="Draws the faults.")
@of_a_scenario
@of_a_folder
@click.option("--json", "as_document", is_flag=True, help="Print where it listens as one JSON document.")
@click.option("--quiet", is_flag=True, help="Print nothing.")
def command(
    scenario: str,
    tcp: tuple[str, ...],
    rfc2217: tuple[str, ...],
    pty: tuple[Path, ...],
    baud: int | None,
    realtime: bool,
    listen_anyway: bool,
    token_file: Path | None,
    clients: int,
    idle: float,
    fault: str | None,
    fault_seed: int,
    seed: int | None,
    settings: tuple[str, ...],
    skill: str | None,
    perfect_observer: bool,
    out: Path | None,
    force: bool,
    as_document: bool,
    quiet: bool,
) -> None:
    """Serve the instrument of SCENARIO until it is stopped: Ctrl-C and kill end it with exit code 0.

    Example: a7sim serve akwanga --tcp 127.0.0.1:5025 --pty ./a7
    """
    loaded, seed = chosen(scenario, seed, settings, skill, perfect_observer)
    doors = _doors(tcp, rfc2217, pty)
    token = token_from(token_file)
    _refuse_open_doors(doors, listen_anyway, token)
    terms = Terms(baud, faults_of(fault) if fault is not None else None, fault_seed, idle, most_clients=clients)
    journal = Journal()
    poll_takes = 0.0 if realtime else POLL_TAKES
    desk = Desk(_instrument(loaded, seed), journal.heard if out else None, token, poll_takes)
    if out is not None:
        prepare_folder(out, force)
    told = _Told(_head(loaded, seed), as_document, quiet)
    header = {"scenario": loaded.title, "seed": seed, "variant": loaded.instrument.variant}
    with journal.opened(out / JOURNAL if out else None, header):
        asyncio.run(_serve(desk, doors, terms, realtime, told))


async def _serve(desk: Desk, doors: Doors, terms: Terms, realtime: bool, told: "_Told") -> None:
    stopped = asyncio.Event()
    loop = asyncio.get_running_loop()
    for name in _STOPPING:
        loop.add_signal_handler(getattr(signal, name), stopped.set)
    server = Server(desk, WallClock() if realtime else Clock(), terms)
    opened = await server.open(doors)
    try:
        told.ready(opened)
        await stopped.wait()
    finally:
        await server.close()


@dataclass(frozen=True)
class _Told:
    """What is printed once every door is open."""

    head: Document
    as_document: bool
    quiet: bool

    def ready(self, opened: list[dict[str, Any]]) -> None:
        if self.as_document:
            click.echo(as_json(self.head | {"listening": opened}), nl=False)
        elif not self.quiet:
            for door in opened:
                click.echo(f"{door['kind']:<8}{door['url']}")
            click.echo("ready")
        sys.stdout.flush()


def _head(scenario: Scenario, seed: int) -> Document:
    return head("serve") | {"scenario": scenario.title, "seed": seed, "variant": scenario.instrument.variant}


def _instrument(scenario: Scenario, seed: int) -> Autograph:
    return build_autograph(scenario.instrument, build_scene(scenario, seed).drawer, seed)


def _doors(tcp: tuple[str, ...], rfc2217: tuple[str, ...], pty: tuple[Path, ...]) -> Doors:
    sockets = [address_of(text, "--tcp") for text in tcp]
    if not (tcp or rfc2217 or pty):
        sockets = [USUAL]
    return Doors(sockets, [address_of(text, "--rfc2217") for text in rfc2217], pty)


def _refuse_open_doors(doors: Doors, listen_anyway: bool, token: str | None) -> None:
    for address in (*doors.tcp, *doors.rfc2217):
        if not address.loopback and not listen_anyway:
            raise Mistake(f"{address}: expected an address of this machine alone (--listen-anyway lets others in)")
    if listen_anyway and token is None:
        raise Mistake(f"--listen-anyway: expected a token, from --token-file or in the environment as {TOKEN_VARIABLE}")
