"""Simulated time."""

import time
from collections.abc import Callable
from dataclasses import dataclass


@dataclass
class Clock:
    """Seconds at the instrument since the session began; whoever acts spends them."""

    now: float = 0.0

    def advance(self, seconds: float) -> None:
        """Let time pass."""
        self.now += seconds

    def advance_to(self, time: float) -> bool:
        """Let time pass until it is so late, if it is not yet; return whether it is."""
        self.now = max(self.now, time)
        return True


class WallClock:
    """Simulated time that is the wall's: it goes by itself, on from where it is set when it is made."""

    def __init__(self, wall: Callable[[], float] = time.monotonic, now: float = 0.0) -> None:
        self._wall = wall
        self._began = wall() - now

    @property
    def now(self) -> float:
        """Seconds since the session began."""
        return self._wall() - self._began

    def advance_to(self, time: float) -> bool:
        """Return whether it is so late; it does not hurry."""
        return self.now >= time
