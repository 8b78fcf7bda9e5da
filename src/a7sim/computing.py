"""The name of `a7sim.processing` in release 0.1.0. Importing it warns."""

from a7sim import processing
from a7sim.deprecation import renamed_attributes, warn_renamed

warn_renamed("a7sim.computing", "a7sim.processing", stacklevel=2)

__all__ = [name for name in processing.__all__ if name not in ("ProcessingResult", "write_result")]

_RENAMED = renamed_attributes(
    __name__, {"Outcome": "a7sim.processing:ProcessingResult", "written": "a7sim.processing:write_result"}
)


def __getattr__(name: str) -> object:
    return getattr(processing, name) if name in processing.__all__ else _RENAMED(name)
