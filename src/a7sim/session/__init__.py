"""A session: an operator at work, what was journalled, what was found, and the truth beside it.

What it gives is imported when it is asked for, so that a command line can say its options without it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from a7sim.session.running import PortAdapter, ProgressCallbacks, Session, direct, open_session, run

__all__ = ["PortAdapter", "ProgressCallbacks", "Session", "direct", "open_session", "run"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module("a7sim.session.running"), name)
