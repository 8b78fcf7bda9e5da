"""The console: the screen, what it knows, and what the station tells it."""

from collections import deque
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

from textual import events, on
from textual.app import App, SystemCommand
from textual.message import Message
from textual.screen import Screen

from a7sim.console.binocular import Binocular, View
from a7sim.console.book import Entry, read_book
from a7sim.console.deeds import BEFORE_ANYTHING_ANSWERS, Deeds
from a7sim.console.dialogs import Choose
from a7sim.console.dials import Dials
from a7sim.console.drum_panels import Wheeled
from a7sim.console.front import Front
from a7sim.console.hands import Hands
from a7sim.console.keymap import deeds_by_key, deeds_of, pressed, shown
from a7sim.console.margins import hints, hints_to_watch, keys_shown, masthead
from a7sim.console.news import Met, News, Refused, Sight, Silent
from a7sim.console.playback import TICK_S, Playback
from a7sim.console.prints import Pointed
from a7sim.console.reaching import Presets, on_print, sketch_of
from a7sim.console.recalling import recalled
from a7sim.console.seat import Resumable, Seat, best_drawing, speaks_utf8
from a7sim.console.sketches import Place
from a7sim.console.station import Station
from a7sim.console.themes import DRUMS, THEMES
from a7sim.console.window import Eyepiece
from a7sim.console.words import error_in_words
from a7sim.link.client import Client


class Told(Message):
    """The station tells something."""

    def __init__(self, news: News) -> None:
        super().__init__()
        self.news = news


class Done(Message):
    """Something that was asked has been answered: what is to be done with it."""

    def __init__(self, then: Callable[[], None]) -> None:
        super().__init__()
        self.then = then


GO_ON = (("go_on", "go on where it stood"), ("anew", "begin anew; the old session is kept"))


