"""An instrument served from a thread of the tests, and its clients on bare sockets."""

import asyncio
import socket
import threading
from collections.abc import Callable
from typing import Any, TypeVar

from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.clock import Clock, WallClock
from a7sim.link.server.addresses import Address
from a7sim.link.server.client_session import ServerLimits
from a7sim.link.server.serving import Endpoints, Server
from a7sim.plotters import VARIANTS

Result = TypeVar("Result")

ANY_PORT = Address("127.0.0.1", 0)
TIMEOUT_S = 10.0
"""A test fails after this wait."""


class SocketClient:
    """A client on a bare socket."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=TIMEOUT_S)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._received = b""

    def send(self, data: bytes) -> None:
        """Send bytes."""
        self.socket.sendall(data)

    def read(self) -> str:
        """Return the next reply line, '' if the server has closed the connection."""
        while b"\n" not in self._received:
            more = self.socket.recv(65536)
            if not more:
                return ""
            self._received += more
        line, self._received = self._received.split(b"\n", 1)
        return line.decode("latin-1")

    def ask(self, line: str) -> str:
        """Send a line and return the next reply line."""
        self.send(line.encode("latin-1") + b"\n")
        return self.read()

    def wait_closed(self) -> bool:
        """Read until the server closes the connection; return True. Raises TimeoutError if it does not."""
        try:
            while self.socket.recv(65536):
                pass
        except ConnectionError:
            pass
        return True

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()

    def __enter__(self) -> "SocketClient":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class ServerThread:
    """A server in a thread, as a context; its `line` clients are closed with it.

    `port` is the number of the first endpoint that has one.
    """

    port: int

    def __init__(
        self,
        instrument: SharedInstrument | None = None,
        limits: ServerLimits | None = None,
        endpoints: Endpoints | None = None,
        realtime: bool = False,
    ) -> None:
        self.instrument = instrument or SharedInstrument(Autograph(VARIANTS["A7"]), poll_takes=0.0 if realtime else 0.1)
        self.clock = WallClock() if realtime else Clock()
        self._limits = limits or ServerLimits()
        self._endpoints = endpoints or Endpoints(tcp=[ANY_PORT])
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._clients: list[SocketClient] = []

    def __enter__(self) -> "ServerThread":
        self._thread.start()
        self.server = Server(self.instrument, self.clock, self._limits)
        opening = asyncio.run_coroutine_threadsafe(self.server.open(self._endpoints), self._loop)
        self.listening: list[dict[str, Any]] = opening.result(TIMEOUT_S)
        ports = [endpoint["port"] for endpoint in self.listening if "port" in endpoint]
        if ports:
            self.port = ports[0]
        return self

    def line(self) -> SocketClient:
        """Connect a client."""
        self._clients.append(SocketClient(self.port))
        return self._clients[-1]

    def call(self, function: Callable[[], Result]) -> Result:
        """Call a function in the server's thread and return its result."""

        async def called() -> Result:
            return function()

        return asyncio.run_coroutine_threadsafe(called(), self._loop).result(TIMEOUT_S)

    def until(self, holds: Callable[[], bool]) -> bool:
        """Wait until a condition holds in the server's thread; return whether it holds within `TIMEOUT_S`."""

        async def wait() -> None:
            while not holds():
                await asyncio.sleep(0.001)

        try:
            asyncio.run_coroutine_threadsafe(wait(), self._loop).result(TIMEOUT_S)
        except TimeoutError:
            return False
        return True

    def __exit__(self, *_: object) -> None:
        for client in self._clients:
            client.close()
        asyncio.run_coroutine_threadsafe(self.server.close(), self._loop).result(TIMEOUT_S)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(TIMEOUT_S)
        self._loop.close()
