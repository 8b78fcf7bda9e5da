"""The plotter: its parts as frozen data, the assembled Autograph, and the language it is worked in."""

from a7sim.instrument.autograph import Autograph, build_autograph
from a7sim.instrument.refusals import OutOfRange, Refusal, SettingsConflict, UnknownName

__all__ = [
    "Autograph",
    "OutOfRange",
    "Refusal",
    "SettingsConflict",
    "UnknownName",
    "build_autograph",
]
