"""An instrument served from a thread of the tests, and clients of it on bare sockets."""

import asyncio
import socket
import threading
from collections.abc import Callable

from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.clock import Clock, WallClock
from a7sim.link.server.addresses import Address
from a7sim.link.server.client_session import ServerLimits
from a7sim.link.server.serving import Endpoints, Server
from a7sim.plotters import VARIANTS

ANYWHERE = Address("127.0.0.1", 0)
PATIENCE = 10.0
"""s after which a test gives up."""


class Line:
    """A client on a bare socket."""

    def __init__(self, port: int) -> None:
        self.socket = socket.create_connection(("127.0.0.1", port), timeout=PATIENCE)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._come = b""

    def send(self, data: bytes) -> None:
        self.socket.sendall(data)

    def read(self) -> str:
        """Return the next reply line, '' when the other side has hung up."""
        while b"\n" not in self._come:
            more = self.socket.recv(65536)
            if not more:
                return ""
            self._come += more
        line, self._come = self._come.split(b"\n", 1)
        return line.decode("latin-1")

    def ask(self, line: str) -> str:
        self.send(line.encode("latin-1") + b"\n")
        return self.read()

    def hung_up(self) -> bool:
        """Wait until the other side hangs up, whatever it says before."""
        try:
            while self.socket.recv(65536):
                pass
        except ConnectionError:
            pass
        return True

    def close(self) -> None:
        self.socket.close()

    def __enter__(self) -> "Line":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class Served:
    """A server in a thread, as a context; `lines` are closed with it."""

    def __init__(
        self,
        instrument: SharedInstrument | None = None,
        terms: ServerLimits | None = None,
        doors: Endpoints | None = None,
        realtime: bool = False,
    ) -> None:
        self.instrument = instrument or SharedInstrument(Autograph(VARIANTS["A7"]), poll_takes=0.0 if realtime else 0.1)
        self.clock = WallClock() if realtime else Clock()
        self._terms = terms or ServerLimits()
        self._doors = doors or Endpoints(tcp=[ANYWHERE])
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._lines: list[Line] = []

    def __enter__(self) -> "Served":
        self._thread.start()
        self.server = Server(self.instrument, self.clock, self._terms)
        self.opened = asyncio.run_coroutine_threadsafe(self.server.open(self._doors), self._loop).result(PATIENCE)
        self.port = next((each["port"] for each in self.opened if "port" in each), None)
        return self

    def line(self) -> Line:
        self._lines.append(Line(self.port))
        return self._lines[-1]

    def there(self, tell: Callable[[], object]) -> object:
        """Return what is told in the server's thread."""

        async def told() -> object:
            return tell()

        return asyncio.run_coroutine_threadsafe(told(), self._loop).result(PATIENCE)

    def until(self, holds: Callable[[], bool]) -> bool:
        """Let the server go on until something holds; return whether it came to that."""

        async def wait() -> None:
            while not holds():
                await asyncio.sleep(0.001)

        try:
            asyncio.run_coroutine_threadsafe(wait(), self._loop).result(PATIENCE)
        except TimeoutError:
            return False
        return True

    def __exit__(self, *_: object) -> None:
        for line in self._lines:
            line.close()
        asyncio.run_coroutine_threadsafe(self.server.close(), self._loop).result(PATIENCE)
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(PATIENCE)
        self._loop.close()
