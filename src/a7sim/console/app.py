"""Application of the console: its screen, its state, and its instrument thread."""

from collections import deque
from collections.abc import Iterable, Sequence
from functools import partial
from typing import Any

from textual import events, on
from textual.app import App, SystemCommand
from textual.filter import ANSIToTruecolor, LineFilter
from textual.screen import Screen

from a7sim.console.actions.message_handlers import MessageHandlers
from a7sim.console.actions.navigation import CounterOrigins, print_position
from a7sim.console.actions.table import ACTIONS_WHILE_DISCONNECTED, Actions
from a7sim.console.config import ConsoleConfig, ResumeOffer, best_drawing, speaks_utf8
from a7sim.console.drawing.sketch import Place
from a7sim.console.instrument_thread import InstrumentThread
from a7sim.console.keymap import actions_by_key, actions_for, key_display, key_name
from a7sim.console.messages import Connected, ConnectionLost, ViewResult
from a7sim.console.state.readouts import Readouts
from a7sim.console.state.selection import ControlSelection
from a7sim.console.themes import DRUMS, THEMES
from a7sim.console.widgets.binocular import Binocular, ViewSettings
from a7sim.console.widgets.book import RecordedEntry
from a7sim.console.widgets.dialogs import Choose
from a7sim.console.widgets.drum_panels import DrumScrolled
from a7sim.console.widgets.eyepiece_widget import EyepieceWidget
from a7sim.console.widgets.header_footer import header_text, hints, hints_to_watch, key_labels
from a7sim.console.widgets.main_screen import WELCOME, MainScreen
from a7sim.console.widgets.playback import Playback
from a7sim.console.widgets.sketch_panel import PointClicked

SETTLING_S = 0.02
"""Interval between two early keys of a dialog, in s."""

RESUME_CHOICES = (("resume", "resume the session"), ("new", "start a new session; the old one is kept"))


