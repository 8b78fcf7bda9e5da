"""`serial.serial_for_url("tcp://127.0.0.1:5025")`: faster than pyserial's `socket://`.

Small lines are sent at once (no Nagle) and a reply is read as a whole, not byte by byte. pyserial finds this module by
its name, as it finds `a7sim://`.
"""

import contextlib
import select
import socket
from typing import Any

from serial import PortNotOpenError, SerialException
from serial.serialutil import Timeout
from serial.urlhandler import protocol_socket

_AT_ONCE = 65536


class Serial(protocol_socket.Serial):  # type: ignore[misc] # pyserial is untyped
    """Pyserial port over TCP. Raises SerialException if the connection is refused."""

    is_open: bool

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        self._received = bytearray()
        super().__init__(*args, **kwargs)

    def from_url(self, url: str) -> tuple[str, int]:
        """Return host and port. Raises SerialException for a bad URL."""
        host, port = super().from_url("socket" + url[url.index(":") :])
        return host, port

    def open(self) -> None:
        """Connect. Raises SerialException."""
        self._received.clear()
        super().open()
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def close(self) -> None:
        """Disconnect."""
        if self.is_open:
            self.is_open = False
            with contextlib.suppress(OSError):
                self._socket.shutdown(socket.SHUT_RDWR)
            self._socket.close()

    def read(self, size: int = 1) -> bytes:
        """Return `size` bytes, or those available at the timeout."""
        self._fill(lambda: len(self._received) >= size)
        return self._take(size)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Return the bytes up to and including `expected`, at most `size`, or those available at the timeout."""
        most = len(self._received) + _AT_ONCE**2 if size is None else size
        self._fill(lambda: expected in self._received or len(self._received) >= most)
        found = self._received.find(expected)
        return self._take(most if found < 0 else min(most, found + len(expected)))

    def readline(self, size: int | None = -1, /) -> bytes:
        """Return a line with its end, or the bytes available at the timeout."""
        return self.read_until(b"\n", None if size is None or size < 0 else size)

    def _take(self, size: int) -> bytes:
        taken = bytes(self._received[:size])
        del self._received[:size]
        return taken

    def _fill(self, enough: Any) -> None:
        if not self.is_open:
            raise PortNotOpenError
        timeout = Timeout(self._timeout)
        while not enough():
            ready, _, _ = select.select([self._socket], [], [], timeout.time_left())
            if not ready:
                return
            self._receive()

    def _receive(self) -> None:
        try:
            received = self._socket.recv(_AT_ONCE)
        except BlockingIOError:
            return
        except OSError as error:
            raise SerialException(f"read failed: {error.strerror}") from error
        if not received:
            raise SerialException("the other end hung up")
        self._received += received

    @property
    def in_waiting(self) -> int:
        """Minimum number of bytes that can be read at once."""
        return len(self._received) + int(super().in_waiting)

    def reset_input_buffer(self) -> None:
        """Discard replies that were not read."""
        self._received.clear()
        super().reset_input_buffer()
