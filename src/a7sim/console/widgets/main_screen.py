"""Main screen: its panels and their layout."""

from collections.abc import Callable, Mapping, Sequence

from textual import events
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.message import Message
from textual.screen import Screen
from textual.widgets import Static

from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.console.drawing.sketch import Place
from a7sim.console.state.readouts import Readouts
from a7sim.console.state.selection import ControlSelection
from a7sim.console.widgets.binocular import Binocular
from a7sim.console.widgets.book import RecordedEntry
from a7sim.console.widgets.drum_panels import CounterPanel, ElementsPanel
from a7sim.console.widgets.header_footer import Hints, hints_line
from a7sim.console.widgets.panels import BookPanel, FittingsPanel
from a7sim.console.widgets.sketch_panel import SketchPanel
from a7sim.plotters import Variant

WELCOME = """\
Two eyes, one ground; the dot is the floating mark.
Arrows and PgUp PgDn move it; y, then + and -: by'.
l lays pictures, g goes to a point, Enter records."""

PANELS = ("elements", "fittings", "side1", "side2")
"""Panels of a narrow screen, one at a time at its right."""


class MainScreen(Screen[None]):
    """Main screen; all keys are passed to the console."""

    class Laid(Message):
        """All panels are mounted."""

    def __init__(
        self,
        binocular: Binocular,
        pressed: Callable[[events.Key], bool],
        utf8: bool,
        welcome: str,
        tasks: Callable[[], Sequence[str]] | None = None,
    ) -> None:
        super().__init__(id="bench", classes="" if utf8 else "-ascii")
        self._binocular = binocular
        self._pressed = pressed
        self._utf8 = utf8
        self._welcome = welcome
        self._tasks = tasks
        self._counters = [CounterPanel(axis) for axis in "XYZ"]
        self._sketches = [SketchPanel(n, f"{where}{n}") for where in ("side", "sketch") for n in (1, 2)]
        self._hinted: Hints = ()

    def compose(self) -> ComposeResult:
        """Compose the screen."""
        yield Static(id="masthead", markup=False)
        with Horizontal(id="upper"):
            with Vertical(id="left"):
                yield self._binocular
                with Horizontal(id="counters"):
                    yield from self._counters
            with Vertical(id="right"):
                yield ElementsPanel()
                yield FittingsPanel()
                yield from self._sketches[:2]
        with Horizontal(id="lower"):
            yield from self._sketches[2:]
            yield BookPanel()
        if self._tasks is not None:
            yield Static(id="tasks", markup=False)
        yield Static(id="progress", markup=False)
        yield Static(id="message", markup=False)
        yield Static(id="hints", markup=False)
        yield Static(id="banner", markup=False)
        if self._welcome:
            yield Static(self._welcome, id="welcome", markup=False)

    def on_mount(self) -> None:
        """Fit the panels to the terminal."""
        for counter in self._counters:
            counter.rolling = self._binocular.view.drawing is not DrawingMode.WORDS
        self.query_one(ElementsPanel).plain = not self._utf8
        for sketch in self._sketches:
            sketch.dot = "·" if self._utf8 else "."
        if self._tasks is not None:
            self.set_interval(1.0, self._show_tasks)
        self.post_message(self.Laid())

    def _show_tasks(self) -> None:
        if self._tasks is not None:
            self.query_one("#tasks", Static).update("\n".join(self._tasks()))

    def on_key(self, event: events.Key) -> None:
        """Run the action of the keymap."""
        if self._welcome:
            self._welcome = ""
            self.query_one("#welcome").remove()
        if self._pressed(event):
            event.stop()
            event.prevent_default()

    @property
    def is_there(self) -> bool:
        """Return whether the panels are mounted."""
        return self.app.is_running and self._counters[0].is_attached and self._binocular.is_there

    # --- lines ----------------------------------------------------------------------------------------

    def say(self, words: str, refused: bool = False) -> None:
        """Show a message."""
        message = self.query_one("#message", Static)
        message.update(words)
        message.set_class(refused, "-refused")

    def warn(self, words: str | None) -> None:
        """Show a banner over everything, or none."""
        banner = self.query_one("#banner", Static)
        banner.update(words or "")
        banner.set_class(words is not None, "-shown")

    def progress(self, words: str) -> None:
        """Show the progress of a recording."""
        progress = self.query_one("#progress", Static)
        progress.update(words)
        progress.set_class(True, "-shown")

    def show_header(self, words: str) -> None:
        """Show the header."""
        masthead = self.query_one("#masthead", Static)
        if str(masthead.content) != words:
            masthead.update(words)

    def show_hints(self, hints: Hints) -> None:
        """Show the available keys."""
        if hints != self._hinted:
            self._hinted = hints
            self.query_one("#hints", Static).update(hints_line(hints))

    # --- panels ---------------------------------------------------------------------------------------

    def next_panel(self) -> None:
        """Show the next panel at the right of a narrow screen."""
        at = next(index for index, name in enumerate(PANELS) if self.query_one(f"#{name}").has_class("-chosen"))
        for index, name in enumerate(PANELS):
            self.query_one(f"#{name}").set_class(index == (at + 1) % len(PANELS), "-chosen")

    def show(
        self, variant: Variant, dials: Readouts, selection: ControlSelection | None, entries: tuple[RecordedEntry, ...]
    ) -> None:
        """Show readouts, selection (None while watching), and book."""
        for counter in self._counters:
            counter.turn_to(dials.counters[counter.axis])
        self.query_one(ElementsPanel).show(variant, dials.elements, selection)
        self.query_one(FittingsPanel).show(variant, dials)
        self.query_one(BookPanel).show(entries)

    def show_sketch(
        self,
        projector: int,
        picture: str,
        points: Mapping[str, Place],
        mark: Callable[[], Place],
        point: str | None,
    ) -> None:
        """Show the sketch of a projector's picture, if there is space for it, with the mark."""
        shown = [each for each in self._sketches if each.projector == projector and each.region]
        stands = mark() if picture and shown else None
        for sketch in shown:
            sketch.show(picture, points, stands, point)
