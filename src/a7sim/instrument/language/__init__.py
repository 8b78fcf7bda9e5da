"""The command language of the instrument, without I/O: bytes in, bytes and events out (protocol.md)."""

from a7sim.instrument.language.desk import Desk, LinkEvent, Listener
from a7sim.instrument.language.engine import LARGEST_REPLY, LONGEST_LINE, MOST_KEPT_BACK, Engine
from a7sim.instrument.language.errors import ErrorNumber, entry

__all__ = [
    "LARGEST_REPLY",
    "LONGEST_LINE",
    "MOST_KEPT_BACK",
    "Desk",
    "Engine",
    "ErrorNumber",
    "LinkEvent",
    "Listener",
    "entry",
]
