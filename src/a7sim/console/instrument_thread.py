"""Thread of the instrument: all lines that the screen sends and all its queries.

A slow line does not block the screen, and a broken connection is reopened as soon as possible.
"""

import queue
import threading
import time
from collections.abc import Callable

import numpy as np
from serial import SerialException

from a7sim.console.drawing.rasterize import Greys
from a7sim.console.messages import CommandsRejected, Connected, ConnectionLost, StationMessage, ViewRequest, ViewResult
from a7sim.console.state.readouts import Readouts, parse_readouts, readouts_query
from a7sim.errors import A7SimError
from a7sim.link.client.client import Client, InstrumentError
from a7sim.plotters import VARIANTS, Variant

POLL_S = 0.5
"""Interval in s of polling a served instrument while this console is idle: another client may move it."""

RETRY_S = 1.0
"""Interval in s of reconnecting."""

SLOW_S = 0.05
"""Pictures that take longer than this, in s, are shown after the readouts."""

InstrumentRequest = Callable[[Client], None]
"""Request to the instrument."""


class ConnectionLostError(Exception):
    """The instrument does not answer."""


class InstrumentThread:
    """One client session in a thread. `tell` is called in that thread."""

    def __init__(
        self, connect: Callable[[], Client], tell: Callable[[StationMessage], None], alone: bool = True
    ) -> None:
        self._connect = connect
        self._tell = tell
        self._poll_s = None if alone else POLL_S
        self._orders: queue.SimpleQueue[InstrumentRequest | None] = queue.SimpleQueue()
        self._look = ViewRequest()
        self._shown: tuple[Readouts, ViewRequest] | None = None
        self._sight_took_s = 0.0
        self._leaving = threading.Event()
        self._at_rest = threading.Event()
        self._waiting = 0
        self._counting = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="station", daemon=True)

    def start(self) -> None:
        """Start the thread."""
        self._thread.start()

    def stop(self) -> None:
        """Stop the thread once all requests are sent."""
        self._leaving.set()
        self._orders.put(None)
        if self._thread.is_alive():
            self._thread.join(timeout=2.0)

    def submit(self, order: InstrumentRequest) -> None:
        """Submit a request; the readouts are updated afterwards."""
        with self._counting:
            self._waiting += 1
            self._at_rest.clear()
        self._orders.put(order)

    def send(self, *lines: str) -> None:
        """Send lines without queries."""

        def run(client: Client) -> None:
            for line in lines:
                client.send(line)

        self.submit(run)

    def look(self, look: ViewRequest) -> None:
        """Change the requested view of the eyepieces."""
        if look != self._look:
            self._look = look
            self.submit(lambda _: None)

    def wait_idle(self, timeout: float) -> bool:
        """Wait until all requests are sent and their results shown; return whether that happened in time."""
        return self._at_rest.wait(timeout)

    @property
    def is_idle(self) -> bool:
        """Return whether all requests are sent and their results shown."""
        return self._at_rest.is_set()

    def _run(self) -> None:
        while not self._leaving.is_set():
            try:
                with self._connect() as client:
                    self._converse(client)
            except (A7SimError, SerialException, OSError, ConnectionLostError, InstrumentError, ValueError) as broken:
                self._forget_orders()
                self._tell(ConnectionLost(" ".join(str(broken).split()) or type(broken).__name__))
                self._leaving.wait(RETRY_S)

    def _forget_orders(self) -> None:
        """Discard the requests to an instrument that did not answer: it must not move when it answers again."""
        while not self._orders.empty():
            self._orders.get()
        with self._counting:
            self._waiting = 0
            self._at_rest.set()

    def _converse(self, client: Client) -> None:
        identity = client.identity
        variant = VARIANTS.get(identity.model)
        if variant is None:
            raise ConnectionLostError(
                f"expected an A7 or A8, got {identity.model or 'an instrument that does not say what it is'}"
            )
        self._forget_orders()
        self._tell(Connected(identity, variant))
        self._shown = None
        asked = readouts_query(variant)
        self._refresh(client, variant, asked, 0)
        while not self._leaving.is_set():
            obeyed = self._obey_waiting(client)
            if not self._leaving.is_set():
                self._refresh(client, variant, asked, obeyed)

    def _obey_waiting(self, client: Client) -> int:
        """Execute the waiting requests, at least one, or none when it is time to look; return their number."""
        try:
            order = self._orders.get(timeout=self._poll_s)
        except queue.Empty:
            return 0
        obeyed = 0
        while True:
            if order is not None:
                self._obey(client, order)
                obeyed += 1
            try:
                order = self._orders.get_nowait()
            except queue.Empty:
                return obeyed

    def _obey(self, client: Client, order: InstrumentRequest) -> None:
        """Execute a request; errors of the instrument are reported, and only a missing answer ends the connection."""
        try:
            order(client)
        except InstrumentError as refused:
            if not refused.errors:
                raise
            self._tell(CommandsRejected(tuple(refused.errors)))

    def _refresh(self, client: Client, variant: Variant, asked: str, obeyed: int) -> None:
        look = self._look
        client.send(asked)
        reply = client.reply()
        if reply is None:
            raise ConnectionLostError("no answer")
        dials = parse_readouts(variant, reply)
        if obeyed or (dials, look) != self._shown:
            self._show(client, dials, look)
        if dials.errors:
            self._tell(CommandsRejected(tuple(client.errors())))
        with self._counting:
            self._waiting = max(0, self._waiting - obeyed)
            if self._waiting == 0:
                self._at_rest.set()

    def _show(self, client: Client, dials: Readouts, look: ViewRequest) -> None:
        """Report readouts and pictures together if pictures come quickly, otherwise the readouts first."""
        changed = self._shown is None or dials != self._shown[0]
        self._shown = dials, look
        if changed and self._sight_took_s > SLOW_S:
            self._tell(dials)
        began = time.monotonic()
        sight = self._sight(client, look)
        quick = self._sight_took_s <= SLOW_S
        self._sight_took_s = time.monotonic() - began
        if changed and quick:
            self._tell(dials)
        self._tell(sight)

    def _sight(self, client: Client, look: ViewRequest) -> ViewResult:
        pictures = {eye: self._picture(client, look, eye) for eye in look.eyes if look.columns and look.rows}
        seen = {eye: view_point(client, eye, look.point) for eye in (1, 2)} if look.point else {}
        return ViewResult(look, pictures, seen)

    def _picture(self, client: Client, look: ViewRequest, eye: int) -> Greys:
        block = client.block(f"EYEP{eye}:PICT? {look.columns},{look.rows},{look.magnification:g}")
        return np.frombuffer(block, dtype=np.uint8).reshape(look.rows, look.columns)


def view_point(client: Client, eye: int, point: str) -> tuple[float, float] | None:
    """Query the position of a point in an eyepiece: dx, dy in um, None outside its field of view."""
    doubled = point.replace('"', '""')
    dx, dy = client.numbers(f'EYEP{eye}? "{doubled}"')
    return (dx, dy) if max(abs(dx), abs(dy)) < 1e9 else None
