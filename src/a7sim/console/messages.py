"""Messages between the screen and the instrument thread."""

from dataclasses import dataclass, field

from a7sim.console.drawing.rasterize import Greys
from a7sim.console.state.readouts import Readouts
from a7sim.link.client.client import Identity
from a7sim.plotters import Variant


@dataclass(frozen=True)
class ViewRequest:
    """Requested view of the eyepieces: pictures with these columns and rows; none with 0 columns."""

    columns: int = 0
    rows: int = 0
    magnification: float = 8.0
    eyes: tuple[int, ...] = (1, 2)
    point: str | None = None
    """Point whose position in the eyepieces is queried."""


@dataclass(frozen=True)
class ViewResult:
    """View of the eyepieces."""

    look: ViewRequest
    pictures: dict[int, Greys] = field(default_factory=dict)
    """Greys ``(rows, columns)`` by eye."""
    seen: dict[int, tuple[float, float] | None] = field(default_factory=dict)
    """dx, dy in um of the point, by eye; None outside the field of view."""


@dataclass(frozen=True)
class Connected:
    """The instrument answers."""

    identity: Identity
    variant: Variant


@dataclass(frozen=True)
class CommandsRejected:
    """The instrument rejected commands: its errors."""

    errors: tuple[str, ...]


@dataclass(frozen=True)
class ConnectionLost:
    """The instrument no longer answers, with the reason."""

    why: str


StationMessage = Connected | Readouts | ViewResult | CommandsRejected | ConnectionLost
"""Message of the instrument thread to the screen."""
