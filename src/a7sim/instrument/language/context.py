"""Interfaces between engine, command handlers and shared instrument, so that these do not import each other."""

from collections.abc import Callable
from typing import Protocol

from msgspec import Struct

from a7sim.instrument.autograph import Autograph
from a7sim.instrument.language.status import Status


class LinkEvent(Struct, frozen=True, gc=False):
    """Event on the link: simulated time in s, client, direction and text.

    `direction` is '>' for a line to the instrument and '<' for one from it; '+' for a client that connects and '-' for
    one that disconnects; '~' where a waiting line continues, and '!' where a too long one was dropped. The sequence of
    events determines the state of the instrument.
    """

    time: float
    client: str
    direction: str
    text: str


Listener = Callable[[LinkEvent], None]


class LockedInstrument(Protocol):
    """Instrument shared by clients, as an engine and its handlers use it: see `SharedInstrument`."""

    autograph: Autograph
    listener: Listener | None
    token: str | None
    version: str
    busy_since: float
    busy_until: float

    def request_lock(self, client: str) -> bool:
        """Give the lock to a client unless another holds it."""

    def release_lock(self, client: str) -> None:
        """Release the lock of a client if it holds it."""

    def may_move(self, client: str) -> bool:
        """Return whether a client may move anything."""

    def note_movement(self, time: float) -> None:
        """Record the movements started at a simulated time in s."""

    def poll_until(self, time: float) -> float | None:
        """Return the time until which a polling client waits, None without a wait."""

    def notify(self, time: float, client: str, direction: str, text: str) -> None:
        """Report an event on the link to the listener."""


class CommandContext(Protocol):
    """Context of a command handler: the session of one client with the instrument, see `Engine`."""

    client: str

    @property
    def instrument(self) -> LockedInstrument:
        """Instrument of the session."""

    @property
    def status(self) -> Status:
        """Status of the client at the time of execution."""

    @property
    def headers(self) -> list[str]:
        """All headers of the language."""

    def complete(self) -> None:
        """Set the bit of operation complete when the current movement is done."""

    def cancel_completion(self) -> None:
        """Cancel a pending bit of operation complete."""

    def clear(self) -> None:
        """Clear events and errors."""

    def log_in(self, token: str) -> None:
        """Log the client in. Raises CommandError for a wrong token."""
