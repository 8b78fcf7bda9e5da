"""A session: an operator at work, what was journalled, what was found, and the truth beside it."""

from a7sim.session.running import Cable, Session, Watcher, open_session, run, straight

__all__ = ["Cable", "Session", "Watcher", "open_session", "run", "straight"]
