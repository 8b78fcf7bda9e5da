"""Console in a browser, served to this machine only, without any external resources.

Each open page has a console in a separate process, which ends with the page.
"""

import asyncio
import os
import shlex
import signal
import socket
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import aiohttp_jinja2
from aiohttp import web
from textual_serve.app_service import AppService
from textual_serve.server import Server, to_int

from a7sim.errors import A7SimError

LOOPBACK = "127.0.0.1"
OWN_NAMES = (LOOPBACK, "localhost")
PAGE = Path(__file__).parent / "page"
TITLE = "a7sim console"
FONT_SIZES = (6, 60)
CLOSING_S = 2.0

_POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; font-src 'self'; img-src 'self' data:; "
    "connect-src ws://{host}; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
)
"""Content security policy: own resources, and the connection to the console. xterm.js writes styles of its own."""


@dataclass
class OpenPages:
    """Open pages, and a call when there has been none for some seconds."""

    idle_s: float
    left_alone: Callable[[], None]
    pages: set[web.WebSocketResponse] = field(default_factory=set)
    _alarm: asyncio.TimerHandle | None = None

    def watch(self) -> None:
        """Start counting the time without an open page."""
        self._alarm = asyncio.get_running_loop().call_later(self.idle_s, self.left_alone)

    @contextmanager
    def page_open(self, page: web.WebSocketResponse) -> Iterator[None]:
        """Count a page as open."""
        if self._alarm is not None:
            self._alarm.cancel()
        self.pages.add(page)
        try:
            yield
        finally:
            self.pages.remove(page)
            if not self.pages:
                self.watch()


class BrowserServer(Server):
    """Server of a command that draws a console, for browsers of this machine."""

    def __init__(self, command: Sequence[str], port: int, visitors: OpenPages) -> None:
        super().__init__(shlex.join(command), LOOPBACK, port, TITLE, templates_path=PAGE)
        self._visitors = visitors

    async def application(self) -> web.Application:
        """Return the pages, each only for requests that use a name of this machine."""
        application = await self._make_app()
        application.middlewares.append(_this_machine_alone)
        return application

    async def on_startup(self, app: web.Application) -> None:
        """Print nothing: the caller prints the address."""

    async def on_shutdown(self, app: web.Application) -> None:
        """Close the open pages; their consoles end with them."""
        for page in list(self._visitors.pages):
            await page.close()

    @aiohttp_jinja2.template("app_index.html")
    async def handle_index(self, request: web.Request) -> dict[str, Any]:
        """Return the contents of the page."""
        smallest, largest = FONT_SIZES
        size = min(max(to_int(request.query.get("fontsize", ""), 16), smallest), largest)
        return {"title": TITLE, "websocket": f"ws://{request.host}/ws", "font_size": size}

    async def _process_messages(self, websocket: web.WebSocketResponse, app_service: AppService) -> None:
        with self._visitors.page_open(websocket):
            await super()._process_messages(websocket, app_service)


@web.middleware
async def _this_machine_alone(request: web.Request, handler: Callable[[web.Request], Any]) -> web.StreamResponse:
    """Reject pages of other sites, which a browser allows to access this machine."""
    origin = request.headers.get("Origin")
    if request.url.host not in OWN_NAMES or origin not in (None, f"http://{request.host}"):
        raise web.HTTPForbidden(text="expected to be asked from this machine, by a page of this server")
    response: web.StreamResponse = await handler(request)
    if not response.prepared:
        response.headers["Content-Security-Policy"] = _POLICY.format(host=request.host)
    return response


def serve(command: Sequence[str], port: int, idle_s: float, announce: Callable[[str], None]) -> bool:
    """Serve a command at a port, 0 for any free one, until a signal ends it; return whether it ended as idle.

    `told` is called with the address. It also ends when no page has been open for `idle_s` seconds.
    """
    try:
        server_socket = socket.create_server((LOOPBACK, port))
    except OSError as error:
        raise A7SimError(f"--port {port}: expected a port that is free: {os.strerror(error.errno or 0)}") from error
    with server_socket:
        return asyncio.run(_serving(command, server_socket, idle_s, announce))


async def _serving(
    command: Sequence[str], server_socket: socket.socket, idle_s: float, announce: Callable[[str], None]
) -> bool:
    loop, ended = asyncio.get_running_loop(), asyncio.Event()
    alone = False

    def left_alone() -> None:
        nonlocal alone
        alone = True
        ended.set()

    port = server_socket.getsockname()[1]
    visitors = OpenPages(idle_s, left_alone)
    runner = web.AppRunner(
        await BrowserServer(command, port, visitors).application(), access_log=None, shutdown_timeout=CLOSING_S
    )
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, ended.set)
    await runner.setup()
    try:
        await web.SockSite(runner, server_socket).start()
        visitors.watch()
        announce(f"http://{LOOPBACK}:{port}/")
        await ended.wait()
    finally:
        await runner.cleanup()
    return alone
