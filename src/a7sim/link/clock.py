"""Simulated time."""

from dataclasses import dataclass


@dataclass
class Clock:
    """Seconds at the instrument since the session began; whoever acts spends them."""

    now: float = 0.0

    def spend(self, seconds: float) -> None:
        """Let time pass."""
        self.now += seconds

    def pass_to(self, time: float) -> None:
        """Let time pass until it is so late, if it is not yet."""
        self.now = max(self.now, time)
