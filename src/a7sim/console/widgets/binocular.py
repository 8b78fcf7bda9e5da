"""Binocular: both eyepieces, their settings, and their pictures."""

from dataclasses import dataclass, replace
from typing import Any

from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.timer import Timer

from a7sim.console.drawing.rasterize import (
    DrawingMode,
    anaglyph,
    apply_vignette,
    is_drawn_as,
    overlay_mark,
    picture_size,
    render,
)
from a7sim.console.messages import ViewRequest, ViewResult
from a7sim.console.widgets.eyepiece_widget import EyepieceWidget

FLICKER_S = 0.25

NAMES = {1: "left eye", 2: "right eye"}


@dataclass(frozen=True)
class ViewSettings:
    """Settings of the eyepieces."""

    drawing: DrawingMode
    magnification: float = 8.0
    eyes: tuple[int, ...] = (1, 2)
    merged: str = "side by side"

    @property
    def is_merged(self) -> bool:
        """Return whether both pictures are shown in one eyepiece."""
        return self.merged != "side by side" and self.drawing is DrawingMode.HALVES


class Binocular(Horizontal):
    """Both eyepieces."""

    def __init__(self, view: ViewSettings, mark: str) -> None:
        super().__init__(id="eyes")
        self.view = view
        self._mark = mark
        self._eyes = {eye: EyepieceWidget(eye, name) for eye, name in NAMES.items()}
        self._sight: ViewResult | None = None
        self._flicker: Timer | None = None
        self._flicker_eye = 1

    def compose(self) -> ComposeResult:
        """Place the eyepieces side by side."""
        yield from self._eyes.values()

    @property
    def is_there(self) -> bool:
        """Return whether the eyepieces are mounted."""
        return all(each.is_attached for each in self._eyes.values())

    def set_view(self, **changes: Any) -> None:
        """Change the settings of the eyepieces."""
        self.view = replace(self.view, **changes)
        if self._flicker is not None:
            self._flicker.stop()
            self._flicker = None
        if self.view.merged == "flicker":
            self._flicker = self.set_interval(FLICKER_S, self._other_eye)

    def lay(self) -> None:
        """Open and close the eyepieces by the settings."""
        view = self.view
        for eye, eyepiece in self._eyes.items():
            closed = eye == 2 if view.is_merged else eye not in view.eyes
            eyepiece.set_class(closed, "-closed")
            eyepiece.border_title = view.merged if view.is_merged else NAMES[eye]
            eyepiece.border_subtitle = f"x{view.magnification:g}"

    def look(self, point: str | None) -> ViewRequest:
        """Return a view request for the sizes of the open eyepieces; with a point for a view in words."""
        view = self.view
        open_ones = [each for each in self._eyes.values() if not each.has_class("-closed")]
        cells = min((each.cells for each in open_ones), default=(0, 0))
        columns, rows = picture_size(view.drawing, *cells)
        eyes = (1, 2) if view.is_merged else view.eyes
        return ViewRequest(
            columns, rows, view.magnification, eyes, point if view.drawing is DrawingMode.WORDS else None
        )

    def draw(self, sight: ViewResult) -> None:
        """Draw the pictures, unless they were requested for another drawing mode."""
        self._sight = sight
        view = self.view
        fitting = {eye: greys for eye, greys in sight.pictures.items() if is_drawn_as(view.drawing, greys)}
        pictures = {eye: apply_vignette(greys) for eye, greys in fitting.items()}
        both = view.is_merged and len(pictures) == 2
        if both and view.merged == "anaglyph":
            self._eyes[1].show(overlay_mark(anaglyph(pictures[1], pictures[2]), self._mark), in_colours=True)
            return
        if both:
            pictures = {1: pictures[self._flicker_eye]}
        for eye, greys in pictures.items():
            self._eyes[eye].show(overlay_mark(render(view.drawing, greys), self._mark))

    def say(self, words: dict[int, str]) -> None:
        """Show the view of each eye in words."""
        for eye, text in words.items():
            self._eyes[eye].say(text)

    def _other_eye(self) -> None:
        self._flicker_eye = 3 - self._flicker_eye
        if self._sight is not None and self.view.drawing is not DrawingMode.WORDS:
            self.draw(self._sight)
