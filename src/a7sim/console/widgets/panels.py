"""Panels of the console; each is redrawn only when its contents change."""

from collections.abc import Sequence
from typing import ClassVar

from rich.style import Style
from rich.text import Text
from textual.widget import Widget

from a7sim.console.state.readouts import Readouts
from a7sim.console.widgets.book import RecordedEntry
from a7sim.plotters import POSITIONS_OF, Variant


class Panel(Widget):
    """Panel in a frame, with the styles of the drawings."""

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
        self._likes: dict[str, Style] = {}

    def like(self, part: str) -> Style:
        """Return the style of a part."""
        if part not in self._likes:
            self._likes[part] = self.get_component_rich_style(f"panel--{part}", partial=True)
        return self._likes[part]

    def notify_style_update(self) -> None:
        """Discard the colours of another theme."""
        super().notify_style_update()
        self._likes.clear()


FITTING_ROWS = {
    "dove": "Dove",
    "triangulation": "triang.",
    "diapositive": "diap.",
    "xcollar": "X collar",
    "ycollar": "Y collar",
}


class FittingsPanel(Panel):
    """Fittings as levers with their positions, the Zeiss parallelogram and the gears."""

    def __init__(self) -> None:
        super().__init__(id="fittings")
        self.border_title = "fittings"
        self.tooltip = "Levers, base and gears; l puts them over."
        self._variant: Variant | None = None
        self._dials: Readouts | None = None

    def show(self, variant: Variant, dials: Readouts) -> None:
        """Show all fittings."""
        before = self._dials
        self._variant, self._dials = variant, dials
        if before is None or _fitted(before) != _fitted(dials):
            self.refresh()

    def render(self) -> Text:
        """Return one fitting per line."""
        if self._variant is None or self._dials is None:
            return Text()
        dials = self._dials
        lines = [self._lever(FITTING_ROWS[name], POSITIONS_OF[name], at) for name, at in dials.fittings.items()]
        lines.append(self._lever("base", self._variant.base_modes, dials.base))
        gears = Text(f"{'gears':<9}", self.like("word")).append(f"Z {dials.height_gear}  plan {dials.plan_gear}")
        return Text("\n", no_wrap=True).join([*lines, gears])

    def _lever(self, name: str, positions: Sequence[str], at: str) -> Text:
        text = Text(f"{name:<9}", self.like("word"))
        both = sum(map(len, positions)) + 5 <= self.content_size.width - 9
        for position in positions if both else (at,):
            text.append(f" {position} ", self.like("lever" if position == at else "faint")).append(" ")
        return text


def _fitted(dials: Readouts) -> tuple[object, ...]:
    return dials.fittings, dials.base, dials.height_gear, dials.plan_gear


class BookPanel(Panel):
    """Recorded readings, the last at the bottom."""

    def __init__(self) -> None:
        super().__init__(id="book")
        self.border_title = "book"
        self.tooltip = "Recorded readings. Enter records, x strikes the last one out, n notes."
        self._entries: tuple[RecordedEntry, ...] = ()

    def show(self, entries: tuple[RecordedEntry, ...]) -> None:
        """Show the entries that fit."""
        if entries != self._entries:
            self._entries = entries
            self.refresh()

    def render(self) -> Text:
        """Return one entry per line."""
        room = max(1, self.content_size.height)
        if not self._entries:
            return Text("nothing is recorded yet", self.like("faint"))
        width = self.content_size.width
        lines = [
            Text(entry.as_line()[:width], self.like("struck" if entry.struck else "word"))
            for entry in self._entries[-room:]
        ]
        return Text("\n", no_wrap=True).join(lines)
