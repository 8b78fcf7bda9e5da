"""The name of `a7sim.processing` in release 0.1.0. Importing it warns."""

from a7sim import processing
from a7sim.deprecation import renamed_attributes, warn_renamed

warn_renamed("a7sim.computing", "a7sim.processing", stacklevel=2)

_RENAMED = {
    **{name: name for name in processing.__all__ if name not in ("ProcessingResult", "write_result")},
    **{"Outcome": "ProcessingResult", "written": "write_result"},
}
__all__ = list(_RENAMED)
__getattr__ = renamed_attributes(__name__, {old: f"a7sim.processing:{new}" for old, new in _RENAMED.items()})
