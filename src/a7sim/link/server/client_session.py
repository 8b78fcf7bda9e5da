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
"""Bytes of input, some dozens of lines, executed before commands of other clients."""

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
        self._write_blocked = self._ended = False
        faults = terms.faults
        self._fault_injector = FaultInjector(faults, _generator(terms.fault_seed, number)) if faults else None
        delay = faults.delay if faults else 0.0
        self._incoming = BaudLimiter(loop, self._receive, terms.baud) if terms.baud else None
        self._outgoing = BaudLimiter(loop, self._deliver, terms.baud, delay) if terms.baud or delay else None
        self._direct = self._incoming is None and self._outgoing is None and self._fault_injector is None
        """Whether bytes pass directly to and from the engine, because nothing delays them."""
        self._next: asyncio.Handle | None = None
        self._write_timer: asyncio.Handle | None = None
        self._last_input_at = loop.time()
        self._idle_timer = loop.call_later(terms.idle_timeout, self._check_idle)

    # --- events of the transport ----------------------------------------------------------------------

    def data_received(self, data: bytes) -> None:
        """Process bytes from the client."""
        self._last_input_at = self._loop.time()
        if self._direct and self._reading and len(data) <= CHUNK_BYTES:
            replies = self._engine.feed_with_replies(data, self._clock.now)
            if replies:
                self._wire.write(b"".join(replies))
            if self._engine.waits_until is not None:
                self._schedule_step()
        elif self._incoming is not None:
            self._incoming.put(data)
            self._continue_reading()
        else:
            self._receive(data)

    def pause_writing(self) -> None:
        """Stop executing: the client does not read its replies. It is disconnected if that continues."""
        self._write_blocked = True
        self._pause()
        self._write_timer = self._loop.call_later(self._terms.write_timeout, self._wire.abort)

    def resume_writing(self) -> None:
        """Continue: the client has read."""
        self._write_blocked = False
        if self._write_timer is not None:
            self._write_timer.cancel()
        self._schedule_step()

    def eof_received(self) -> None:
        """Disconnect as soon as all is answered: the client sends nothing more."""
        self._ended = True
        self._schedule_step()

    def connection_lost(self) -> None:
        """Remove the client: it has disconnected, and its lock is released."""
        self._open = False
        self._instrument.close(self._engine.client, self._clock.now)
        for timer in (self._next, self._write_timer, self._idle_timer):
            if timer is not None:
                timer.cancel()
        for pace in (self._incoming, self._outgoing):
            if pace is not None:
                pace.clear()

    # --- next steps ------------------------------------------------------------------------------------

    def _receive(self, data: bytes) -> None:
        if len(data) <= CHUNK_BYTES and not self._backlog and self._next is None and not self._must_pause():
            self._feed(data)
            if self._engine.waits_until is None and self._reading and not self._ended:
                return
        else:
            self._backlog = memoryview(bytes(self._backlog) + data) if self._backlog else memoryview(data)
        self._schedule_step()

    def _must_pause(self) -> bool:
        in_transit = self._outgoing is not None and self._outgoing.size > MAX_PACED_BYTES
        return self._write_blocked or in_transit or self._engine.waits_until is not None

    def _feed(self, data: bytes) -> None:
        for reply in self._engine.feed_with_replies(data, self._clock.now):
            self._send(reply)

    def _schedule_step(self) -> None:
        """Schedule the next step: a wait that ends, remaining input, or reading again."""
        if not self._open or self._next is not None:
            return
        waits_until = self._engine.waits_until
        if waits_until is not None and not self._write_blocked:
            self._pause()
            if self._clock.advance_to(waits_until):
                self._next = self._loop.call_soon(self._step)
            else:
                self._next = self._loop.call_later(waits_until - self._clock.now, self._step)
        elif self._must_pause():
            self._pause()
        elif self._backlog:
            self._pause()
            self._next = self._loop.call_soon(self._step)
        else:
            self._continue_reading()

    def _step(self) -> None:
        self._next = None
        if self._engine.waits_until is not None:
            self._feed(b"")
        elif not self._must_pause():
            piece, self._backlog = bytes(self._backlog[:CHUNK_BYTES]), self._backlog[CHUNK_BYTES:]
            self._feed(piece)
        self._schedule_step()

    def _continue_reading(self) -> None:
        coming = self._incoming.size if self._incoming is not None else 0
        going = self._outgoing.size if self._outgoing is not None else 0
        if coming > MAX_PACED_BYTES:
            self._pause()
        elif self._ended and not coming and not going and not self._backlog:
            self._wire.close()
        elif not self._reading and not self._backlog and not self._must_pause():
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
        if self._fault_injector is not None:
            try:
                reply = self._fault_injector.apply(reply)
            except ConnectionDropped:
                self._wire.abort()
                return
        if self._outgoing is not None:
            self._outgoing.put(reply)
        else:
            self._wire.write(reply)

    def _deliver(self, data: bytes) -> None:
        self._wire.write(data)
        self._schedule_step()

    # --- idle timeout ---------------------------------------------------------------------------------

    def _check_idle(self) -> None:
        idle = self._terms.idle_timeout
        left = self._last_input_at + idle - self._loop.time()
        if left > 0.0:
            self._idle_timer = self._loop.call_later(left, self._check_idle)
        else:
            text = format_entry(ErrorNumber.TIME_OUT_ERROR, f"expected something to do within {idle:g} s")
            self._wire.close(f"{text}\n".encode("ascii"))


def _generator(seed: int, number: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
