"""What all clients of one instrument share: the instrument, the lock, and who listens to what crosses the link."""

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


Listener = Callable[[LinkEvent], None]


@dataclass
class Desk:
    """An instrument with its clients."""

    autograph: Autograph
    listener: Listener | None = None
    lock_holder: str | None = None
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

    def heard(self, time: float, client: str, direction: str, text: str) -> None:
        """Tell the listener of a line that crossed the link."""
        if self.listener is not None:
            self.listener(LinkEvent(time, client, direction, text))
