"""Panels of counters and elements as drums, also operated by the mouse."""

from collections.abc import Mapping
from time import monotonic

from rich.segment import Segment
from rich.text import Text
from textual import events
from textual.geometry import Size
from textual.message import Message
from textual.strip import Strip
from textual.timer import Timer

from a7sim.console.drawing.drums import ROLLING_FRAMES, bar, rolling_frame
from a7sim.console.state.selection import SIDELESS_ELEMENTS, ControlSelection
from a7sim.console.widgets.panels import Panel
from a7sim.plotters import Variant

ROLLING_S = 0.04
"""Interval between two frames of a rolling drum."""

HURRIED_S = 0.15
"""A drum that is turned again within this time does not roll."""


class DrumScrolled(Message):
    """Turn of the mouse wheel over a drum: an element or X, Y, Z; forward or back."""

    def __init__(self, drum: str, way: int) -> None:
        super().__init__()
        self.drum = drum
        self.way = way


class CounterPanel(Panel):
    """X, Y or Z as rolling drum digits."""

    def __init__(self, axis: str) -> None:
        super().__init__(id=f"counter{axis}")
        self.axis = axis
        self.border_title = axis
        self.tooltip = f"The {axis} counter. Turn it with the mouse wheel, or with its keys."
        self.rolling = True
        self._from, self._to, self._frame = "", "", ROLLING_FRAMES
        self._turned_at = -HURRIED_S
        self._next: Timer | None = None

    def turn_to(self, reading: str) -> None:
        """Show another reading; a continuously turned drum does not roll."""
        if reading != self._to:
            now, before = monotonic(), self._turned_at
            rolls = self.rolling and self._to and now - before >= HURRIED_S
            self._from, self._to, self._turned_at = self._to, reading, now
            self._frame = 0 if rolls else ROLLING_FRAMES
            if self._next is not None:
                self._next.stop()
            self._roll()

    def _roll(self) -> None:
        self.refresh()
        self._next = None
        if self._frame < ROLLING_FRAMES:
            self._frame += 1
            self._next = self.set_timer(ROLLING_S, self._roll)

    def render_line(self, y: int) -> Strip:
        """Return the digits in their windows."""
        shown = rolling_frame(self._from, self._to, self._frame)
        width = self.content_size.width
        apart = " " if width >= 2 * len(shown) + 1 else ""
        whole, point, decimals = shown.partition(".")
        drum = apart + apart.join(whole + point) + apart
        fine = apart.join(decimals) + apart
        padding = " " * (width - len(drum) - len(fine))
        digits = Segment(padding + drum, self.like("drum")), Segment(fine, self.like("decimals"))
        return Strip(digits, len(padding + drum + fine))

    def on_mouse_scroll_up(self) -> None:
        """Turn forward."""
        self.post_message(DrumScrolled(self.axis, 1))

    def on_mouse_scroll_down(self) -> None:
        """Turn back."""
        self.post_message(DrumScrolled(self.axis, -1))


ROWS = ("kappa", "phi", "omega", "by", "bz", "c", "bx", "common_phi")


class ElementsPanel(Panel):
    """Elements of both projectors as drums; the selected one is highlighted."""

    def __init__(self) -> None:
        super().__init__(id="elements", classes="-chosen")
        self.border_title = "elements"
        self.tooltip = "Orientation elements. Take one up by its key, turn it with + and - or with the mouse wheel."
        self.plain = False
        self._variant: Variant | None = None
        self._readings: Mapping[str, str] = {}
        self._selection: ControlSelection | None = None

    def show(self, variant: Variant, readings: Mapping[str, str], selection: ControlSelection | None) -> None:
        """Show readings and the selection, None while watching."""
        if (variant, readings, selection) != (self._variant, self._readings, self._selection):
            anew = self._variant is not variant
            self._variant, self._readings, self._selection = variant, readings, selection
            free = " free hand" if selection and selection.free else ""
            self.border_subtitle = f"step {selection.step:g}{free}" if selection else "hands off"
            self.refresh(layout=anew)

    @property
    def _names(self) -> list[str]:
        elements = self._variant.elements if self._variant else {}
        return [name for name in ROWS if name in elements or f"{name}1" in elements]

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """Return one row for the headings and one for each element."""
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
        for element in [name] if name in SIDELESS_ELEMENTS else [f"{name}1", f"{name}2"]:
            lit = self._selection is not None and element == self._selection.element
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
        return name if name in SIDELESS_ELEMENTS else f"{name}{1 if offset.x < 6 + room else 2}"

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """Turn the drum under the mouse forward."""
        self._wheeled(event, 1)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """Turn the drum under the mouse back."""
        self._wheeled(event, -1)

    def on_click(self, event: events.Click) -> None:
        """Select the element under the mouse."""
        self._wheeled(event, 0)

    def _wheeled(self, event: events.MouseEvent, way: int) -> None:
        element = self._under(event)
        if element is not None:
            self.post_message(DrumScrolled(element, way))
