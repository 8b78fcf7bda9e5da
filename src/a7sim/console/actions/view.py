"""View actions: magnification, open eyepieces, and drawing mode."""

from typing import Any

from a7sim.console.actions.base import ActionBase
from a7sim.console.drawing.descriptions import describe_image, describe_parallax
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.console.messages import ViewResult
from a7sim.console.widgets.binocular import ViewSettings

MAGNIFICATIONS = (1.0, 2.0, 4.0, 8.0, 12.0, 20.0, 40.0)
EYES = ((1, 2), (1,), (2,))
MERGED = ("side by side", "anaglyph", "flicker")


class ViewActions(ActionBase):
    """Actions of the view."""

    @property
    def view(self) -> ViewSettings:
        """Settings of the eyepieces."""
        return self._console.binocular.view

    def look(self) -> None:
        """Request pictures of the size of the eyepieces."""
        console = self._console
        if console.met is None or not console.main.is_there:
            return
        console.binocular.lay()
        console.call_after_refresh(lambda: console.thread.look(console.binocular.look(console.point)))

    def draw(self) -> None:
        """Draw the pictures."""
        console = self._console
        if console.sight is None or not console.main.is_there:
            return
        if self.view.drawing is DrawingMode.WORDS:
            self._say_what_is_seen(console.sight)
        else:
            console.binocular.draw(console.sight)

    def _say_what_is_seen(self, sight: ViewResult) -> None:
        console = self._console
        point, acuity = console.point, console.config.acuity_um
        if not point:
            console.binocular.say(dict.fromkeys((1, 2), "go to a point first"))
            return
        left, right = sight.seen.get(1), sight.seen.get(2)
        console.binocular.say(
            {eye: f"{point}: {describe_image(each, acuity)}" for eye, each in ((1, left), (2, right))}
        )
        both = (left[0] - right[0], left[1] - right[1]) if left and right else None
        console.say(f"{point}: {describe_parallax(both, acuity)}")

    def set_view(self, **changes: Any) -> None:
        """Change the settings of the eyepieces."""
        console = self._console
        console.binocular.set_view(**changes)
        self.look()
        self.draw()
        console.refresh_panels()

    def do_magnify(self) -> None:
        """Magnify more."""
        self._magnify(1)

    def do_reduce(self) -> None:
        """Magnify less."""
        self._magnify(-1)

    def _magnify(self, way: int) -> None:
        at = MAGNIFICATIONS.index(self.view.magnification) + way
        self.set_view(magnification=MAGNIFICATIONS[min(max(at, 0), len(MAGNIFICATIONS) - 1)])

    def do_eyes(self) -> None:
        """Open both eyepieces, the left, the right."""
        self.set_view(eyes=_next(EYES, self.view.eyes))

    def do_merge(self) -> None:
        """Show the pictures side by side, as an anaglyph, or alternating."""
        console = self._console
        self.set_view(merged=_next(MERGED, self.view.merged))
        console.say(self.view.merged)

    def do_drawing(self) -> None:
        """Change the drawing mode."""
        console = self._console
        ways = tuple(DrawingMode) if console.utf8 else (DrawingMode.ASCII, DrawingMode.WORDS)
        self.set_view(drawing=_next(ways, self.view.drawing))
        console.say(f"eyepieces in {self.view.drawing}")


def _next(ways: tuple[Any, ...], at: Any) -> Any:
    return ways[(ways.index(at) + 1) % len(ways)]
