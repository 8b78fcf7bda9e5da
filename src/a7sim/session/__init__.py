"""A session: an operator at work, what was journalled, what was found, and the truth beside it."""

from a7sim.session.running import Session, Watcher, Wire, open_session, run, straight

__all__ = ["Session", "Watcher", "Wire", "open_session", "run", "straight"]
