"""The console: the screen, what it knows, and what the station tells it."""

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from rich.text import Text
from textual import events, on
from textual.app import App, ComposeResult, SystemCommand
from textual.containers import Horizontal, Vertical
from textual.message import Message
from textual.screen import Screen
from textual.timer import Timer
from textual.widgets import Static

from a7sim.console.book import Entry
from a7sim.console.deeds import Deeds
from a7sim.console.dials import Dials
from a7sim.console.eyepiece import Drawing, anaglyph, drawn, picture_size, vignetted, with_mark
from a7sim.console.hands import Hands, title
from a7sim.console.keymap import DEEDS, deeds_by_key, pressed, shown
from a7sim.console.panels import Book, Counter, Elements, Fittings, Wheeled
from a7sim.console.prints import Pointed, SketchPanel
from a7sim.console.reaching import Presets, on_print
from a7sim.console.seat import Seat, best_drawing, speaks_utf8
from a7sim.console.sketches import Place
from a7sim.console.station import Look, Met, News, Refused, Sight, Silent, Station, elapsed
from a7sim.console.themes import DRUMS, THEMES
from a7sim.console.window import Eyepiece
from a7sim.console.words import image_in_words, parallax_in_words
from a7sim.link.client import Client

FLICKER_S = 0.25

ROOMY = 100
"""Columns from which the masthead says all."""

WELCOME = """\
Two eyes, one ground; the dot is the floating mark.
Arrows and PgUp PgDn move it; y, then + and -: by'.
l lays pictures, g goes to a point, Enter records."""

PANELS = ("elements", "fittings", "side1", "side2")
"""What a narrow screen shows at its right, one at a time."""


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


@dataclass(frozen=True)
class View:
    """How the eyepieces show what they see."""

    drawing: Drawing
    magnification: float = 8.0
    eyes: tuple[int, ...] = (1, 2)
    merged: str = "side by side"


