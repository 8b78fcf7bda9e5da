"""Language engine of one client: bytes in, bytes out; without I/O and without a clock of its own."""

import hmac
import math
import re
import zlib
from typing import Any

from a7sim.instrument.errors import AutographError, OutOfRangeError, SettingsConflictError, UnknownNameError
from a7sim.instrument.language.commands import COMMANDS
from a7sim.instrument.language.context import LockedInstrument
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.program import (
    CachedQuery,
    ParsedCommand,
    ParseFailure,
    Program,
    cached_query,
    parse_program,
    strip_line_end,
)
from a7sim.instrument.language.status import OPERATION_COMPLETE, SETTLING, Status
from a7sim.instrument.language.token_redaction import redact_token

MAX_LINE_LENGTH = 4096
"""Bytes, without the line end."""

MAX_REPLY = 4 * 1024 * 1024
"""Bytes of the replies to one line."""

MAX_UNITS_PER_TURN, MAX_REPLY_PER_TURN = 50, 64 * 1024
"""Units of a line, and bytes of their replies, executed before commands of other clients."""

MAX_BUFFERED_BYTES = 64 * 1024
"""Bytes of input buffered behind a unit that waits for movement."""

_MAX_PENDING_LENGTH = MAX_LINE_LENGTH + 2
"""A line, the CR of its end, and one byte that reveals a line as too long."""

_REPLIES_TOO_LONG = f"expected replies of at most {MAX_REPLY} bytes a line"

_NUMBER_OF = {
    OutOfRangeError: ErrorNumber.DATA_OUT_OF_RANGE,
    SettingsConflictError: ErrorNumber.SETTINGS_CONFLICT,
    UnknownNameError: ErrorNumber.ILLEGAL_PARAMETER_VALUE,
}


