"""Widget of an eyepiece: runs of grey."""

from functools import lru_cache
from textwrap import wrap
from typing import ClassVar

from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from a7sim.console.drawing.rasterize import COLOUR_LEVELS, LEVELS, MARK, Run, window


@lru_cache(maxsize=4096)
def _grey(ink: int | None, paper: int | None) -> Style:
    return Style(color=_of_level(ink), bgcolor=_of_level(paper))


@lru_cache(maxsize=LEVELS + 1)
def _of_level(level: int | None) -> Color | None:
    return None if level is None else Color.from_rgb(*(level * 255 // (LEVELS - 1),) * 3)


@lru_cache(maxsize=8192)
def _red_and_cyan(ink: int | None, paper: int | None) -> Style:
    return Style(color=_of_both(ink), bgcolor=_of_both(paper))


def _of_both(level: int | None) -> Color | None:
    if level is None:
        return None
    left, right = (each * 255 // (COLOUR_LEVELS - 1) for each in divmod(level, COLOUR_LEVELS))
    return Color.from_rgb(left, right, right)


@lru_cache(maxsize=16384)
def _segment(run: Run, in_colours: bool) -> Segment:
    look = _red_and_cyan if in_colours else _grey
    return Segment(run.text, look(run.ink, run.paper))


def _strip_of(row: list[Run], width: int, in_colours: bool, dark: Style, mark: Style) -> Strip:
    segments = [_segment(run, in_colours) if run.ink is not None else Segment(run.text, dark) for run in row]
    for at, run in enumerate(row):
        if run.ink == MARK:
            look = _red_and_cyan if in_colours else _grey
            segments[at] = Segment(run.text, dark + look(None, run.paper) + mark)
    drawn = sum(len(run.text) for run in row)
    if drawn < width:
        segments.append(Segment(" " * (width - drawn), dark))
    return Strip(segments, max(width, drawn))


class EyepieceWidget(Widget):
    """View of one eye: the picture around the floating mark, which is always in the middle."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {"eyepiece--mark"}

    class Resized(Message):
        """The size of the picture has changed."""

    class Clicked(Message):
        """A position of the picture was clicked: cells to the right of the mark and above it."""

        def __init__(self, across: int, up: int) -> None:
            super().__init__()
            self.across = across
            self.up = up

    def __init__(self, eye: int, name: str) -> None:
        super().__init__(id=f"eye{eye}")
        self.eye = eye
        self.border_title = name
        self.tooltip = (
            "What this eye sees about the floating mark. m, M: magnify. e: one eye or both. v: another drawing."
        )
        self._strips: list[Strip] = []
        self._rows: list[list[Run]] = []
        self._in_colours = False
        self._styles_now: tuple[Style, Style] | None = None

    def notify_style_update(self) -> None:
        """Discard rows drawn in the colours of another theme."""
        super().notify_style_update()
        self._styles_now = None
        self._strips = []

    @property
    def cells(self) -> tuple[int, int]:
        """Columns and rows of the picture."""
        return window(self.content_size.width, self.content_size.height)

    def show(self, rows: list[list[Run]], in_colours: bool = False) -> None:
        """Draw rows of runs if they differ from the shown ones."""
        if rows == self._rows and in_colours == self._in_colours and self._strips:
            return
        self._rows, self._in_colours, self._strips = rows, in_colours, []
        self.refresh()

    def say(self, words: str) -> None:
        """Show words instead of a picture, wrapped to the size."""
        lines = wrap(words, max(8, self.content_size.width))
        self.show([[Run(line)] for line in lines])

    def _drawn(self) -> list[Strip]:
        if self._styles_now is None:
            self._styles_now = self.rich_style, self.get_component_rich_style("eyepiece--mark", partial=True)
        width = self.content_size.width
        return [_strip_of(row, width, self._in_colours, *self._styles_now) for row in self._rows]

    def render_line(self, y: int) -> Strip:
        """Return a line of the picture on the dark background."""
        if len(self._strips) != len(self._rows):
            self._strips = self._drawn()
        if y < len(self._strips):
            return self._strips[y]
        return Strip.blank(self.content_size.width, self.rich_style)

    def on_resize(self) -> None:
        """Request a picture of the new size."""
        self.post_message(self.Resized())

    def on_click(self, event: events.Click) -> None:
        """Report the clicked position of the picture."""
        columns, rows = self.cells
        offset = event.get_content_offset(self)
        if offset is not None:
            self.post_message(self.Clicked(offset.x - columns // 2, rows // 2 - offset.y))