class Console(MessageHandlers, Actions, App[None]):
    """Console of the instrument."""

    CSS_PATH = "app.tcss"
    TITLE = "a7sim console"
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-usual"), (140, "-wide")]  # noqa: RUF012 # as the library declares it
    VERTICAL_BREAKPOINTS = [(0, "-low"), (28, "-tall"), (44, "-high")]  # noqa: RUF012

    def __init__(self, config: ConsoleConfig) -> None:
        super().__init__()
        self.config = config
        self.utf8 = speaks_utf8()
        drawing = config.drawing or best_drawing(self.utf8, self.no_color, self.console.color_system)
        self.binocular = Binocular(ViewSettings(drawing), "•" if self.utf8 else "o")
        self.selection = ControlSelection()
        self.entries: tuple[RecordedEntry, ...] = ()
        self.presets = CounterOrigins()
        self.sketches: dict[int, dict[str, Place]] = {1: {}, 2: {}}
        self.principal_distances: dict[int, float] = {}
        self.point: str | None = None
        self.met: Connected | None = None
        self.dials: Readouts | None = None
        self.sight: ViewResult | None = None
        self.silent: ConnectionLost | None = None
        self.thread = InstrumentThread(config.connect, self._tell, config.alone)
        self.playback = Playback(config.recording, self.ask, self.show_frame) if config.recording else None
        self._by_key = actions_by_key(config.keymap, config.watching)
        self._early: deque[events.Key] | None = deque()
        self.main = MainScreen(
            self.binocular, self.key_pressed, self.utf8, config.exercise_goal or WELCOME * config.welcome, config.tasks
        )
        for theme in THEMES:
            self.register_theme(theme)
        self.theme = config.theme

    # --- the screen -----------------------------------------------------------------------------------

    def get_line_filters(self) -> Sequence[LineFilter]:
        """Return the filters of all lines, without the translation of the terminal's own colours."""
        return [each for each in super().get_line_filters() if not isinstance(each, ANSIToTruecolor)]

    def get_default_screen(self) -> Screen[Any]:
        """Return the main screen."""
        return self.main

    def get_theme_variable_defaults(self) -> dict[str, str]:
        """Return the colours that the library's themes do not have."""
        return dict(DRUMS)

    def on_main_screen_laid(self) -> None:
        """Start, resuming an earlier session if wanted."""
        self.say(f"sitting down at {self.config.where or 'the instrument'} ...")
        self.call_after_refresh(self._sit_down)
        self.set_interval(1.0, self._masthead)

    def _sit_down(self) -> None:
        resumable = self.config.resumable()
        if resumable is None:
            self.thread.start()
        else:
            self.push_screen(
                Choose("the last session", RESUME_CHOICES, resumable.about), partial(self._decided, resumable)
            )

    def _decided(self, resumable: ResumeOffer, answer: str | None) -> None:
        if answer is None:
            self.exit()
        else:
            resumable.decide(answer == "resume")
            self.thread.start()

    def on_unmount(self) -> None:
        """Close the client session."""
        self.thread.stop()

    def say(self, words: str, refused: bool = False) -> None:
        """Show a message."""
        self.main.say(words, refused)

    def _masthead(self) -> None:
        if self.met is not None and self.main.is_there:
            job = self.config.sheet.title or self.config.where
            self.main.show_header(header_text(self.met.identity, self.dials, job, self.config.time(), self.size.width))

    def next_panel(self) -> None:
        """Show the next panel at the right of a narrow screen."""
        self.main.next_panel()
        self.call_after_refresh(self.refresh_panels)

    # --- keys -----------------------------------------------------------------------------------------

    def key_pressed(self, event: events.Key) -> bool:
        """Run the action of a key; return whether it has one."""
        name = self._by_key.get(key_name(event.key, event.character))
        if self._early is not None and name not in ACTIONS_WHILE_DISCONNECTED:
            self._early.append(event)
        elif name is None:
            return False
        else:
            self.run_by_name(name)
        return True

    def press_early_keys(self) -> None:
        """Process a key pressed before the instrument answered, and the next when its effects are complete."""
        if not self._early:
            self._early = None
        elif not self._settled:
            self.set_timer(SETTLING_S, self.press_early_keys)
        else:
            event = self._early.popleft()
            name = self._by_key.get(key_name(event.key, event.character))
            if self.screen is not self.main:
                self.post_message(events.Key(event.key, event.character))
                self.set_timer(SETTLING_S, self.press_early_keys)
            else:
                if name is not None:
                    self.run_by_name(name)
                self.call_after_orders(self.press_early_keys)

    @property
    def _settled(self) -> bool:
        """Return whether a dialog, if any, is ready for a key, and has processed the last one."""
        if self.screen is self.main:
            return True
        focused = self.screen.focused
        return focused is not None and not (self.screen.message_queue_size or focused.message_queue_size)

    def forget_early_keys(self) -> None:
        """Discard the early keys: an instrument that did not answer must not move."""
        if self._early:
            self._early.clear()

    def get_system_commands(self, screen: Screen[Any]) -> Iterable[SystemCommand]:
        """Return the commands of the palette: all actions by name, and the library's own."""
        for action in actions_for(self.config.watching, self.config.recording is not None):
            keys = " ".join(key_display(key, not self.utf8) for key in self.config.keymap[action.name])
            yield SystemCommand(action.description, f"{action.group}, {keys}", partial(self.run_by_name, action.name))
        yield from super().get_system_commands(screen)

    # --- panels ---------------------------------------------------------------------------------------

    def refresh_panels(self) -> None:
        """Update readouts, selection and book."""
        met, dials = self.met, self.dials
        if met is None or dials is None or not self.main.is_there:
            return
        self.main.show(met.variant, dials, None if self.config.watching else self.selection, self.entries)
        for projector, picture in enumerate(dials.pictures, start=1):
            mark = partial(print_position, met.variant, dials, self.presets, projector)
            self.main.show_sketch(projector, picture, self.sketches[projector], mark, self.point)
        pricked = any(self.sketches.values())
        unstruck = any(not entry.struck for entry in self.entries)
        keys, magnification = key_labels(self.config.keymap, not self.utf8), self.view.magnification
        if self.config.watching:
            self.main.show_hints(
                hints_to_watch(keys, magnification, None if self.playback is None else self.playback.playing)
            )
        else:
            self.main.show_hints(hints(keys, self.selection, magnification, self.point, pricked, unstruck))
        self._masthead()

    # --- messages of widgets --------------------------------------------------------------------------

    @on(EyepieceWidget.Resized)
    def _resized(self) -> None:
        self.look()
        self.refresh_panels()

    @on(DrumScrolled)
    def _wheeled(self, event: DrumScrolled) -> None:
        if not self.reject_if_watching():
            self.wheel(event.drum, event.way)

    @on(PointClicked)
    def _pointed(self, event: PointClicked) -> None:
        if not self.reject_if_watching():
            self.approach_point(event.projector, event.point)

    @on(EyepieceWidget.Clicked)
    def _clicked(self, event: EyepieceWidget.Clicked) -> None:
        if not self.reject_if_watching():
            self.clicked(event.across, event.up)
