"""Command language of the instrument, without I/O: bytes in, bytes and events out (protocol.md)."""

from a7sim.instrument.language.context import LinkEvent, Listener
from a7sim.instrument.language.engine import MAX_BUFFERED_BYTES, MAX_LINE_LENGTH, MAX_REPLY, Engine, loggable_reply
from a7sim.instrument.language.errors import ErrorNumber, format_entry
from a7sim.instrument.language.shared_instrument import SharedInstrument
from a7sim.instrument.language.token_redaction import redact_token

__all__ = [
    "MAX_BUFFERED_BYTES",
    "MAX_LINE_LENGTH",
    "MAX_REPLY",
    "Engine",
    "ErrorNumber",
    "LinkEvent",
    "Listener",
    "SharedInstrument",
    "format_entry",
    "loggable_reply",
    "redact_token",
]
