"""What all clients of one instrument share: the instrument and its movement, the lock, the token, and who listens."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from a7sim.instrument.autograph import Autograph
from a7sim.instrument.language.engine import Engine


@dataclass(frozen=True, slots=True)
class LinkEvent:
    """A line that crossed the link: simulated time in s, the client, '>' to the instrument or '<' from it."""

    time: float
    client: str
    direction: str
    text: str


POLL_TAKES = 0.1
"""Simulated s that pass over a look at the status while something moves, so that a client may wait by looking."""

Listener = Callable[[LinkEvent], None]


@dataclass
class Desk:
    """An instrument with its clients.

    Movement lasts, on the simulated clock, as long as each part needs for its way; parts move at the same time, and
    each does one thing after the other. What is read meanwhile is what stands at the end.
    """

    autograph: Autograph
    listener: Listener | None = None
    token: str | None = None
    """What clients must log in with, None where everybody is welcome."""
    poll_takes: float = POLL_TAKES
    """Simulated s that a look at the status takes while something moves; 0 where the clock goes by itself."""
    lock_holder: str | None = None
    busy_since: float = -math.inf
    """Simulated time in s at which the present movement, or the last one, began."""
    busy_until: float = -math.inf
    """Simulated time in s at which it ends."""
    _parts_busy_until: dict[str, float] = field(default_factory=dict)
    _opened: int = field(default=0)

    def open(self, client: str | None = None, cr_ends_line: bool = True) -> Engine:
        """Return an engine for a new client; it gets a name of its own unless it brings one."""
        self._opened += 1
        return Engine(self, client or f"client{self._opened}", cr_ends_line)

    def close(self, client: str) -> None:
        """Forget a client; a lock that it holds is free again."""
        if self.lock_holder == client:
            self.lock_holder = None

    def request_lock(self, client: str) -> bool:
        """Give the lock to a client unless another holds it."""
        if self.lock_holder is None:
            self.lock_holder = client
        return self.lock_holder == client

    def release_lock(self, client: str) -> None:
        """Take the lock back from a client that holds it."""
        self.close(client)

    def may_turn(self, client: str) -> bool:
        """Whether a client may move anything: it holds the lock, or nobody does."""
        return self.lock_holder in (None, client)

    def moved(self, time: float) -> None:
        """Take note of what has set out at a simulated time in s."""
        for part, seconds in self.autograph.time_taken().items():
            if time >= self.busy_until:
                self.busy_since = time
            ends = max(time, self._parts_busy_until.get(part, time)) + seconds
            self._parts_busy_until[part] = ends
            self.busy_until = max(self.busy_until, ends)

    def polled(self, time: float) -> float | None:
        """Return until when a client waits that looked at the status while something moves, None if it need not."""
        return min(time + self.poll_takes, self.busy_until) if self.poll_takes else None

    def heard(self, time: float, client: str, direction: str, text: str) -> None:
        """Tell the listener of a line that crossed the link."""
        if self.listener is not None:
            self.listener(LinkEvent(time, client, direction, text))
