"""What the screen asks the station to look at, and what the station tells the screen."""

from dataclasses import dataclass, field

from a7sim.console.drawing.rasterize import Greys
from a7sim.console.state.readouts import Readouts
from a7sim.link.client.client import Identity
from a7sim.plotters import Variant


@dataclass(frozen=True)
class ViewRequest:
    """What the eyepieces are to show: pictures of so many columns and rows; none of 0 columns."""

    columns: int = 0
    rows: int = 0
    magnification: float = 8.0
    eyes: tuple[int, ...] = (1, 2)
    point: str | None = None
    """The point of which the eye is to say where it stands."""


@dataclass(frozen=True)
class ViewResult:
    """What the eyepieces show."""

    look: ViewRequest
    pictures: dict[int, Greys] = field(default_factory=dict)
    """Greys ``(rows, columns)`` by eye."""
    seen: dict[int, tuple[float, float] | None] = field(default_factory=dict)
    """dx, dy in um of the point, by eye; None where it is not in the field of view."""


@dataclass(frozen=True)
class Connected:
    """An instrument answers."""

    identity: Identity
    variant: Variant


@dataclass(frozen=True)
class CommandsRejected:
    """The instrument has refused something: what it said."""

    errors: tuple[str, ...]


@dataclass(frozen=True)
class ConnectionLost:
    """The instrument does not answer any more, and why."""

    why: str


StationMessage = Connected | Readouts | ViewResult | CommandsRejected | ConnectionLost
"""What the station tells the screen."""
