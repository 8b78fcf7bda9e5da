"""Interface of the console that its actions and message handlers use, so that they do not import the application."""

from collections.abc import Callable
from typing import Any, Protocol

from textual.message import Message
from textual.screen import Screen

from a7sim.console.actions.navigation import CounterOrigins
from a7sim.console.config import ConsoleConfig
from a7sim.console.drawing.sketch import Place
from a7sim.console.instrument_thread import InstrumentThread
from a7sim.console.messages import Connected, ConnectionLost, ViewResult
from a7sim.console.state.readouts import Readouts
from a7sim.console.state.selection import ControlSelection
from a7sim.console.widgets.binocular import Binocular
from a7sim.console.widgets.book import RecordedEntry
from a7sim.console.widgets.main_screen import MainScreen
from a7sim.console.widgets.playback import Playback
from a7sim.link.client.client import Client


class ConsoleContext(Protocol):
    """State and operations of a console: see `Console`."""

    config: ConsoleConfig
    utf8: bool
    binocular: Binocular
    selection: ControlSelection
    entries: tuple[RecordedEntry, ...]
    presets: CounterOrigins
    sketches: dict[int, dict[str, Place]]
    principal_distances: dict[int, float]
    point: str | None
    met: Connected | None
    dials: Readouts | None
    sight: ViewResult | None
    silent: ConnectionLost | None
    thread: InstrumentThread
    playback: Playback | None
    main: MainScreen

    def say(self, words: str, refused: bool = False) -> None:
        """Show a message."""

    def ask(self, work: Callable[[Client], Any], then: Callable[[Any], None]) -> None:
        """Run a request in the instrument thread, and call back with the answer in the screen's thread."""

    def call_after_orders(self, then: Callable[[], None]) -> None:
        """Call back when all earlier requests are sent and their results shown."""

    def look(self) -> None:
        """Request pictures of the size of the eyepieces."""

    def draw(self) -> None:
        """Draw the pictures."""

    def refresh_panels(self) -> None:
        """Update readouts, selection and book."""

    def next_panel(self) -> None:
        """Show the next panel at the right of a narrow screen."""

    def press_early_keys(self) -> None:
        """Process a key pressed before the instrument answered."""

    def forget_early_keys(self) -> None:
        """Discard the early keys."""

    def push_screen(self, screen: Screen[Any], callback: Callable[[Any], None] | None = None) -> Any:
        """Show a screen over the present one (Textual)."""

    def post_message(self, message: Message) -> bool:
        """Post a message to the console, also from another thread (Textual)."""

    def set_interval(self, interval: float, callback: Callable[[], Any]) -> Any:
        """Call back at an interval in s (Textual)."""

    def call_after_refresh(self, callback: Callable[..., Any], *args: Any) -> bool:
        """Call back after the screen is refreshed (Textual)."""

    def exit(self) -> None:
        """End the console (Textual)."""
