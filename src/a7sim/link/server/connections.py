"""TCP transports, raw or with telnet and RFC 2217: asyncio protocols that call the client session directly."""

import asyncio
import socket
from contextlib import suppress
from typing import Protocol, cast

from a7sim.link.server.client_session import ClientSession, Transport
from a7sim.link.server.telnet import Telnet

MAX_READ = 16 * 1024
"""Bytes read from a socket at once."""

MAX_UNREAD = 64 * 1024
"""Bytes of unread replies above which a client's input is not executed."""

QUICK_ACKNOWLEDGEMENT: int | None = getattr(socket, "TCP_QUICKACK", None)
"""An option of Linux."""

FAREWELL = 1.0
"""s that a rejected client has to receive the reason."""


class Host(Protocol):
    """Factory of client sessions for transports."""

    def accept(self, wire: Transport, serial: bool) -> ClientSession | bytes:
        """Return a session, or the reason for a rejection, as a line."""

    def release(self, wire: Transport) -> None:
        """Record that a transport is closed."""


class TcpConnection(asyncio.BufferedProtocol):
    """TCP connection. All share one buffer, because input is consumed at once."""

    serial = False

    def __init__(self, host: Host, buffer: memoryview) -> None:
        self._host = host
        self._buffer = buffer
        self._transport: asyncio.Transport
        self._session: ClientSession | None = None
        self._answered = False

    # --- events of asyncio ----------------------------------------------------------------------------

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start a session, or reject the client."""
        self._transport = cast(asyncio.Transport, transport)
        self._socket = self._transport.get_extra_info("socket")
        self._transport.set_write_buffer_limits(high=MAX_UNREAD)
        accepted = self._host.accept(self, self.serial)
        if isinstance(accepted, ClientSession):
            self._session = accepted
        else:
            self._reject(accepted)

    def _reject(self, reason: bytes) -> None:
        self.write(reason)
        with suppress(OSError):
            self._transport.write_eof()
        asyncio.get_running_loop().call_later(FAREWELL, self._transport.abort)

    def get_buffer(self, sizehint: int) -> memoryview:
        """Return the buffer for the next read."""
        return self._buffer

    def buffer_updated(self, nbytes: int) -> None:
        """Pass the input to the session."""
        self._take(self._buffer[:nbytes].tobytes())

    def _take(self, data: bytes) -> None:
        if self._session is not None:
            self._answered = False
            self._session.data_received(data)
            if not self._answered:
                self._acknowledge()

    def _acknowledge(self) -> None:
        """Acknowledge a received command at once, because no reply does.

        Otherwise a client that sends small segments by Nagle's algorithm, as pyserial's does, waits 40 ms before the
        next one.
        """
        if QUICK_ACKNOWLEDGEMENT is not None and not self._transport.is_closing():
            self._socket.setsockopt(socket.IPPROTO_TCP, QUICK_ACKNOWLEDGEMENT, 1)

    def eof_received(self) -> bool:
        """Keep the connection until all is answered."""
        if self._session is None:
            return False
        self._session.eof_received()
        return True

    def connection_lost(self, exc: Exception | None) -> None:
        """End the session."""
        if self._session is not None:
            self._session.connection_lost()
            self._session = None
        self._host.release(self)

    def pause_writing(self) -> None:
        """Report that the client does not read."""
        if self._session is not None:
            self._session.pause_writing()

    def resume_writing(self) -> None:
        """Report that the client reads again."""
        if self._session is not None:
            self._session.resume_writing()

    # --- requests of the session ----------------------------------------------------------------------

    def write(self, data: bytes) -> None:
        """Send bytes, unless the connection is closed."""
        if not self._transport.is_closing():
            self._answered = True
            self._transport.write(data)

    def pause_reading(self) -> None:
        """Stop receiving."""
        self._transport.pause_reading()

    def resume_reading(self) -> None:
        """Continue receiving."""
        self._transport.resume_reading()

    def close(self, farewell: bytes = b"") -> None:
        """Disconnect when all is sent, including the farewell."""
        if farewell:
            self.write(farewell)
        self._transport.close()

    def abort(self) -> None:
        """Disconnect at once."""
        self._transport.abort()


class TelnetConnection(TcpConnection):
    """TCP connection that emulates a serial port (RFC 2217)."""

    serial = True

    def __init__(self, host: Host, buffer: memoryview) -> None:
        super().__init__(host, buffer)
        self._telnet = Telnet()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Start a session, and negotiate."""
        cast(asyncio.Transport, transport).write(self._telnet.greeting())
        super().connection_made(transport)

    def buffer_updated(self, nbytes: int) -> None:
        """Pass the data to the session, and answer the commands."""
        data, answer = self._telnet.received(self._buffer[:nbytes].tobytes())
        if answer:
            super().write(answer)
        if data:
            self._take(data)

    def write(self, data: bytes) -> None:
        """Send bytes escaped for telnet."""
        super().write(self._telnet.escape(data))
