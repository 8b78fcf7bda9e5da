"""The plotter: its parts as frozen data, the assembled Autograph, and its command language."""

from a7sim.instrument.autograph import Autograph, build_autograph
from a7sim.instrument.errors import AutographError, OutOfRangeError, SettingsConflictError, UnknownNameError

__all__ = [
    "Autograph",
    "AutographError",
    "OutOfRangeError",
    "SettingsConflictError",
    "UnknownNameError",
    "build_autograph",
]
