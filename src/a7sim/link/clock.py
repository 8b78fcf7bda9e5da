"""Simulated time."""

from dataclasses import dataclass


@dataclass
class Clock:
    """Seconds at the instrument since the session began; whoever acts spends them."""

    now: float = 0.0

    def spend(self, seconds: float) -> None:
        """Let time pass."""
        self.now += seconds
