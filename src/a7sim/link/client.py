"""Talking to an instrument over any pyserial port."""

import csv
from typing import Protocol


class Port(Protocol):
    """The part of a pyserial port that a conversation needs."""

    def write(self, data: bytes, /) -> int | None:
        """Send bytes."""

    def readline(self, size: int | None = -1, /) -> bytes:
        """Return a line, or what came before the timeout."""


class InstrumentRefused(Exception):
    """The instrument reported errors: `errors` are the entries of its queue."""

    def __init__(self, line: str, errors: list[str]) -> None:
        super().__init__(f"{line}: {'; '.join(errors) or 'no answer'}")
        self.line = line
        self.errors = errors


class Client:
    """A conversation in lines of text.

    >>> import serial, a7sim
    >>> client = Client(serial.serial_for_url("a7sim://akwanga", timeout=1))
    >>> client.send("BASE:BX 194.99")
    >>> client.numbers("BASE:BX?;:PROJ1:KAPP?")
    [194.99, 0.0]
    """

    def __init__(self, port: Port) -> None:
        self._port = port

    def send(self, line: str) -> None:
        """Send a line that asks nothing."""
        self._port.write(line.encode("ascii") + b"\n")

    def ask(self, line: str) -> str:
        """Send a line and return its reply. Raises InstrumentRefused when none comes."""
        self.send(line)
        reply = self._port.readline()
        if not reply.endswith(b"\n"):
            raise InstrumentRefused(line, self.errors())
        return reply[:-1].decode("ascii")

    def fields(self, line: str) -> list[str]:
        """Send a line and return the values of its reply, texts without their quotes."""
        return next(csv.reader([self.ask(line)]))

    def numbers(self, line: str) -> list[float]:
        """Send a line and return all numbers of its reply; 9.91E37 stands for what cannot be seen."""
        return [float(each) for each in self.ask(line).replace(";", ",").split(",")]

    def block(self, line: str) -> bytes:
        """Send a line and return the bytes of its reply, an IEEE 488.2 block of definite length.

        Raises InstrumentRefused when none comes.
        """
        self.send(line)
        reply = self._port.readline()
        if reply[:1] != b"#":
            raise InstrumentRefused(line, self.errors())
        while len(reply) < 2 + int(reply[1:2]):
            reply += self._port.readline()
        begins = 2 + int(reply[1:2])
        ends = begins + int(reply[2:begins])
        while len(reply) <= ends:
            more = self._port.readline()
            if not more:
                raise InstrumentRefused(line, self.errors())
            reply += more
        return reply[begins:ends]

    def errors(self) -> list[str]:
        """Take all entries off the instrument's error queue, oldest first."""
        entries: list[str] = []
        while True:
            self.send("SYST:ERR?")
            reply = self._port.readline().decode("ascii").rstrip("\n")
            if not reply or reply.startswith("0,"):
                return entries
            entries.append(reply)

    def check(self, about: str) -> None:
        """Raise InstrumentRefused if the instrument has reported anything since the last look."""
        found = self.errors()
        if found:
            raise InstrumentRefused(about, found)
