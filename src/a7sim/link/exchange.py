"""A line and all that comes of it: its reply and its errors, without waiting for an answer that never comes."""

from dataclasses import dataclass

from a7sim.instrument.language.commands import SCPI_VERSION
from a7sim.link.client import Client
from a7sim.link.replies import Part, as_text
from a7sim.mistakes import Mistake

_MARKER = ":SYST:ERR:COUN?;:SYST:VERS?"
"""Sent behind every line: what it answers shows that the line had no reply, or that its reply is whole."""


@dataclass(frozen=True, slots=True)
class Exchange:
    """A line as it was sent, its reply by query, and the errors that the instrument reported of it."""

    sent: str
    reply: tuple[Part, ...] | None
    errors: tuple[str, ...]

    @property
    def shown(self) -> str | None:
        """The reply for people, blocks as their sizes; None where there is none."""
        return None if self.reply is None else ";".join(map(as_text, self.reply))


class Conversation:
    """Lines to an instrument, one after the other."""

    def __init__(self, client: Client) -> None:
        self._client = client

    def say(self, line: str) -> Exchange:
        """Send a line and return what came of it. Raises Mistake when the instrument does not answer at all."""
        self._client.send(line)
        self._client.send(_MARKER)
        first = self._reply(line)
        if not _is_marker(first):
            return Exchange(line, first, self._errors(self._marker(line)))
        second = self._client.reply() if "VERS" in line.upper() else None
        if second is None:
            return Exchange(line, None, self._errors(first))
        return Exchange(line, first, self._errors(second))

    def _marker(self, line: str) -> tuple[Part, ...]:
        marker = self._reply(line)
        if not _is_marker(marker):
            raise Mistake(f"{line}: expected one reply to a line, got another: {';'.join(map(as_text, marker))}")
        return marker

    def _reply(self, line: str) -> tuple[Part, ...]:
        reply = self._client.reply()
        if reply is None:
            raise Mistake(f"{line}: expected an answer in time, got none")
        return reply

    def _errors(self, marker: tuple[Part, ...]) -> tuple[str, ...]:
        return tuple(self._client.errors()) if marker[0] != "0" else ()


def _is_marker(reply: tuple[Part, ...]) -> bool:
    return len(reply) == 2 and isinstance(reply[0], str) and reply[0].isdigit() and reply[1] == SCPI_VERSION
