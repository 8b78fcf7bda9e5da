"""Session of one client between its transport and the engine, with limits that keep clients fair."""

import asyncio
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from a7sim.instrument.language import ErrorNumber, SharedInstrument, format_entry
from a7sim.link.clock import Clock, WallClock
from a7sim.link.server.faults import ConnectionDropped, FaultInjector, FaultRates
from a7sim.link.server.pacing import BaudLimiter

CHUNK_BYTES = 512
"""Bytes of input, some dozens of lines, executed before other clients have their turn."""

MAX_PACED_BYTES = 4096
"""Bytes; more input is not read, and with more replies in transit nothing is executed."""


@dataclass(frozen=True, slots=True)
class ServerLimits:
    """Limits of a client."""

    baud: int | None = None
    """Bits/s of each line, None without pacing."""
    faults: FaultRates | None = None
    fault_seed: int = 0
    idle_timeout: float = 3600.0
    """s without a byte after which a client is disconnected."""
    write_timeout: float = 10.0
    """s that replies wait for a client that does not read them, before it is disconnected."""
    max_clients: int = 64


class Transport(Protocol):
    """Transport of the bytes of one client, which calls the session with input and events."""

    def write(self, data: bytes) -> None:
        """Send bytes, now or as soon as possible."""

    def pause_reading(self) -> None:
        """Stop receiving."""

    def resume_reading(self) -> None:
        """Continue receiving."""

    def close(self, farewell: bytes = b"") -> None:
        """Disconnect when all written bytes, and a farewell if the client can receive it, are sent."""

    def abort(self) -> None:
        """Disconnect at once."""