class Bench(Screen[None]):
    """The main screen; every key goes to the hands."""

    def on_key(self, event: events.Key) -> None:
        """Do what the keymap says."""
        if isinstance(self.app, Console) and self.app.key_pressed(pressed(event.key, event.character)):
            event.stop()
            event.prevent_default()


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
        self.view = View(drawing)
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
        self._by_key = deeds_by_key(seat.keymap)
        self._hinted: tuple[tuple[str, str], ...] = ()
        self._sketch_panels: list[SketchPanel] = []
        self._counters: list[Counter] = []
        self._eyes: dict[int, Eyepiece] = {}
        self._flicker: Timer | None = None
        self._flicker_eye = 1
        for theme in THEMES:
            self.register_theme(theme)
        self.theme = seat.theme

    # --- the screen -----------------------------------------------------------------------------------

    def get_default_screen(self) -> Screen[Any]:
        """Return the main screen."""
        return Bench(id="bench", classes="" if self.utf8 else "-ascii")

    def get_theme_variable_defaults(self) -> dict[str, str]:
        """Return the colours that themes of the library do not have."""
        return dict(DRUMS)

    def compose(self) -> ComposeResult:
        """Lay out the screen."""
        yield Static(id="masthead", markup=False)
        with Horizontal(id="upper"):
            with Vertical(id="left"):
                with Horizontal(id="eyes"):
                    yield Eyepiece(1, "left eye")
                    yield Eyepiece(2, "right eye")
                with Horizontal(id="counters"):
                    yield from (Counter(axis) for axis in "XYZ")
            with Vertical(id="right"):
                yield Elements()
                yield Fittings()
                yield from (SketchPanel(projector, f"side{projector}") for projector in (1, 2))
        with Horizontal(id="lower"):
            yield from (SketchPanel(projector, f"sketch{projector}") for projector in (1, 2))
            yield Book()
        if self.seat.tasks is not None:
            yield Static(id="tasks", markup=False)
        yield Static(id="message", markup=False)
        yield Static(id="hints", markup=False)
        yield Static(id="banner", markup=False)
        if self.seat.welcome:
            yield Static(WELCOME, id="welcome", markup=False)

    def on_mount(self) -> None:
        """Begin the conversation."""
        self._counters = list(self.query(Counter))
        self._eyes = {each.eye: each for each in self.query(Eyepiece)}
        for counter in self._counters:
            counter.rolling = self.view.drawing is not Drawing.WORDS
        self.query_one(Elements).plain = not self.utf8
        self._sketch_panels = list(self.query(SketchPanel))
        for sketch in self._sketch_panels:
            sketch.dot = "·" if self.utf8 else "."
        self.say(f"sitting down at {self.seat.where or 'the instrument'} ...")
        self.call_after_refresh(self.station.start)
        self.set_interval(1.0, self._masthead)
        if self.seat.tasks is not None:
            self.set_interval(1.0, self._show_tasks)

    def on_unmount(self) -> None:
        """End the conversation."""
        self.station.leave()

    def say(self, words: str, refused: bool = False) -> None:
        """Show a message."""
        message = self.query_one("#message", Static)
        message.update(words)
        message.set_class(refused, "-refused")

    def _masthead(self) -> None:
        if self.met is None or not self._there:
            return
        dials, identity = self.dials, self.met.identity
        lying = " | ".join(name or "-" for name in dials.pictures) if dials else ""
        parts = [
            f"Wild {identity.model}  no. {identity.serial}",
            self.seat.sheet.title or self.seat.where,
            lying,
            f"base {dials.base}" if dials else "",
            elapsed(self.seat.time()),
        ]
        roomy = self.size.width >= ROOMY
        text = ("    " if roomy else "  ").join(part for part in parts if part) + (
            " at the instrument" if roomy else ""
        )
        masthead = self.main.query_one("#masthead", Static)
        if str(masthead.content) != text:
            masthead.update(text)

    def _show_tasks(self) -> None:
        if self.seat.tasks is not None and self._there:
            self.main.query_one("#tasks", Static).update("\n".join(self.seat.tasks()))

    @property
    def _there(self) -> bool:
        return bool(self._counters) and self._counters[0].is_attached

    @property
    def main(self) -> Screen[Any]:
        """The main screen, whatever lies over it."""
        return self.screen_stack[0]

    def next_panel(self) -> None:
        """Show the next panel at the right of a narrow screen."""
        at = next(index for index, name in enumerate(PANELS) if self.main.query_one(f"#{name}").has_class("-chosen"))
        for index, name in enumerate(PANELS):
            self.main.query_one(f"#{name}").set_class(index == (at + 1) % len(PANELS), "-chosen")
        self.call_after_refresh(self.refresh_panels)

    # --- keys -----------------------------------------------------------------------------------------

    def key_pressed(self, key: str) -> bool:
        """Do the deed of a key; return whether it has one."""
        for welcome in self.query("#welcome"):
            welcome.remove()
        name = self._by_key.get(key)
        if name is None:
            return False
        self.do(name)
        return True

    def get_system_commands(self, screen: Screen[Any]) -> Iterable[SystemCommand]:
        """Return what the palette lists: every deed by its name, and the library's own."""
        for deed in DEEDS:
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
        if self._there:
            done.then()

    def on_told(self, told: Told) -> None:
        """Show what the station tells, unless the screen is gone."""
        if not self._there:
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
                self.say(" · ".join(in_words(error) for error in told.news.errors), refused=True)
            case Silent():
                self._lose(told.news)

    def _meet(self, met: Met) -> None:
        self.met = met
        self.hands = self.hands.on(met.variant)
        if self.silent is not None:
            self.silent = None
            self.say("the instrument answers again")
        else:
            self.say("l lays pictures; ? is help")
        self.main.query_one("#banner").set_class(False, "-shown")
        self.call_after_refresh(self.look)

    def _lose(self, silent: Silent) -> None:
        if silent != self.silent:
            self.silent = silent
            banner = self.main.query_one("#banner", Static)
            banner.update(f"The instrument does not answer: {silent.why}. Trying again every second; q leaves.")
            banner.set_class(True, "-shown")

    def _read(self, dials: Dials) -> None:
        before, self.dials = self.dials, dials
        for projector, picture in enumerate(dials.pictures, start=1):
            if before is None or before.pictures[projector - 1] != picture:
                self.ask(partial(sketch_of, projector, picture), partial(self._sketch, projector))
        self.refresh_panels()

    def _sketch(self, projector: int, points: dict[str, Place]) -> None:
        self.sketches[projector] = points
        self.refresh_panels()

    def refresh_panels(self) -> None:
        """Show the dials, the hands and the book as they are."""
        met, dials = self.met, self.dials
        if met is None or dials is None or not self._there:
            return
        main = self.main
        for counter in self._counters:
            counter.turn_to(dials.counters[counter.axis])
        main.query_one(Elements).show(met.variant, dials.elements, self.hands)
        main.query_one(Fittings).show(met.variant, dials)
        self._show_sketches(met, dials)
        main.query_one(Book).show(self.entries)
        self._hints()
        self._masthead()

    def _show_sketches(self, met: Met, dials: Dials) -> None:
        for projector, picture in enumerate(dials.pictures, start=1):
            shown = [each for each in self._sketch_panels if each.projector == projector and each.region]
            mark = on_print(met.variant, dials, self.presets, projector) if picture and shown else None
            for sketch in shown:
                sketch.show(picture, self.sketches[projector], mark, self.point)

    def _hints(self) -> None:
        """Show which keys do something now."""
        keys = {name: shown(keys[0], not self.utf8) for name, keys in self.seat.keymap.items()}
        arrows = keys["x_down"] + keys["x_up"] + keys["y_down"] + keys["y_up"]
        pricked = any(self.sketches.values())
        unstruck = any(not entry.struck for entry in self.entries)
        offered = (
            (True, keys["help"], "help"),
            (True, keys["bench"], "bench"),
            (True, arrows if len(arrows) == 4 else f"{keys['x_up']} {keys['y_up']} ...", "X Y"),
            (True, f"{keys['z_up']} {keys['z_down']}", "Z"),
            (True, f"{keys['turn_up']} {keys['turn_down']}", title(self.hands.element)),
            (True, f"{keys['finer']} {keys['coarser']}", f"step {self.hands.step:g}"),
            (pricked, keys["go_to"], "go to"),
            (pricked, keys["record"], f"record {self.point}" if self.point else "record"),
            (pricked, keys["magnify"], f"x{self.view.magnification:g}"),
            (unstruck, keys["strike"], "strike out"),
            (self.hands.free, keys["free_hand"], "back to the wheels"),
        )
        words = tuple((key, word) for applies, key, word in offered if applies)
        if words != self._hinted:
            self._hinted = words
            text = Text("  ", no_wrap=True).join(
                Text(key, "bold").append(f" {word}", "not bold") for key, word in words
            )
            self.main.query_one("#hints", Static).update(text)

    # --- eyepieces ------------------------------------------------------------------------------------

    def look(self) -> None:
        """Ask for the pictures that the eyepieces have room for."""
        if self.met is None or not self._there:
            return
        view = self.view
        one = view.merged != "side by side" and view.drawing is Drawing.HALVES
        for eyepiece in self._eyes.values():
            closed = eyepiece.eye == 2 if one else eyepiece.eye not in view.eyes
            eyepiece.set_class(closed, "-closed")
            eyepiece.border_title = view.merged if one else ("left eye", "right eye")[eyepiece.eye - 1]
            eyepiece.border_subtitle = f"x{view.magnification:g}"
        self.call_after_refresh(self._ask_for_pictures, one)

    def _ask_for_pictures(self, one: bool) -> None:
        view = self.view
        open_ones = [each for each in self._eyes.values() if not each.has_class("-closed")]
        cells = min((each.cells for each in open_ones), default=(0, 0))
        columns, rows = picture_size(view.drawing, *cells)
        eyes = (1, 2) if one else view.eyes
        point = self.point if view.drawing is Drawing.WORDS else None
        self.station.look(Look(columns, rows, view.magnification, eyes, point))

    @on(Eyepiece.Resized)
    def _resized(self) -> None:
        self.look()
        self.refresh_panels()

    def draw(self) -> None:
        """Draw what the eyes see."""
        sight, view = self.sight, self.view
        if sight is None or not self._there:
            return
        if view.drawing is Drawing.WORDS:
            self._in_words(sight)
            return
        mark = "•" if self.utf8 else "o"
        pictures = {eye: vignetted(greys) for eye, greys in sight.pictures.items()}
        if view.merged == "anaglyph" and view.drawing is Drawing.HALVES and len(pictures) == 2:
            both = anaglyph(pictures[1], pictures[2])
            self._eyes[1].show(with_mark(both, mark), in_colours=True)
            return
        if view.merged == "flicker" and view.drawing is Drawing.HALVES and len(pictures) == 2:
            pictures = {1: pictures[self._flicker_eye]}
        for eye, greys in pictures.items():
            rows = with_mark(drawn(view.drawing, greys), mark)
            self._eyes[eye].show(rows)

    def _in_words(self, sight: Sight) -> None:
        acuity = self.seat.acuity_um
        said = [f"{self.point or 'no point'}: {image_in_words(sight.seen.get(eye), acuity)}" for eye in (1, 2)]
        for eye, words in zip((1, 2), said, strict=True):
            self._eyes[eye].say(words if self.point else "go to a point first")
        left, right = sight.seen.get(1), sight.seen.get(2)
        if self.point:
            both = (left[0] - right[0], left[1] - right[1]) if left and right else None
            self.say(f"{self.point}: {parallax_in_words(both, acuity)}")

    def set_view(self, **changes: Any) -> None:
        """Change how the eyepieces show what they see."""
        self.view = replace(self.view, **changes)
        if self._flicker is not None:
            self._flicker.stop()
            self._flicker = None
        if self.view.merged == "flicker":
            self._flicker = self.set_interval(FLICKER_S, self._other_eye)
        self.look()
        self.draw()
        self.refresh_panels()

    def _other_eye(self) -> None:
        self._flicker_eye = 3 - self._flicker_eye
        self.draw()

    # --- the mouse ------------------------------------------------------------------------------------

    @on(Wheeled)
    def _wheeled(self, event: Wheeled) -> None:
        self.wheel(event.drum, event.way)

    @on(Pointed)
    def _pointed(self, event: Pointed) -> None:
        self.drive_near(event.projector, event.point)

    @on(Eyepiece.Clicked)
    def _clicked(self, event: Eyepiece.Clicked) -> None:
        self.clicked(event.across, event.up)


def sketch_of(projector: int, picture: str, client: Client) -> dict[str, Place]:
    """Ask for the points that are pricked on the print in a projector."""
    if not picture:
        return {}
    fields = client.fields(f"PHOT{projector}:SKET?")
    places = zip(map(float, fields[1::3]), map(float, fields[2::3]), strict=True)
    return dict(zip(fields[0::3], places, strict=True))


def in_words(error: str) -> str:
    """Return an entry of the instrument's error queue as people read it, without number and header."""
    _, _, text = error.partition(",")
    message, _, detail = text.strip().strip('"').partition(";")
    return re.sub(r"^[A-Z]+[A-Z0-9:?]*( \S+)?: ", "", detail) or message
