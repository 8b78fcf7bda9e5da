"""The panels of the console: each shows what it is given and draws only when that changes."""

from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache
from textwrap import wrap
from typing import ClassVar

from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from rich.text import Text
from textual import events
from textual.geometry import Size
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

from a7sim.console.book import Entry
from a7sim.console.dials import Dials
from a7sim.console.drums import ROLLING_FRAMES, bar, rolled
from a7sim.console.eyepiece import COLOUR_LEVELS, LEVELS, MARK, Run, window
from a7sim.console.hands import BARE, Hands
from a7sim.console.sketches import Place, Sketch, sketched
from a7sim.manual import POSITIONS_OF, Variant

ROLLING_S = 0.04
"""Between two frames of a drum that rolls."""


class Wheeled(Message):
    """The mouse wheel was turned over a drum: of an element or of X, Y, Z; forward or back."""

    def __init__(self, drum: str, way: int) -> None:
        super().__init__()
        self.drum = drum
        self.way = way


class Pointed(Message):
    """A point of a sketch was clicked."""

    def __init__(self, projector: int, point: str) -> None:
        super().__init__()
        self.projector = projector
        self.point = point


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


def _strip_of(
    row: list[Run], width: int, look: Callable[[int | None, int | None], Style], dark: Style, mark: Style
) -> Strip:
    segments = []
    room = width
    for text, ink, paper in row:
        if ink == MARK:
            segments.append(Segment(text, dark + look(None, paper) + mark))
        else:
            segments.append(Segment(text, dark if ink is None else look(ink, paper)))
        room -= len(text)
    if room > 0:
        segments.append(Segment(" " * room, dark))
    return Strip(segments, max(width, width - room))


