"""Panel of a print: the sketch of a photograph, clickable for driving near a point."""

from collections.abc import Mapping

from rich.text import Text
from textual import events
from textual.message import Message

from a7sim.console.drawing.sketch import Place, SketchGrid, draw_points, overlay_mark
from a7sim.console.widgets.panels import Panel


class PointClicked(Message):
    """A point of a sketch was clicked."""

    def __init__(self, projector: int, point: str) -> None:
        super().__init__()
        self.projector = projector
        self.point = point


class SketchPanel(Panel):
    """Print of a photograph: pricked points, and the mark."""

    def __init__(self, projector: int, id: str) -> None:
        super().__init__(id=id)
        self.projector = projector
        self.border_title = "sketch"
        self.tooltip = "Points pricked on the print, + the mark. Click one, or press g, to drive near it."
        self.dot = "·"
        self._given: tuple[Mapping[str, Place], Place | None] = ({}, None)
        self._going_to: str | None = None
        self._title = ""
        self._sketch = SketchGrid([], None, {})
        self._pricked: tuple[object, SketchGrid] = (None, self._sketch)

    def show(self, picture: str, points: Mapping[str, Place], mark: Place | None, going_to: str | None) -> None:
        """Show a print's points, the mark, and the current point."""
        self._given = points, mark
        title = f"sketch {picture}" if picture else "no picture"
        if title != self._title:
            self._title = self.border_title = title
        self._draw(going_to)

    def on_resize(self) -> None:
        """Redraw the print in the new size."""
        self._draw(self._going_to)

    def _draw(self, going_to: str | None) -> None:
        width, height = self.content_size
        if not self.display or not width or not height:
            return
        points, mark = self._given
        if self._pricked[0] != (points, width, height):
            self._pricked = (points, width, height), draw_points(points, width, height, self.dot)
        sketch = overlay_mark(self._pricked[1], mark, width, height)
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
        """Report the clicked point."""
        offset = event.get_content_offset(self)
        point = self._sketch.nearest(offset.x, offset.y) if offset is not None else None
        if point is not None:
            self.post_message(PointClicked(self.projector, point))
