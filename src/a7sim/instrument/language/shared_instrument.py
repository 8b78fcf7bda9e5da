"""What all clients of one instrument share: the instrument and its movement, the lock, the token, and who listens."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from msgspec import Struct

import a7sim
from a7sim.instrument.autograph import Autograph, State
from a7sim.instrument.language.engine import Engine


class LinkEvent(Struct, frozen=True, gc=False):
    """What happened on the link, in order: simulated time in s, the client, and what it was.

    `direction` is '>' for a line to the instrument and '<' for one from it; '+' where a client comes and '-' where it
    goes; '~' where a line that waited goes on, and '!' where one was too long and dropped. Together they are all that
    the instrument's state follows from.
    """

    time: float
    client: str
    direction: str
    text: str


POLL_SECONDS = 0.1
"""Simulated s that pass over a look at the status while something moves, so that a client may wait by looking."""

Listener = Callable[[LinkEvent], None]


@dataclass
class SharedInstrument:
    """An instrument with its clients.

    Movement lasts, on the simulated clock, as long as each part needs for its way; parts move at the same time, and
    each does one thing after the other. What is read meanwhile is what stands at the end.
    """

    autograph: Autograph
    listener: Listener | None = None
    token: str | None = None
    """What clients must log in with, None where everybody is welcome."""
    poll_takes: float = POLL_SECONDS
    """Simulated s that a look at the status takes while something moves; 0 where the clock goes by itself."""
    version: str = a7sim.__version__
    """Of the software, as the instrument tells it."""
    lock_holder: str | None = None
    busy_since: float = -math.inf
    """Simulated time in s at which the present movement, or the last one, began."""
    busy_until: float = -math.inf
    """Simulated time in s at which it ends."""
    _parts_busy_until: dict[str, float] = field(default_factory=dict)
    client_count: int = 0
    """How many clients have come."""
    clients: dict[str, Engine] = field(default_factory=dict)
    """Those that are there."""

    def open(self, client: str | None = None, cr_ends_line: bool = True, time: float = 0.0) -> Engine:
        """Return an engine for a client that comes; it gets a name of its own unless it brings one."""
        self.client_count += 1
        engine = Engine(self, client or f"client{self.client_count}", cr_ends_line)
        self.clients[engine.client] = engine
        self.notify(time, engine.client, "+", "")
        return engine

    def close(self, client: str, time: float = 0.0) -> None:
        """Forget a client that goes; a lock that it holds is free again."""
        if self.clients.pop(client, None) is not None:
            self.notify(time, client, "-", "")
        self.release_lock(client)

    def request_lock(self, client: str) -> bool:
        """Give the lock to a client unless another holds it."""
        if self.lock_holder is None:
            self.lock_holder = client
        return self.lock_holder == client

    def release_lock(self, client: str) -> None:
        """Take the lock back from a client if it holds it."""
        if self.lock_holder == client:
            self.lock_holder = None

    def may_move(self, client: str) -> bool:
        """Whether a client may move anything: it holds the lock, or nobody does."""
        return self.lock_holder in (None, client)

    def note_movement(self, time: float) -> None:
        """Take note of what has set out at a simulated time in s."""
        for part, seconds in self.autograph.pop_travel_times().items():
            if time >= self.busy_until:
                self.busy_since = time
            ends = max(time, self._parts_busy_until.get(part, time)) + seconds
            self._parts_busy_until[part] = ends
            self.busy_until = max(self.busy_until, ends)

    def poll_until(self, time: float) -> float | None:
        """Return until when a client waits that looked at the status while something moves, None if it need not."""
        return min(time + self.poll_takes, self.busy_until) if self.poll_takes else None

    def notify(self, time: float, client: str, direction: str, text: str) -> None:
        """Tell the listener what happened on the link."""
        if self.listener is not None:
            self.listener(LinkEvent(time, client, direction, text))

    @property
    def is_idle(self) -> bool:
        """Whether no line waits to go on."""
        return all(each.waits_until is None for each in self.clients.values())

    def state(self, changes: int = 0) -> State:
        """Return all that the events so far have made of the instrument and its clients, for `restore`.

        To be asked while it is `quiet` and no line is being obeyed; `changes` are those of `Autograph.state`.
        """
        return {
            "autograph": self.autograph.state(changes),
            "lock_holder": self.lock_holder,
            "busy": [each if math.isfinite(each) else None for each in (self.busy_since, self.busy_until)],
            "parts": dict(self._parts_busy_until),
            "opened": self.client_count,
            "clients": {name: each.state() for name, each in self.clients.items()},
        }

    def restore(self, state: State) -> None:
        """Be as when a state was taken: the same instrument with the same clients."""
        self.autograph.restore(state["autograph"])
        self.lock_holder = state["lock_holder"]
        self.busy_since, self.busy_until = (-math.inf if each is None else each for each in state["busy"])
        self._parts_busy_until = dict(state["parts"])
        self.client_count = state["opened"]
        self.clients = {name: Engine(self, name) for name in state["clients"]}
        for name, each in state["clients"].items():
            self.clients[name].restore(each)