class Panel(Widget):
    """A panel in a frame, with the styles that the drawings are made of."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "panel--word",
        "panel--faint",
        "panel--drum",
        "panel--decimals",
        "panel--hand",
        "panel--lever",
        "panel--mark",
        "panel--struck",
    }

    def __init__(self, *, id: str | None = None, classes: str = "") -> None:
        super().__init__(id=id, classes=f"panel {classes}".strip())

    def like(self, part: str) -> Style:
        """Return the style of a part."""
        return self.get_component_rich_style(f"panel--{part}", partial=True)


class Eyepiece(Widget):
    """What one eye sees: the picture about the floating mark, which never leaves the middle."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {"eyepiece--mark"}

    class Resized(Message):
        """There is another room for the picture."""

    class Clicked(Message):
        """A place of the picture was clicked: cells to the right of the mark and above it."""

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

    @property
    def cells(self) -> tuple[int, int]:
        """Columns and rows of the picture."""
        return window(self.content_size.width, self.content_size.height)

    def show(self, rows: list[list[Run]], in_colours: bool = False) -> None:
        """Draw rows of runs, if they are not those that are shown."""
        if rows == self._rows and in_colours == self._in_colours and self._strips:
            return
        self._rows, self._in_colours = rows, in_colours
        self._lay()

    def say(self, words: str) -> None:
        """Show words instead of a picture, wrapped to the room."""
        lines = wrap(words, max(8, self.content_size.width))
        self.show([[Run(line)] for line in lines])

    def _lay(self) -> None:
        width, dark = self.content_size.width, self.rich_style
        look = _red_and_cyan if self._in_colours else _grey
        mark = self.get_component_rich_style("eyepiece--mark", partial=True)
        self._strips = [_strip_of(row, width, look, dark, mark) for row in self._rows]
        self.refresh()

    def render_line(self, y: int) -> Strip:
        """Return a line of the picture on the dark of the eyepiece."""
        if y < len(self._strips):
            return self._strips[y]
        return Strip.blank(self.content_size.width, self.rich_style)

    def on_resize(self) -> None:
        """Ask for a picture of the new size."""
        self.post_message(self.Resized())

    def on_click(self, event: events.Click) -> None:
        """Tell which place of the picture was clicked."""
        columns, rows = self.cells
        offset = event.get_content_offset(self)
        if offset is not None:
            self.post_message(self.Clicked(offset.x - columns // 2, rows // 2 - offset.y))


class Counter(Panel):
    """X, Y or Z as drum digits that roll."""

    def __init__(self, axis: str) -> None:
        super().__init__(id=f"counter{axis}")
        self.axis = axis
        self.border_title = axis
        self.tooltip = f"The {axis} counter. Turn it with the mouse wheel, or with its keys."
        self.rolling = True
        self._from, self._to, self._frame = "", "", ROLLING_FRAMES

    def turn_to(self, reading: str) -> None:
        """Show another reading; a drum that is still rolling goes straight on to it."""
        if reading != self._to:
            still = self._frame >= ROLLING_FRAMES
            self._from, self._to = self._to, reading
            self._frame = 0 if self.rolling and still and self._from else ROLLING_FRAMES
            self._roll()

    def _roll(self) -> None:
        self.refresh()
        if self._frame < ROLLING_FRAMES:
            self._frame += 1
            self.set_timer(ROLLING_S, self._roll)

    def render(self) -> Text:
        """Return the digits in their windows."""
        shown = rolled(self._from, self._to, self._frame)
        width = self.content_size.width
        apart = " " if width >= 2 * len(shown) + 1 else ""
        whole, point, decimals = shown.partition(".")
        drum = apart + apart.join(whole + point) + apart
        text = Text(drum, self.like("drum"), no_wrap=True)
        text.append(apart.join(decimals) + apart, self.like("decimals"))
        padding = max(0, width - text.cell_len)
        left = Text(" " * padding, self.like("drum"))
        return left + text

    def on_mouse_scroll_up(self) -> None:
        """Turn forward."""
        self.post_message(Wheeled(self.axis, 1))

    def on_mouse_scroll_down(self) -> None:
        """Turn back."""
        self.post_message(Wheeled(self.axis, -1))


ROWS = ("kappa", "phi", "omega", "by", "bz", "c", "bx", "common_phi")


class Elements(Panel):
    """The elements of both projectors as drums; the one in hand is lit."""

    def __init__(self) -> None:
        super().__init__(id="elements", classes="-chosen")
        self.border_title = "elements"
        self.tooltip = "Orientation elements. Take one up by its key, turn it with + and - or with the mouse wheel."
        self.plain = False
        self._variant: Variant | None = None
        self._readings: Mapping[str, str] = {}
        self._hands = Hands()

    def show(self, variant: Variant, readings: Mapping[str, str], hands: Hands) -> None:
        """Show readings, and what is in hand."""
        if (variant, readings, hands) != (self._variant, self._readings, self._hands):
            anew = self._variant is not variant
            self._variant, self._readings, self._hands = variant, readings, hands
            self.border_subtitle = f"step {hands.step:g}" + (" free hand" if hands.free else "")
            self.refresh(layout=anew)

    @property
    def _names(self) -> list[str]:
        elements = self._variant.elements if self._variant else {}
        return [name for name in ROWS if name in elements or f"{name}1" in elements]

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """Return a row for the heads and one for each element."""
        return 1 + len(self._names)

    def render(self) -> Text:
        """Return the table."""
        width = self.content_size.width
        name_width = 6
        room = (width - name_width) // 2
        bar_width = room - 9 if room >= 13 else 0
        lines = [
            Text(
                " " * name_width + f"{chr(39):>7} {' ' * bar_width} {chr(34):>7}"[: width - name_width],
                self.like("faint"),
            )
        ]
        lines += [self._row(name, name_width, bar_width) for name in self._names]
        return Text("\n", no_wrap=True).join(lines)

    def _row(self, name: str, name_width: int, bar_width: int) -> Text:
        shown = "Phi" if name == "common_phi" else name
        row = Text(f"{shown:<{name_width}}", self.like("word"))
        for element in [name] if name in BARE else [f"{name}1", f"{name}2"]:
            lit = element == self._hands.element
            reading = self._readings.get(element, "")
            row.append(f">{reading:>6} " if lit else f"{reading:>7} ", self.like("hand" if lit else "drum"))
            row.append(f"{self._bar(element, bar_width)} ", self.like("faint"))
        return row

    def _bar(self, element: str, width: int) -> str:
        reading = self._readings.get(element)
        if not width or not reading or self._variant is None:
            return ""
        data = self._variant.elements[element]
        line, here = ("-", "|") if self.plain else ("─", "┃")
        return bar(float(reading), data.low, data.high, width, line, here)

    def _under(self, event: events.MouseEvent) -> str | None:
        offset = event.get_content_offset(self)
        if offset is None or not 1 <= offset.y <= len(self._names):
            return None
        name = self._names[offset.y - 1]
        room = (self.content_size.width - 6) // 2
        return name if name in BARE else f"{name}{1 if offset.x < 6 + room else 2}"

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """Turn the drum under the mouse forward."""
        self._wheeled(event, 1)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """Turn the drum under the mouse back."""
        self._wheeled(event, -1)

    def on_click(self, event: events.Click) -> None:
        """Take up the element under the mouse."""
        self._wheeled(event, 0)

    def _wheeled(self, event: events.MouseEvent, way: int) -> None:
        element = self._under(event)
        if element is not None:
            self.post_message(Wheeled(element, way))


LEVERS = {
    "dove": "Dove",
    "triangulation": "triang.",
    "diapositive": "diap.",
    "xcollar": "X collar",
    "ycollar": "Y collar",
}


class Fittings(Panel):
    """The fittings as levers with their words, the Zeiss parallelogram and the gears."""

    def __init__(self) -> None:
        super().__init__(id="fittings")
        self.border_title = "fittings"
        self.tooltip = "Levers, base and gears; l puts them over."
        self._variant: Variant | None = None
        self._dials: Dials | None = None

    def show(self, variant: Variant, dials: Dials) -> None:
        """Show how everything is fitted."""
        before = self._dials
        self._variant, self._dials = variant, dials
        if before is None or _fitted(before) != _fitted(dials):
            self.refresh()

    def render(self) -> Text:
        """Return a lever a line."""
        if self._variant is None or self._dials is None:
            return Text()
        dials = self._dials
        lines = [self._lever(LEVERS[name], POSITIONS_OF[name], at) for name, at in dials.fittings.items()]
        lines.append(self._lever("base", self._variant.base_modes, dials.base))
        gears = Text(f"{'gears':<9}", self.like("word")).append(f"Z {dials.height_gear}  plan {dials.plan_gear}")
        return Text("\n", no_wrap=True).join([*lines, gears])

    def _lever(self, name: str, positions: Sequence[str], at: str) -> Text:
        text = Text(f"{name:<9}", self.like("word"))
        both = sum(map(len, positions)) + 5 <= self.content_size.width - 9
        for position in positions if both else (at,):
            text.append(f" {position} ", self.like("lever" if position == at else "faint")).append(" ")
        return text


def _fitted(dials: Dials) -> tuple[object, ...]:
    return dials.fittings, dials.base, dials.height_gear, dials.plan_gear


class SketchPanel(Panel):
    """The print of a photograph: pricked points, and the mark."""

    def __init__(self, projector: int, id: str) -> None:
        super().__init__(id=id)
        self.projector = projector
        self.border_title = "sketch"
        self.tooltip = "Points pricked on the print, + the mark. Click one, or press g, to drive near it."
        self.dot = "·"
        self._given: tuple[Mapping[str, Place], Place | None] = ({}, None)
        self._going_to: str | None = None
        self._title = ""
        self._sketch = Sketch([], None, {})

    def show(self, picture: str, points: Mapping[str, Place], mark: Place | None, going_to: str | None) -> None:
        """Show a print's points, where the mark stands, and which point is worked at."""
        self._given = points, mark
        title = f"sketch {picture}" if picture else "no picture"
        if title != self._title:
            self._title = self.border_title = title
        self._draw(going_to)

    def on_resize(self) -> None:
        """Draw the print in the new room."""
        self._draw(self._going_to)

    def _draw(self, going_to: str | None) -> None:
        width, height = self.content_size
        if not self.display or not width or not height:
            return
        sketch = sketched(*self._given, width, height, self.dot)
        if (sketch, going_to) != (self._sketch, self._going_to):
            self._sketch, self._going_to = sketch, going_to
            self.refresh()

    def render(self) -> Text:
        """Return the sketch."""
        sketch, going_to = self._sketch, self._going_to
        text = Text("\n", no_wrap=True).join(Text(row, self.like("word")) for row in sketch.rows)
        line = self.content_size.width + 1
        if going_to is not None and going_to in sketch.points:
            column, row = sketch.points[going_to]
            text.stylize(self.like("hand"), row * line + column, row * line + column + 1)
            at = sketch.rows[row].find(going_to)
            if at >= 0:
                text.stylize(self.like("hand"), row * line + at, row * line + at + len(going_to))
        if sketch.mark is not None:
            at = sketch.mark[1] * line + sketch.mark[0]
            text.stylize(self.like("mark"), at, at + 1)
        return text

    def on_click(self, event: events.Click) -> None:
        """Tell which point was clicked."""
        offset = event.get_content_offset(self)
        point = self._sketch.nearest(offset.x, offset.y) if offset is not None else None
        if point is not None:
            self.post_message(Pointed(self.projector, point))


class Book(Panel):
    """The readings that were recorded here, the last at the bottom."""

    def __init__(self) -> None:
        super().__init__(id="book")
        self.border_title = "book"
        self.tooltip = "Recorded readings. Enter records, x strikes the last one out, n notes."
        self._entries: tuple[Entry, ...] = ()

    def show(self, entries: tuple[Entry, ...]) -> None:
        """Show the entries that there is room for."""
        if entries != self._entries:
            self._entries = entries
            self.refresh()

    def render(self) -> Text:
        """Return an entry a line."""
        room = max(1, self.content_size.height)
        if not self._entries:
            return Text("nothing is recorded yet", self.like("faint"))
        width = self.content_size.width
        lines = [
            Text(entry.as_line()[:width], self.like("struck" if entry.struck else "word"))
            for entry in self._entries[-room:]
        ]
        return Text("\n", no_wrap=True).join(lines)
