"""Sessions: an operator with an instrument, a journal, results, and their comparison with the truth.

The names are imported on first use, so that the command line lists its options without them.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from a7sim.session.lifecycle import PortAdapter, ProgressCallbacks, RunOptions, Session, direct, open_session
    from a7sim.session.running import run

__all__ = ["PortAdapter", "ProgressCallbacks", "RunOptions", "Session", "direct", "open_session", "run"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("a7sim.session.running" if name == "run" else "a7sim.session.lifecycle"), name)
