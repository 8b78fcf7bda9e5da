"""Server of an instrument: TCP, RFC 2217 and pseudo-terminals, one loop, one engine per client."""

import asyncio
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from a7sim.errors import A7SimError
from a7sim.instrument.language import ErrorNumber, SharedInstrument, format_entry
from a7sim.link.clock import Clock, WallClock
from a7sim.link.server.addresses import Address
from a7sim.link.server.client_session import ClientSession, ServerLimits, Transport
from a7sim.link.server.connections import MAX_READ, TcpConnection, TelnetConnection
from a7sim.link.server.pty_connection import PtyConnection
from a7sim.text import pluralize

MAX_REJECTION_NOTICES = 64
"""Number of clients at a time that get the reason of their rejection; further ones are only disconnected."""

LISTEN_BACKLOG = 512
"""Connections that may wait to be accepted, and are accepted before commands of clients are executed."""


@dataclass(frozen=True)
class Endpoints:
    """Endpoints of the instrument."""

    tcp: Sequence[Address] = ()
    rfc2217: Sequence[Address] = ()
    pty: Sequence[Path] = ()


class Server:
    """Served instrument, from `open` to `close`."""

    def __init__(self, instrument: SharedInstrument, clock: Clock | WallClock, terms: ServerLimits) -> None:
        self.instrument = instrument
        self._clock = clock
        self._terms = terms
        self._buffer = memoryview(bytearray(MAX_READ))
        self._wires: set[Transport] = set()
        self._rejected: set[Transport] = set()
        self._listeners: list[asyncio.Server] = []
        self._terminals: list[PtyConnection] = []

    async def open(self, endpoints: Endpoints) -> list[dict[str, Any]]:
        """Open all endpoints and return their description as a document. Raises A7SimError, and then none is open."""
        try:
            opened = [await self._listen("tcp", TcpConnection, address) for address in endpoints.tcp]
            opened += [await self._listen("rfc2217", TelnetConnection, address) for address in endpoints.rfc2217]
            opened += [self._open_terminal(path) for path in endpoints.pty]
        except BaseException:
            await self.close()
            raise
        return opened

    async def _listen(self, kind: str, wire: type[TcpConnection], address: Address) -> dict[str, Any]:
        loop = asyncio.get_running_loop()
        try:
            listener = await loop.create_server(
                lambda: wire(self, self._buffer), address.host, address.port, backlog=LISTEN_BACKLOG
            )
        except OSError as error:
            raise A7SimError(f"--{kind} {address}: expected an address to listen on: {_reason(error)}") from error
        self._listeners.append(listener)
        host, port = listener.sockets[0].getsockname()[:2]
        return {"kind": kind, "host": host, "port": port, "url": f"{kind}://{Address(host, port)}"}

    def _open_terminal(self, path: Path) -> dict[str, Any]:
        terminal = PtyConnection(self, path)
        self._terminals.append(terminal)
        return {"kind": "pty", "path": str(path), "device": terminal.device, "url": str(path)}

    async def close(self) -> None:
        """Close all endpoints; all clients are disconnected."""
        for listener in self._listeners:
            listener.close()
        for terminal in self._terminals:
            terminal.remove()
            self._wires.discard(terminal)
        self._terminals.clear()
        for wire in [*self._wires, *self._rejected]:
            wire.abort()
        await asyncio.sleep(0)

    @property
    def clients(self) -> int:
        """Number of clients, each terminal counted as one."""
        return len(self._wires)

    def accept(self, wire: Transport, serial: bool) -> ClientSession | bytes:
        """Return a session for a transport, or the reason for a rejection, as a line."""
        max_clients = self._terms.max_clients
        if len(self._wires) >= max_clients:
            if len(self._rejected) >= MAX_REJECTION_NOTICES:
                wire.abort()
            self._rejected.add(wire)
            text = format_entry(
                ErrorNumber.EXECUTION_ERROR, f"expected at most {pluralize(max_clients, 'client')} at a time"
            )
            return f"{text}\n".encode("ascii")
        self._wires.add(wire)
        return ClientSession(self.instrument, self._clock, self._terms, wire, self.instrument.client_count + 1, serial)

    def release(self, wire: Transport) -> None:
        """Record that a transport is closed."""
        self._wires.discard(wire)
        self._rejected.discard(wire)


def _reason(error: OSError) -> str:
    """Return the operating system's message without asyncio's additions;

    the error number of an unresolvable name is negative.
    """
    number = error.errno or 0
    return os.strerror(number) if number > 0 else error.strerror or str(error)
