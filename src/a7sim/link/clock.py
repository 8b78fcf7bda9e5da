"""Simulated time."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass
class Clock:
    """Seconds at the instrument since the start of the session; actions advance it."""

    now: float = 0.0

    def advance(self, seconds: float) -> None:
        """Advance the time."""
        self.now += seconds

    def advance_to(self, time: float) -> bool:
        """Advance the time to a value if it is earlier; return whether it is reached."""
        self.now = max(self.now, time)
        return True


class WallClock:
    """Simulated time equal to wall-clock time, from a start value."""

    def __init__(self, wall: Callable[[], float] = time.monotonic, now: float = 0.0) -> None:
        self._wall = wall
        self._began = wall() - now

    @property
    def now(self) -> float:
        """Seconds since the start of the session."""
        return self._wall() - self._began

    def advance_to(self, time: float) -> bool:
        """Return whether a time is reached, without advancing."""
        return self.now >= time