class Console(Deeds, App[None]):
    """The instrument for a person."""

    CSS_PATH = "app.tcss"
    TITLE = "a7sim console"
    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (100, "-usual"), (140, "-wide")]  # noqa: RUF012 # as the library declares it
    VERTICAL_BREAKPOINTS = [(0, "-low"), (28, "-tall"), (44, "-high")]  # noqa: RUF012

    def __init__(self, seat: Seat) -> None:
        super().__init__()
        self.seat = seat
        self.utf8 = speaks_utf8()
        drawing = seat.drawing or best_drawing(self.utf8, self.no_color, self.console.color_system)
        self.binocular = Binocular(View(drawing), "•" if self.utf8 else "o")
        self.hands = Hands()
        self.entries: tuple[Entry, ...] = ()
        self.presets = Presets()
        self.sketches: dict[int, dict[str, Place]] = {1: {}, 2: {}}
        self.principal_distances: dict[int, float] = {}
        self.point: str | None = None
        self.met: Met | None = None
        self.dials: Dials | None = None
        self.sight: Sight | None = None
        self.silent: Silent | None = None
        self.station = Station(seat.connect, self._tell, seat.alone)
        self.playback = Playback(seat.film, self.ask, self.show_frame) if seat.film else None
        self._by_key = deeds_by_key(seat.keymap, seat.watching)
        self._early: deque[events.Key] | None = deque()
        self.main = Front(self.binocular, self.key_pressed, self.utf8, seat.welcome)
        for theme in THEMES:
            self.register_theme(theme)
        self.theme = seat.theme

    # --- the screen -----------------------------------------------------------------------------------

    def get_default_screen(self) -> Screen[Any]:
        """Return the main screen."""
        return self.main

    def get_theme_variable_defaults(self) -> dict[str, str]:
        """Return the colours that themes of the library do not have."""
        return dict(DRUMS)

    def on_front_laid(self) -> None:
        """Sit down, at the session that was left if that is wanted."""
        self.say(f"sitting down at {self.seat.where or 'the instrument'} ...")
        self.call_after_refresh(self._sit_down)
        self.set_interval(1.0, self._masthead)

    def _sit_down(self) -> None:
        resumable = self.seat.resumable()
        if resumable is None:
            self.station.start()
        else:
            self.push_screen(Choose("the last session", GO_ON, resumable.about), partial(self._decided, resumable))

    def _decided(self, resumable: Resumable, answer: str | None) -> None:
        if answer is None:
            self.exit()
        else:
            resumable.decide(answer == "go_on")
            self.station.start()

    def on_unmount(self) -> None:
        """End the conversation."""
        self.station.leave()

    def say(self, words: str, refused: bool = False) -> None:
        """Show a message."""
        self.main.say(words, refused)

    def _masthead(self) -> None:
        if self.met is not None and self.main.is_there:
            job = self.seat.sheet.title or self.seat.where
            self.main.head(masthead(self.met.identity, self.dials, job, self.seat.time(), self.size.width))

    def next_panel(self) -> None:
        """Show the next panel at the right of a narrow screen."""
        self.main.next_panel()
        self.call_after_refresh(self.refresh_panels)

    # --- keys -----------------------------------------------------------------------------------------

    def key_pressed(self, event: events.Key) -> bool:
        """Do the deed of a key; return whether it has one."""
        name = self._by_key.get(pressed(event.key, event.character))
        if self._early is not None and name not in BEFORE_ANYTHING_ANSWERS:
            self._early.append(event)
        elif name is None:
            return False
        else:
            self.do(name)
        return True

    def _press_early(self) -> None:
        """Press a key that was pressed before anything answered, and the next when all is done that came of it."""
        if not self._early:
            self._early = None
            return
        event = self._early.popleft()
        name = self._by_key.get(pressed(event.key, event.character))
        if self.screen is not self.main:
            self.post_message(events.Key(event.key, event.character))
        elif name is not None:
            self.do(name)
        self.afterwards(self._press_early)

    def get_system_commands(self, screen: Screen[Any]) -> Iterable[SystemCommand]:
        """Return what the palette lists: every deed by its name, and the library's own."""
        for deed in deeds_of(self.seat.watching):
            keys = " ".join(shown(key, not self.utf8) for key in self.seat.keymap[deed.name])
            yield SystemCommand(deed.about, f"{deed.group}, {keys}", partial(self.do, deed.name))
        yield from super().get_system_commands(screen)

    # --- news -----------------------------------------------------------------------------------------

    def ask(self, work: Callable[[Client], Any], then: Callable[[Any], None]) -> None:
        """Have something asked in the station's thread, and go on with the answer in the screen's."""

        def order(client: Client) -> None:
            answer = work(client)
            self.post_message(Done(partial(then, answer)))

        self.station.order(order)

    def afterwards(self, then: Callable[[], None]) -> None:
        """Go on when all that was ordered so far is said, and what came of it is known."""
        self.ask(lambda _: None, lambda _: then())

    def _tell(self, news: News) -> None:
        self.post_message(Told(news))

    def on_done(self, done: Done) -> None:
        """Go on with an answer, unless the screen is gone."""
        if self.main.is_there:
            done.then()

    def on_told(self, told: Told) -> None:
        """Show what the station tells, unless the screen is gone."""
        if not self.main.is_there:
            return
        match told.news:
            case Met():
                self._meet(told.news)
            case Dials():
                self._read(told.news)
            case Sight():
                self.sight = told.news
                self.draw()
            case Refused():
                self.say(" · ".join(error_in_words(error) for error in told.news.errors), refused=True)
            case Silent():
                self._lose(told.news)

    def _meet(self, met: Met) -> None:
        first = self.met is None
        self.met = met
        self.hands = self.hands.on(met.variant)
        if self.silent is not None:
            self.silent = None
            self.say("the instrument answers again")
        else:
            self.say(self.seat.greeting() or "l lays pictures; ? is help")
        if first:
            self._begin(met)
        self.main.warn(None)
        self.call_after_refresh(self.look)

    def _begin(self, met: Met) -> None:
        """Take up what was there before anybody sat down here."""
        past = self.seat.past
        self.ask(lambda _: recalled(met.variant, past()), self._recall)
        if self.playback is not None:
            self.playback.go_to(0)
            self.set_interval(TICK_S, self.playback.tick)

    def _recall(self, presets: Presets) -> None:
        self.presets = presets

    def _lose(self, silent: Silent) -> None:
        if silent != self.silent:
            self.silent = silent
            if self._early:
                self._early.clear()
            if self.playback is not None:
                self.playback.interrupted()
            self.main.warn(f"The instrument does not answer: {silent.why}. Trying again every second; q leaves.")

    def _read(self, dials: Dials) -> None:
        before, self.dials = self.dials, dials
        for projector, picture in enumerate(dials.pictures, start=1):
            if before is None or before.pictures[projector - 1] != picture:
                self.ask(partial(sketch_of, projector, picture), partial(self._sketch, projector))
        if self.seat.watching or (before is None and self.seat.alone):
            self._keep_book(dials)
        self.refresh_panels()
        if before is None:
            self._press_early()

    def _keep_book(self, dials: Dials) -> None:
        """Have the book as the recorder has it."""
        if (dials.records, dials.struck) != (len(self.entries), sum(entry.struck for entry in self.entries)):
            self.ask(partial(read_book, records=dials.records), self._open_book)

    def _open_book(self, entries: tuple[Entry, ...]) -> None:
        self.entries = entries
        self.refresh_panels()

    def _sketch(self, projector: int, points: dict[str, Place]) -> None:
        self.sketches[projector] = points
        self.refresh_panels()

    def refresh_panels(self) -> None:
        """Show the dials, the hands and the book as they are."""
        met, dials = self.met, self.dials
        if met is None or dials is None or not self.main.is_there:
            return
        self.main.show(met.variant, dials, None if self.seat.watching else self.hands, self.entries)
        for projector, picture in enumerate(dials.pictures, start=1):
            mark = partial(on_print, met.variant, dials, self.presets, projector)
            self.main.show_sketch(projector, picture, self.sketches[projector], mark, self.point)
        pricked = any(self.sketches.values())
        unstruck = any(not entry.struck for entry in self.entries)
        keys, magnification = keys_shown(self.seat.keymap, not self.utf8), self.view.magnification
        if self.seat.watching:
            self.main.hint(
                hints_to_watch(keys, magnification, None if self.playback is None else self.playback.playing)
            )
        else:
            self.main.hint(hints(keys, self.hands, magnification, self.point, pricked, unstruck))
        self._masthead()

    # --- what widgets tell ---------------------------------------------------------------------------

    @on(Eyepiece.Resized)
    def _resized(self) -> None:
        self.look()
        self.refresh_panels()

    @on(Wheeled)
    def _wheeled(self, event: Wheeled) -> None:
        if not self.hands_off():
            self.wheel(event.drum, event.way)

    @on(Pointed)
    def _pointed(self, event: Pointed) -> None:
        if not self.hands_off():
            self.drive_near(event.projector, event.point)

    @on(Eyepiece.Clicked)
    def _clicked(self, event: Eyepiece.Clicked) -> None:
        if not self.hands_off():
            self.clicked(event.across, event.up)
