"""In-process link: a pyserial port of an instrument in the same process."""

import threading
from typing import Any

from serial import PortNotOpenError, SerialBase, SerialException, to_bytes

from a7sim.instrument.language import MAX_BUFFERED_BYTES, Engine, SharedInstrument
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle


class InProcessSerial(SerialBase):  # type: ignore[misc] # pyserial is untyped
    """Pyserial port whose other end is an engine of a shared instrument.

    Written bytes are executed before `write` returns; replies wait to be read. Waiting for movement advances the
    simulated clock, and nothing blocks. Line settings (baud rate, parity ...) are accepted without effect. Several
    ports may share one instrument, each as the `client` of its name.
    """

    is_open: bool

    def __init__(
        self,
        port: str | None = None,
        *args: Any,
        instrument: SharedInstrument | None = None,
        clock: Clock | None = None,
        client: str | None = None,
        **kwargs: Any,
    ) -> None:
        self.clock = clock or Clock()
        self._instrument = instrument
        self._client = client
        self._engine: Engine | None = None
        self._unread, self._read_up_to = b"", 0
        self._alone = threading.RLock()
        self._arrived = threading.Condition(self._alone)
        self._cancelled = False
        super().__init__("in process" if port is None and instrument is not None else port, *args, **kwargs)

    def _connect(self) -> SharedInstrument:
        if self._instrument is None:
            raise SerialException("expected an instrument to connect the port to, got none")
        return self._instrument

    def open(self) -> None:
        """Open a session with the instrument. Raises SerialException if it cannot, or is open."""
        if self.port is None:
            raise SerialException("expected a port to open, got none")
        if self.is_open:
            raise SerialException(f"expected a closed port, got {self.port}, which is open")
        self._engine = self._connect().open(self._client, time=self.clock.now)
        self._unread, self._read_up_to = b"", 0
        self._cancelled = False
        self.is_open = True

    def close(self) -> None:
        """Close the session; its lock is released."""
        if self.is_open and self._engine is not None:
            self._connect().close(self._engine.client, self.clock.now)
        self._engine = None
        self.is_open = False
        self.cancel_read()

    def _opened(self) -> Engine:
        if self._engine is None:
            raise PortNotOpenError
        return self._engine

    def write(self, data: Any) -> int:
        """Send bytes and return their number."""
        received = to_bytes(data)
        with self._alone:
            engine = self._opened()
            replies = b""
            for start in range(0, len(received), MAX_BUFFERED_BYTES):
                replies += feed_until_idle(engine, received[start : start + MAX_BUFFERED_BYTES], self.clock)
            if replies:
                self._unread, self._read_up_to = self._unread[self._read_up_to :] + replies, 0
                self._arrived.notify_all()
        return len(received)

    def read(self, size: int = 1) -> bytes:
        """Return `size` bytes, or those available at the timeout."""
        with self._alone:
            start = self._read_up_to
            if size <= len(self._unread) - start and self._engine is not None:
                self._read_up_to = start + size
                return self._unread[start : start + size]
        return self._take(lambda: size if self._left() >= size else None, size)

    def read_until(self, expected: bytes = b"\n", size: int | None = None) -> bytes:
        """Return the bytes up to and including `expected`, at most `size`, or those available at the timeout."""

        def length() -> int | None:
            found = self._unread.find(expected, self._read_up_to)
            end = found + len(expected) - self._read_up_to if found >= 0 else None
            if size is not None and self._left() >= size:
                return min(size, end) if end is not None else size
            return end

        return self._take(length, size)

    def readline(self, size: int | None = -1, /) -> bytes:
        """Return a line with its end, or the bytes available at the timeout."""
        with self._alone:
            start = self._read_up_to
            end = self._unread.find(b"\n", start) + 1
            if end and size == -1 and self._engine is not None:
                self._read_up_to = end
                return self._unread[start:end]
        return self.read_until(b"\n", None if size is None or size < 0 else size)

    def _take(self, length: Any, most: int | None) -> bytes:
        with self._arrived:
            self._opened()
            self._arrived.wait_for(lambda: length() is not None or self._cancelled, self._timeout)
            end = length()
            if end is None:
                end = self._left() if most is None else min(most, self._left())
            self._cancelled = False
            start, self._read_up_to = self._read_up_to, self._read_up_to + end
            return self._unread[start : self._read_up_to]

    def _left(self) -> int:
        return len(self._unread) - self._read_up_to

    @property
    def in_waiting(self) -> int:
        """Number of bytes that can be read at once."""
        self._opened()
        return self._left()

    @property
    def out_waiting(self) -> int:
        """Number of bytes written and not yet executed: always zero."""
        self._opened()
        return 0

    def flush(self) -> None:
        """Wait until all is executed, which it is."""
        self._opened()

    def reset_input_buffer(self) -> None:
        """Discard replies that were not read."""
        with self._arrived:
            self._opened()
            self._read_up_to = len(self._unread)

    def reset_output_buffer(self) -> None:
        """Discard bytes not yet sent: there are none."""
        self._opened()

    def cancel_read(self) -> None:
        """Make a waiting read return the available bytes."""
        with self._arrived:
            self._cancelled = True
            self._arrived.notify_all()

    def cancel_write(self) -> None:
        """Do nothing: a write never waits."""

    def _reconfigure_port(self) -> None: ...
    def _update_break_state(self) -> None: ...
    def _update_rts_state(self) -> None: ...
    def _update_dtr_state(self) -> None: ...

    @property
    def cts(self) -> bool:
        """Clear to send: while open."""
        return bool(self.is_open)

    @property
    def dsr(self) -> bool:
        """Data set ready: while open."""
        return bool(self.is_open)

    @property
    def ri(self) -> bool:
        """Ring indicator: never."""
        return False

    @property
    def cd(self) -> bool:
        """Carrier detect: while open."""
        return bool(self.is_open)
