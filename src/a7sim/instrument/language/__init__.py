"""The command language of the instrument, without I/O: bytes in, bytes and events out (protocol.md)."""

from a7sim.instrument.language.desk import Desk, LinkEvent, Listener
from a7sim.instrument.language.engine import MAX_BUFFERED_BYTES, MAX_LINE_LENGTH, MAX_REPLY, Engine, as_heard
from a7sim.instrument.language.errors import ErrorNumber, entry
from a7sim.instrument.language.logins import without_token

__all__ = [
    "MAX_BUFFERED_BYTES",
    "MAX_LINE_LENGTH",
    "MAX_REPLY",
    "Desk",
    "Engine",
    "ErrorNumber",
    "LinkEvent",
    "Listener",
    "as_heard",
    "entry",
    "without_token",
]
