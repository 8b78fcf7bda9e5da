"""Commands of the language as frozen data, each with its handler (protocol.md)."""

from a7sim.instrument.language.commands.carriages import CARRIAGES
from a7sim.instrument.language.commands.elements import ELEMENT_COMMANDS
from a7sim.instrument.language.commands.pictures import PICTURES
from a7sim.instrument.language.commands.recording import RECORDING
from a7sim.instrument.language.commands.system import SYSTEM
from a7sim.instrument.language.table import CommandTable

COMMANDS = CommandTable([*SYSTEM, *ELEMENT_COMMANDS, *CARRIAGES, *PICTURES, *RECORDING])
