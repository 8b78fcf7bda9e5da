"""Table of actions: one method per action, which sends a request or changes the view."""

from functools import partial
from typing import Any

from a7sim.console.actions.book import BookActions
from a7sim.console.actions.controls import ControlActions
from a7sim.console.actions.navigation import PointNavigator
from a7sim.console.actions.playback import PlaybackActions
from a7sim.console.actions.preset_recovery import update_presets
from a7sim.console.actions.setup import SetupActions
from a7sim.console.actions.view import ViewActions
from a7sim.console.widgets.dialogs import Ask, Choose, HelpPage
from a7sim.link.client.exchange import send_line

_TURNS = {
    "x_up": ("X", 1),
    "x_down": ("X", -1),
    "y_up": ("Y", 1),
    "y_down": ("Y", -1),
    "z_up": ("Z", 1),
    "z_down": ("Z", -1),
}
_TAKEN = ("kappa", "phi", "omega", "by", "bz", "c", "bx", "common_phi")
ACTIONS_WHILE_DISCONNECTED = ("quit", "help")


class Actions(ControlActions, SetupActions, BookActions, ViewActions, PlaybackActions):
    """All actions of a console."""

    def run_by_name(self, name: str) -> None:
        """Run the action of a key or of the palette."""
        if (self._console.dials is None and name not in ACTIONS_WHILE_DISCONNECTED) or self.reject_if_watching(name):
            return
        if name in _TURNS:
            self.move(*_TURNS[name])
        elif name in _TAKEN:
            self.take_up(name)
        else:
            getattr(self, f"do_{name}")()

    def do_go_to(self) -> None:
        """Choose a point of the sketch and drive near it."""
        console = self._console
        projector = console.selection.side if console.sketches[console.selection.side] else 3 - console.selection.side
        points = console.sketches[projector]
        if not points:
            console.say("there is no sketch: lay a picture first (l)", refused=True)
            return
        other = console.sketches[3 - projector]
        common = sorted((name for name in points if name in other), key=str)
        lone = sorted((name for name in points if name not in other), key=str)
        choices = [(name, f"{name:<8}in both pictures") for name in common] + [(name, name) for name in lone]

        def chosen(name: str | None) -> None:
            if name is not None:
                self.approach_point(projector, name)

        console.push_screen(Choose("drive near a point", choices), chosen)

    def approach_point(self, projector: int, point: str) -> None:
        """Drive near a point of the sketch of a projector's picture."""
        console = self._console
        variant, dials = self._at()
        reach = PointNavigator(variant, dials, console.presets, projector, console.sketches[projector])
        console.point = point

        def arrived(reached: bool) -> None:
            console.say(
                f"near point {point}" if reached else f"point {point} is not to be seen where the sketch shows it",
                refused=not reached,
            )
            console.look()
            console.refresh_panels()

        console.say(f"driving to point {point} ...")
        console.ask(partial(reach.drive_near, point=point), arrived)

    def do_say(self) -> None:
        """Send a line of the command language."""
        self._console.push_screen(Ask("say", note="a line of the command language"), self._send_line)

    def _send_line(self, line: str | None) -> None:
        console = self._console
        if line is not None:
            variant, dials = self._at()

            def shown(exchange: Any) -> None:
                if not exchange.errors:
                    update_presets(console.presets, variant, dials, line)
                console.say(
                    exchange.shown or " ".join(exchange.errors) or f"said {line}", refused=bool(exchange.errors)
                )

            console.ask(lambda client: send_line(client, line), shown)

    def do_panel(self) -> None:
        """Show the next panel at the right of a narrow screen."""
        self._console.next_panel()

    def do_help(self) -> None:
        """Show all keys."""
        console = self._console
        console.push_screen(
            HelpPage(
                console.config.keymap, not console.utf8, console.config.watching, console.config.recording is not None
            )
        )

    def do_quit(self) -> None:
        """Quit; everything is in the book and the journal."""
        self._console.exit()
