"""Exchange of a line: its reply and its errors, without waiting for a reply that never comes."""

from dataclasses import dataclass

from a7sim.errors import A7SimError
from a7sim.link.client.client import Client
from a7sim.link.client.replies import Part, part_as_text
from a7sim.plotters import SCPI_VERSION

_MARKER = ":SYST:ERR:COUN?;:SYST:VERS?"
"""Query sent behind each line: its answer shows that the line had no reply, or that its reply is complete."""


@dataclass(frozen=True, slots=True)
class Exchange:
    """Line as sent, its reply by query, and the errors that it caused."""

    sent: str
    reply: tuple[Part, ...] | None
    errors: tuple[str, ...]

    @property
    def shown(self) -> str | None:
        """Reply as text, blocks as their sizes; None without a reply."""
        return None if self.reply is None else ";".join(map(part_as_text, self.reply))


def send_line(client: Client, line: str) -> Exchange:
    """Send a line and return its exchange. Raises A7SimError if the instrument does not answer at all."""
    client.send(line)
    client.send(_MARKER)
    first = _expected(client, line)
    if not _is_marker(first):
        return Exchange(line, first, _errors(client, _marker(client, line)))
    second = client.reply() if "VERS" in line.upper() else None
    if second is None:
        return Exchange(line, None, _errors(client, first))
    return Exchange(line, first, _errors(client, second))


def _marker(client: Client, line: str) -> tuple[Part, ...]:
    marker = _expected(client, line)
    if not _is_marker(marker):
        raise A7SimError(f"{line}: expected one reply to a line, got another: {';'.join(map(part_as_text, marker))}")
    return marker


def _expected(client: Client, line: str) -> tuple[Part, ...]:
    reply = client.reply()
    if reply is not None:
        return reply
    client.send("*IDN?")
    if client.reply() is None:
        raise A7SimError(f"{line}: expected an answer in time, got none")
    why = "the server asks for a token, or another than was given, or lost the reply"
    raise A7SimError(f"{line}: expected an answer, got none but to *IDN?: {why}")


def _errors(client: Client, marker: tuple[Part, ...]) -> tuple[str, ...]:
    return tuple(client.errors()) if marker[0] != "0" else ()


def _is_marker(reply: tuple[Part, ...]) -> bool:
    return len(reply) == 2 and isinstance(reply[0], str) and reply[0].isdigit() and reply[1] == SCPI_VERSION
