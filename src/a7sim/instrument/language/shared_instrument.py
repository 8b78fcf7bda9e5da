"""State shared by all clients of an instrument: its movement, the lock, the token, and the listener."""

import math
from dataclasses import dataclass, field

import a7sim
from a7sim.instrument.autograph import Autograph, State
from a7sim.instrument.language.context import LinkEvent, Listener
from a7sim.instrument.language.engine import Engine

POLL_SECONDS = 0.1
"""Simulated s per status query while something moves, so that a client may wait by polling."""


@dataclass
class SharedInstrument:
    """Instrument with its clients.

    A movement takes the time of each part's travel on the simulated clock; parts move simultaneously, and each executes
    its movements in order. Readings during a movement are those at its end.
    """

    autograph: Autograph
    listener: Listener | None = None
    token: str | None = None
    """Token with which clients must log in, None if no login is required."""
    poll_takes: float = POLL_SECONDS
    """Simulated s per status query while something moves; 0 with a clock of its own."""
    version: str = a7sim.__version__
    """Version of the software, as reported by the instrument."""
    lock_holder: str | None = None
    busy_since: float = -math.inf
    """Simulated time in s of the start of the present or the last movement."""
    busy_until: float = -math.inf
    """Simulated time in s of its end."""
    _parts_busy_until: dict[str, float] = field(default_factory=dict)
    client_count: int = 0
    """Number of clients that have connected so far."""
    clients: dict[str, Engine] = field(default_factory=dict)
    """Connected clients."""

    def open(self, client: str | None = None, cr_ends_line: bool = True, time: float = 0.0) -> Engine:
        """Return an engine for a new client, with a generated name unless one is given."""
        self.client_count += 1
        engine = Engine(self, client or f"client{self.client_count}", cr_ends_line)
        self.clients[engine.client] = engine
        self.notify(time, engine.client, "+", "")
        return engine

    def close(self, client: str, time: float = 0.0) -> None:
        """Disconnect a client; its lock is released."""
        if self.clients.pop(client, None) is not None:
            self.notify(time, client, "-", "")
        self.release_lock(client)

    def request_lock(self, client: str) -> bool:
        """Give the lock to a client unless another holds it."""
        if self.lock_holder is None:
            self.lock_holder = client
        return self.lock_holder == client

    def release_lock(self, client: str) -> None:
        """Release the lock of a client if it holds it."""
        if self.lock_holder == client:
            self.lock_holder = None

    def may_move(self, client: str) -> bool:
        """Return whether a client may move anything: it holds the lock, or the lock is free."""
        return self.lock_holder in (None, client)

    def note_movement(self, time: float) -> None:
        """Record the movements started at a simulated time in s."""
        for part, seconds in self.autograph.pop_travel_times().items():
            if time >= self.busy_until:
                self.busy_since = time
            ends = max(time, self._parts_busy_until.get(part, time)) + seconds
            self._parts_busy_until[part] = ends
            self.busy_until = max(self.busy_until, ends)

    def poll_until(self, time: float) -> float | None:
        """Return the time until which a polling client waits while something moves, None without a wait."""
        return min(time + self.poll_takes, self.busy_until) if self.poll_takes else None

    def notify(self, time: float, client: str, direction: str, text: str) -> None:
        """Report an event on the link to the listener."""
        if self.listener is not None:
            self.listener(LinkEvent(time, client, direction, text))

    @property
    def is_idle(self) -> bool:
        """Return whether no line is waiting."""
        return all(each.waits_until is None for each in self.clients.values())

    def state(self, changes: int = 0) -> State:
        """Return the complete state of the instrument and its clients, for `restore`.

        Call it only while it is idle and no line is being executed; `changes` are those of `Autograph.state`.
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
        """Restore a state: the same instrument with the same clients."""
        self.autograph.restore(state["autograph"])
        self.lock_holder = state["lock_holder"]
        self.busy_since, self.busy_until = (-math.inf if each is None else each for each in state["busy"])
        self._parts_busy_until = dict(state["parts"])
        self.client_count = state["opened"]
        self.clients = {name: Engine(self, name) for name in state["clients"]}
        for name, each in state["clients"].items():
            self.clients[name].restore(each)
