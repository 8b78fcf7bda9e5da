"""Client of an instrument over any pyserial port."""

import csv
from collections.abc import Iterator
from contextlib import contextmanager
from types import TracebackType
from typing import Any, NamedTuple, Protocol, Self

from a7sim.link.client.ports import TIMEOUT_S, open_port
from a7sim.link.client.replies import MalformedReplyError, Part, parse_reply


class Port(Protocol):
    """Part of a pyserial port that a client uses."""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""

    def readline(self, size: int | None = -1, /) -> bytes:
        """Return a line, or the bytes received before the timeout."""


class InstrumentError(Exception):
    """Errors reported by the instrument: `errors` are the entries of its queue."""

    def __init__(self, line: str, errors: list[str]) -> None:
        super().__init__(f"{line}: {'; '.join(errors) or 'no answer'}")
        self.line = line
        self.errors = errors


class Identity(NamedTuple):
    """Identification of an instrument."""

    maker: str
    model: str
    serial: str
    version: str


class Client:
    """Client that exchanges lines of text with an instrument.

    >>> from a7sim import Client
    >>> with Client.open("a7sim://akwanga") as client:
    ...     client.send("BASE:BX 194.99")
    ...     client.numbers("BASE:BX?;:PROJ1:KAPP?")
    [194.99, 0.0]
    """

    def __init__(self, port: Port) -> None:
        self._port = port

    @classmethod
    def open(cls, url: str, timeout: float = TIMEOUT_S, token: str | None = None) -> Self:
        """Return a client of the instrument at a URL, logged in if a token is given.

        URLs are a7sim://SCENARIO?seed=N, tcp://HOST:PORT, rfc2217://HOST:PORT, or the path of a device or pty.
        `timeout` is the wait for a reply in s. Raises A7SimError if the port cannot be opened.
        """
        client = cls(open_port(url, timeout))
        if token is not None:
            client.log_in(token)
        return client

    def close(self) -> None:
        """Disconnect; a lock of this client is released."""
        close: Any = getattr(self._port, "close", None)
        if close is not None:
            close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def log_in(self, token: str) -> None:
        """Log in with the token of a server that listens beyond its own machine."""
        doubled = token.replace('"', '""')
        self.send(f'SYST:LOG "{doubled}"')

    @property
    def identity(self) -> Identity:
        """Identification of the instrument."""
        return Identity(*self.fields("*IDN?")[:4])

    @contextmanager
    def lock(self) -> Iterator[Self]:
        """Hold the lock, so that only this client moves parts. Raises InstrumentError if another client holds it."""
        if self.ask("SYST:LOCK:REQ?") != "1":
            raise InstrumentError("SYST:LOCK:REQ?", ["another client holds the lock"])
        try:
            yield self
        finally:
            self.send("SYST:LOCK:REL")

    def wait(self) -> None:
        """Return when all movement is done. Raises InstrumentError if that exceeds the port's timeout."""
        self.ask("*OPC?")

    def send(self, line: str) -> None:
        """Send a line without a query."""
        self._port.write(line.encode() + b"\n")

    def ask(self, line: str) -> str:
        """Send a line and return its reply. Raises InstrumentError if none arrives."""
        self.send(line)
        reply = self._port.readline()
        if not reply.endswith(b"\n"):
            raise InstrumentError(line, self.errors())
        return reply[:-1].decode("ascii")

    def fields(self, line: str) -> list[str]:
        """Send a line and return the values of its reply, texts without quotes."""
        return next(csv.reader([self.ask(line)]))

    def numbers(self, line: str) -> list[float]:
        """Send a line and return all numbers of its reply; 9.91E37 marks a quantity that is not visible."""
        return [float(each) for each in self.ask(line).replace(";", ",").split(",")]

    def block(self, line: str) -> bytes:
        """Send a line and return the bytes of its reply, an IEEE 488.2 block of definite length.

        Raises InstrumentError if none arrives.
        """
        self.send(line)
        parts = self.reply()
        if parts is None or not isinstance(parts[0], bytes):
            raise InstrumentError(line, self.errors())
        return parts[0]

    def reply(self) -> tuple[Part, ...] | None:
        """Return the next reply, a text or the bytes of a block for each query; None if none arrives in time."""
        received = bytearray()
        while True:
            more = self._port.readline()
            received += more
            try:
                taken = parse_reply(received)
            except MalformedReplyError:
                return None
            if taken is not None:
                return taken.parts
            if not more:
                return None

    def errors(self) -> list[str]:
        """Read and remove all entries of the instrument's error queue, oldest first."""
        entries: list[str] = []
        while True:
            self.send("SYST:ERR?")
            reply = self._port.readline().decode("ascii").rstrip("\n")
            if not reply or reply.startswith("0,"):
                return entries
            entries.append(reply)

    def check(self, about: str) -> None:
        """Raise InstrumentError if the instrument has reported errors since the last check."""
        found = self.errors()
        if found:
            raise InstrumentError(about, found)