class ClientSession:
    """Session of a client on its transport."""

    def __init__(
        self,
        instrument: SharedInstrument,
        clock: Clock | WallClock,
        terms: ServerLimits,
        wire: Transport,
        number: int,
        serial: bool,
    ) -> None:
        loop = self._loop = asyncio.get_running_loop()
        self._instrument = instrument
        self._clock = clock
        self._terms = terms
        self._wire = wire
        self._engine = instrument.open(cr_ends_line=serial, time=clock.now)
        self._backlog = memoryview(b"")
        self._reading = self._open = True
        self._clogged = self._ended = False
        faults = terms.faults
        self._noise = FaultInjector(faults, _generator(terms.fault_seed, number)) if faults else None
        delay = faults.delay if faults else 0.0
        self._incoming = BaudLimiter(loop, self._arrived, terms.baud) if terms.baud else None
        self._outgoing = BaudLimiter(loop, self._carried, terms.baud, delay) if terms.baud or delay else None
        self._plain = self._incoming is None and self._outgoing is None and self._noise is None
        """Whether bytes pass directly to and from the engine, because nothing delays them."""
        self._next: asyncio.Handle | None = None
        self._impatient: asyncio.Handle | None = None
        self._heard_at = loop.time()
        self._sleeper = loop.call_later(terms.idle_timeout, self._asleep)

    # --- what the wire tells --------------------------------------------------------------------------

    def data_received(self, data: bytes) -> None:
        """Process bytes from the client."""
        self._heard_at = self._loop.time()
        if self._plain and self._reading and len(data) <= CHUNK_BYTES:
            replies = self._engine.feed_with_replies(data, self._clock.now)
            if replies:
                self._wire.write(b"".join(replies))
            if self._engine.waits_until is not None:
                self._go_on_soon()
        elif self._incoming is not None:
            self._incoming.put(data)
            self._go_on_reading()
        else:
            self._arrived(data)

    def pause_writing(self) -> None:
        """Stop executing: the client does not read its replies. It is disconnected if that continues."""
        self._clogged = True
        self._pause()
        self._impatient = self._loop.call_later(self._terms.write_timeout, self._wire.abort)

    def resume_writing(self) -> None:
        """Continue: the client has read."""
        self._clogged = False
        if self._impatient is not None:
            self._impatient.cancel()
        self._go_on_soon()

    def eof_received(self) -> None:
        """Disconnect as soon as all is answered: the client sends nothing more."""
        self._ended = True
        self._go_on_soon()

    def connection_lost(self) -> None:
        """Remove the client: it has disconnected, and its lock is released."""
        self._open = False
        self._instrument.close(self._engine.client, self._clock.now)
        for timer in (self._next, self._impatient, self._sleeper):
            if timer is not None:
                timer.cancel()
        for pace in (self._incoming, self._outgoing):
            if pace is not None:
                pace.clear()

    # --- next steps ------------------------------------------------------------------------------------

    def _arrived(self, data: bytes) -> None:
        if len(data) <= CHUNK_BYTES and not self._backlog and self._next is None and not self._holds_back():
            self._feed(data)
            if self._engine.waits_until is None and self._reading and not self._ended:
                return
        else:
            self._backlog = memoryview(bytes(self._backlog) + data) if self._backlog else memoryview(data)
        self._go_on_soon()

    def _holds_back(self) -> bool:
        on_the_way = self._outgoing is not None and self._outgoing.size > MAX_PACED_BYTES
        return self._clogged or on_the_way or self._engine.waits_until is not None

    def _feed(self, data: bytes) -> None:
        for reply in self._engine.feed_with_replies(data, self._clock.now):
            self._send(reply)

    def _go_on_soon(self) -> None:
        """Schedule the next step: a wait that ends, remaining input, or reading again."""
        if not self._open or self._next is not None:
            return
        waits_until = self._engine.waits_until
        if waits_until is not None and not self._clogged:
            self._pause()
            if self._clock.advance_to(waits_until):
                self._next = self._loop.call_soon(self._go_on)
            else:
                self._next = self._loop.call_later(waits_until - self._clock.now, self._go_on)
        elif self._holds_back():
            self._pause()
        elif self._backlog:
            self._pause()
            self._next = self._loop.call_soon(self._go_on)
        else:
            self._go_on_reading()

    def _go_on(self) -> None:
        self._next = None
        if self._engine.waits_until is not None:
            self._feed(b"")
        elif not self._holds_back():
            piece, self._backlog = bytes(self._backlog[:CHUNK_BYTES]), self._backlog[CHUNK_BYTES:]
            self._feed(piece)
        self._go_on_soon()

    def _go_on_reading(self) -> None:
        coming = self._incoming.size if self._incoming is not None else 0
        going = self._outgoing.size if self._outgoing is not None else 0
        if coming > MAX_PACED_BYTES:
            self._pause()
        elif self._ended and not coming and not going and not self._backlog:
            self._wire.close()
        elif not self._reading and not self._backlog and not self._holds_back():
            self._reading = True
            self._wire.resume_reading()

    def _pause(self) -> None:
        if self._reading:
            self._reading = False
            self._wire.pause_reading()

    # --- replies --------------------------------------------------------------------------------------

    def _send(self, reply: bytes) -> None:
        if not self._open:
            return
        if self._noise is not None:
            try:
                reply = self._noise.apply(reply)
            except ConnectionDropped:
                self._wire.abort()
                return
        if self._outgoing is not None:
            self._outgoing.put(reply)
        else:
            self._wire.write(reply)

    def _carried(self, data: bytes) -> None:
        self._wire.write(data)
        self._go_on_soon()

    # --- who says nothing -----------------------------------------------------------------------------

    def _asleep(self) -> None:
        idle = self._terms.idle_timeout
        left = self._heard_at + idle - self._loop.time()
        if left > 0.0:
            self._sleeper = self._loop.call_later(left, self._asleep)
        else:
            text = format_entry(ErrorNumber.TIME_OUT_ERROR, f"expected something to do within {idle:g} s")
            self._wire.close(f"{text}\n".encode("ascii"))


def _generator(seed: int, number: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
