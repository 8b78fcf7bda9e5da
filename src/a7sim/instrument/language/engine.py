"""The language engine of one client: bytes in, bytes out; no I/O, no clock of its own."""

import re
import zlib
from typing import TYPE_CHECKING

from a7sim.instrument.language.commands import COMMANDS
from a7sim.instrument.language.errors import ErrorNumber, LanguageError
from a7sim.instrument.language.status import Status
from a7sim.instrument.language.syntax import unit_of, units_of
from a7sim.instrument.refusals import OutOfRange, Refusal, SettingsConflict, UnknownName

if TYPE_CHECKING:
    from a7sim.instrument.language.desk import Desk

LONGEST_LINE = 4096
"""Bytes, its end not counted."""

_LONGEST_KEPT = LONGEST_LINE + 2
"""A line, the CR of its end, and one byte that shows a line to be too long."""

_NUMBER_OF = {
    OutOfRange: ErrorNumber.DATA_OUT_OF_RANGE,
    SettingsConflict: ErrorNumber.SETTINGS_CONFLICT,
    UnknownName: ErrorNumber.ILLEGAL_PARAMETER_VALUE,
}


class Engine:
    """A client's conversation with the instrument."""

    def __init__(self, desk: "Desk", client: str, cr_ends_line: bool = True) -> None:
        self.desk = desk
        self.client = client
        self.status: Status = Status()
        self._ends = re.compile(rb"[\r\n]" if cr_ends_line else rb"\n")
        self._pending = bytearray()
        self._level: tuple[tuple[str, int | None], ...] = ()

    def feed(self, received: bytes, time: float) -> bytes:
        """Take bytes that arrived at a simulated time in s; return the bytes of the replies."""
        replies = bytearray()
        start = 0
        for end in self._ends.finditer(received):
            self._keep(received[start : end.start()])
            replies += self._line_ended(time)
            start = end.end()
        self._keep(received[start:])
        return bytes(replies)

    def _keep(self, part: bytes) -> None:
        self._pending += part[: _LONGEST_KEPT - len(self._pending)]

    def _line_ended(self, time: float) -> bytes:
        line = bytes(self._pending).removesuffix(b"\r")
        self._pending.clear()
        if len(line) > LONGEST_LINE:
            self.desk.heard(time, self.client, ">", f"(a line of more than {LONGEST_LINE} bytes, dropped)")
            self.status.report(ErrorNumber.INPUT_BUFFER_OVERRUN, f"expected at most {LONGEST_LINE} bytes a line")
            return b""
        text = line.decode("latin-1")
        if not text.strip(" \t"):
            return b""
        self.desk.heard(time, self.client, ">", text)
        replies = self._obey(text)
        if not replies:
            return b""
        self.desk.heard(time, self.client, "<", ";".join(map(_as_text, replies)))
        return b";".join(map(_as_bytes, replies)) + b"\n"

    def _obey(self, line: str) -> list[str | bytes]:
        self._level = ()
        replies = []
        for text in units_of(line):
            try:
                reply = self._obey_unit(text)
            except LanguageError as error:
                self.status.report(error.number, error.detail)
            except Refusal as refusal:
                number = _NUMBER_OF.get(type(refusal), ErrorNumber.EXECUTION_ERROR)
                self.status.report(number, f"{text[:60]}: {refusal}")
            else:
                if reply is not None:
                    replies.append(reply)
        return replies

    def _obey_unit(self, text: str) -> str | bytes | None:
        unit = unit_of(text)
        if unit.common:
            command, suffix = COMMANDS.find(unit.mnemonics, unit.query)
        else:
            path = unit.mnemonics if unit.rooted else self._level + unit.mnemonics
            command, suffix = COMMANDS.find(path, unit.query)
            self._level = path[:-1]
        call = command.call(unit, suffix, self)
        if command.turns and not self.desk.may_turn(self.client):
            raise LanguageError(ErrorNumber.COMMAND_PROTECTED, "another client holds the lock")
        return command.handler(self, call)


def _as_bytes(reply: str | bytes) -> bytes:
    return reply if isinstance(reply, bytes) else reply.encode("ascii", "replace")


def _as_text(reply: str | bytes) -> str:
    if isinstance(reply, str):
        return reply
    return f"#block of {len(reply)} bytes, crc32 {zlib.crc32(reply):08x}"