class Engine:
    """Session of one client with the instrument.

    `waits_until` is the simulated time in s up to which the client's input waits for movement to end, None without a
    wait. Until `feed` is called at that time or later, possibly with no bytes, input is buffered and not executed.
    Within a long line it is sometimes the present time, so that commands of other clients are executed.
    """

    def __init__(self, instrument: LockedInstrument, client: str, cr_ends_line: bool = True) -> None:
        self.instrument = instrument
        self.client = client
        self.waits_until: float | None = None
        self._status = Status()
        self._admitted = instrument.token is None
        self._time = 0.0
        self._movement_seen = instrument.busy_since
        self._completes_at: float | None = None
        self._cr_ends_line = cr_ends_line
        self._line_end = re.compile(rb"[\r\n]" if cr_ends_line else rb"\n")
        self._pending = bytearray()
        self._buffered_input = bytearray()
        self._overrun = False
        self._remaining_units: Program = ()
        self._waited = False
        self._replies: list[str | bytes] = []
        self._reply_size = 0
        self._overflowed = False

    def feed(self, received: bytes, time: float) -> bytes:
        """Process bytes received at a simulated time in s; return the bytes of the replies."""
        return b"".join(self.feed_with_replies(received, time))

    def feed_with_replies(self, received: bytes, time: float) -> list[bytes]:
        """Process bytes received at a simulated time in s; return the reply to each line that has one."""
        self._time = time
        if self.waits_until is None and not self._pending and self._admitted and self.instrument.listener is None:
            query = cached_query(received, self._cr_ends_line)
            if query is not None:
                return self._answer_query(query)
        replies: list[bytes] = []
        if self.waits_until is None and not self._pending and self._is_one_line(received):
            self._execute_line(received, replies)
            return replies
        if self.waits_until is not None:
            if time < self.waits_until:
                self._buffer_input(received)
                return replies
            received = self._resume(replies) + received
        start = 0
        while self.waits_until is None:
            end = self._line_end.search(received, start)
            if end is None:
                self._append_pending(received[start:])
                return replies
            self._append_pending(received[start : end.start()])
            start = end.end()
            line = bytes(self._pending)
            self._pending.clear()
            self._execute_line(line, replies)
        self._buffer_input(received[start:])
        return replies

    def _answer_query(self, query: CachedQuery) -> list[bytes]:
        try:
            reply = query.handler(self, query.call)
        except CommandError as error:
            self._report(error)
        except AutographError as refusal:
            self._report(_error_of(refusal, query.text))
        else:
            return [_as_bytes(reply) + b"\n"] if reply is not None else []
        return []

    def _report(self, error: CommandError) -> None:
        self._status.report(error.number, error.detail)

    def _is_one_line(self, received: bytes) -> bool:
        """Return whether the input is exactly one line, as it usually is."""
        length = len(received)
        return received.find(b"\n") == length - 1 <= MAX_LINE_LENGTH and (
            not self._cr_ends_line or b"\r" not in received
        )

    def _resume(self, replies: list[bytes]) -> bytes:
        """Execute the rest of a line that waited; return the input buffered behind it."""
        self._notify("~", "")
        self.waits_until = None
        self._execute_remaining_units(replies)
        if self.waits_until is not None:
            return b""
        buffered = bytes(self._buffered_input)
        self._buffered_input.clear()
        if self._overrun:
            self._overrun = False
            buffered += b"\0" * _MAX_PENDING_LENGTH
        return buffered

    def _buffer_input(self, received: bytes) -> None:
        capacity = MAX_BUFFERED_BYTES - len(self._buffered_input)
        self._buffered_input += received[:capacity]
        self._overrun |= len(received) > capacity

    def _append_pending(self, part: bytes) -> None:
        self._pending += part[: _MAX_PENDING_LENGTH - len(self._pending)]

    def _execute_line(self, line: bytes, replies: list[bytes]) -> None:
        if len(line) > MAX_LINE_LENGTH and len(strip_line_end(line)) > MAX_LINE_LENGTH:
            self._notify("!", f"(a line of more than {MAX_LINE_LENGTH} bytes, dropped)")
            self._status.report(ErrorNumber.INPUT_BUFFER_OVERRUN, f"expected at most {MAX_LINE_LENGTH} bytes a line")
            return
        if self.instrument.listener is not None:
            self._notify_line(strip_line_end(line))
        self._remaining_units = parse_program(line)
        self._execute_remaining_units(replies)

    def _notify_line(self, text: str) -> None:
        if text.strip(" \t"):
            token = self.instrument.token
            self._notify(">", text if token is None else redact_token(text, token))

    def _notify(self, direction: str, text: str) -> None:
        self.instrument.notify(self._time, self.client, direction, text)

    def _execute_remaining_units(self, replies: list[bytes]) -> None:
        """Execute the remaining units of a line, up to one that waits; at its end, append its reply if it has one."""
        program = self._remaining_units
        max_size = self._reply_size + MAX_REPLY_PER_TURN
        for place, unit in enumerate(program):
            try:
                done = self._execute(unit)
            except CommandError as error:
                self._report(error)
                done = True
            if (place >= MAX_UNITS_PER_TURN or self._reply_size > max_size) and self.waits_until is None:
                self.waits_until = self._time
            if self.waits_until is not None:
                self._remaining_units = program[place + done :]
                return
        if self._replies:
            if self.instrument.listener is not None:
                self._notify("<", ";".join(map(loggable_reply, self._replies)))
            replies.append(b";".join(map(_as_bytes, self._replies)) + b"\n")
            self._replies.clear()
            self._reply_size = 0
            self._overflowed = False

    def _execute(self, unit: ParsedCommand | ParseFailure) -> bool:
        """Execute a unit; return False if it must wait. Raises CommandError."""
        if not self._admitted and (isinstance(unit, ParseFailure) or not unit.command.allowed_before_login):
            raise CommandError(ErrorNumber.COMMAND_PROTECTED, "expected SYSTem:LOGin first")
        if isinstance(unit, ParseFailure):
            raise CommandError(unit.number, unit.detail)
        command = unit.command
        try:
            call = unit.bare or unit.call(self)
            if command.moves and not self.instrument.may_move(self.client):
                raise CommandError(ErrorNumber.COMMAND_PROTECTED, "another client holds the lock")
            if command.waits and self._must_wait():
                return False
            if self._overflowed and command.query:
                raise CommandError(ErrorNumber.QUERY_DEADLOCKED, _REPLIES_TOO_LONG)
            reply = command.handler(self, call)
        except AutographError as refusal:
            raise _error_of(refusal, unit.text) from refusal
        finally:
            if command.moves:
                self.instrument.note_movement(self._time)
        if reply is not None:
            self._append_reply(reply)
        if command.polls and self._time < self.instrument.busy_until:
            self.waits_until = self.instrument.poll_until(self._time)
        return True

    def _must_wait(self) -> bool:
        """Wait for the current movement, once: movements that other clients start meanwhile are not waited for."""
        if self._waited:
            self._waited = False
        elif self._time < self.instrument.busy_until:
            self.waits_until = self.instrument.busy_until
            self._waited = True
        return self._waited

    def _append_reply(self, reply: str | bytes) -> None:
        self._overflowed = self._reply_size + len(reply) > MAX_REPLY
        if self._overflowed:
            raise CommandError(ErrorNumber.QUERY_DEADLOCKED, _REPLIES_TOO_LONG)
        self._reply_size += len(reply)
        self._replies.append(reply)

    # --- state -----------------------------------------------------------------------------------------

    def state(self) -> dict[str, Any]:
        """Return the state of the session, without waiting lines; for `restore`."""
        return {
            "status": self._status.state(),
            "admitted": self._admitted,
            "completes_at": None if self._completes_at is None else max(self._completes_at, -1.0),
            "movement_seen": self._movement_seen if math.isfinite(self._movement_seen) else None,
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Restore a state."""
        self._status.restore(state["status"])
        self._admitted = state["admitted"]
        self._completes_at = state["completes_at"]
        self._movement_seen = -math.inf if state["movement_seen"] is None else state["movement_seen"]

    # --- context of command handlers --------------------------------------------------------------------

    @property
    def status(self) -> Status:
        """Status of the client at the time of execution."""
        instrument, status = self.instrument, self._status
        if self._movement_seen != instrument.busy_since:
            self._movement_seen = instrument.busy_since
            status.operation.event |= SETTLING
        others = status.operation.condition & ~SETTLING
        status.operation.condition = others | (SETTLING if self._time < instrument.busy_until else 0)
        if self._completes_at is not None and self._completes_at <= self._time:
            self._completes_at = None
            status.event |= OPERATION_COMPLETE
        return status

    @property
    def headers(self) -> list[str]:
        """All headers of the engine."""
        return COMMANDS.headers()

    @property
    def errors(self) -> tuple[str, ...]:
        """Entries of the error queue, oldest first, without removing them."""
        return tuple(self._status.errors)

    def complete(self) -> None:
        """Set the bit of operation complete when the current movement is done (`*OPC`)."""
        self._completes_at = self.instrument.busy_until

    def clear(self) -> None:
        """Clear events and errors (`*CLS`)."""
        self.status.clear()
        self.cancel_completion()

    def cancel_completion(self) -> None:
        """Cancel a pending bit of operation complete."""
        self._completes_at = None

    def log_in(self, token: str) -> None:
        """Log the client in to an instrument with a token. Raises CommandError for a wrong one."""
        expected = self.instrument.token
        if expected is not None and not hmac.compare_digest(token.encode(), expected.encode()):
            raise CommandError(ErrorNumber.COMMAND_PROTECTED, "this is not the token")
        self._admitted = True


def _error_of(refusal: AutographError, text: str) -> CommandError:
    return CommandError(_NUMBER_OF.get(type(refusal), ErrorNumber.EXECUTION_ERROR), f"{text[:60]}: {refusal}")


def _as_bytes(reply: str | bytes) -> bytes:
    return reply if isinstance(reply, bytes) else reply.encode("ascii", "replace")


def loggable_reply(reply: str | bytes) -> str:
    """Return a reply as recorded by a listener: size and checksum instead of a block."""
    if isinstance(reply, str):
        return reply
    return f"#block of {len(reply)} bytes, crc32 {zlib.crc32(reply):08x}"
