"""The command language of the instrument, without I/O: bytes in, bytes and events out (protocol.md)."""

from a7sim.instrument.language.desk import Desk, LinkEvent, Listener
from a7sim.instrument.language.engine import LONGEST_LINE, Engine
from a7sim.instrument.language.errors import ErrorNumber

__all__ = ["LONGEST_LINE", "Desk", "Engine", "ErrorNumber", "LinkEvent", "Listener"]
