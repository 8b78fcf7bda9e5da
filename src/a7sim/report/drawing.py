"""Drawings by matplotlib as inline SVG in the colours of the page, light and dark."""

import io
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from html import escape
from typing import TYPE_CHECKING, Any

from a7sim.errors import A7SimError
from a7sim.report.page import PageFigure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Places = Sequence[float]

INK, SOFT, FAINT, PANEL = "#1a1a1b", "#59595a", "#d3d0c9", "#fbfaf8"
LEFT, RIGHT, TRUE, FILL = "#1f5f8c", "#b3541f", "#2f7d33", "#9fb8ca"
_VARIABLES = {
    INK: "ink",
    SOFT: "soft",
    FAINT: "faint",
    PANEL: "panel",
    LEFT: "left",
    RIGHT: "right",
    TRUE: "true",
    FILL: "fill",
}
"""Drawn colours, each replaced by the page's variable."""

WIDTH_IN, HEIGHT_IN = 4.8, 4.5
"""Size of a figure beside another one; small, so that its letters stay large on a small screen."""

_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "a7sim",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 12,
    "axes.labelsize": 12,
    "xtick.labelsize": 11,
    "ytick.labelsize": 11,
    "legend.fontsize": 11,
    "legend.frameon": False,
    "lines.linewidth": 1.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.useoffset": False,
    "grid.color": FAINT,
    "figure.facecolor": "none",
    "axes.facecolor": "none",
} | dict.fromkeys(("text.color", "axes.labelcolor", "axes.edgecolor", "xtick.color", "ytick.color"), INK)


class FigureBuilder:
    """Figure under construction: `axes` in the body, `picture` afterwards; a `legend` explains its signs."""

    def __init__(self, name: str, title: str, description: str, wide: bool) -> None:
        self._name, self._title, self._description, self._wide = name, title, description, wide
        self.axes: Sequence[Axes] = ()
        self.legend = ""
        self.picture: PageFigure

    def finish(self, figure: "Figure") -> None:
        """Convert the figure to SVG."""
        text = io.StringIO()
        figure.savefig(text, format="svg", metadata=dict.fromkeys(("Creator", "Date", "Format", "Type")))
        markup = _inline(text.getvalue(), self._name, self._title, self._description)
        self.picture = PageFigure(markup, ". ".join(filter(None, (self._title, self.legend))), self._wide)


@contextmanager
def drawing(
    name: str,
    title: str,
    description: str,
    size: tuple[float, float] = (WIDTH_IN, HEIGHT_IN),
    ratios: Sequence[float] = (1.0,),
    beside: bool = False,
    wide: bool = False,
) -> Iterator[FigureBuilder]:
    """Draw in the body on the axes of a figure called `name` in its page.

    Axes are below each other, or `beside`, in these ratios. Raises A7SimError if matplotlib is not installed.
    """
    try:
        import matplotlib  # noqa: PLC0415
        from matplotlib.figure import Figure  # noqa: PLC0415
    except ImportError as error:
        raise A7SimError("a report needs matplotlib for its figures, got none: pip install 'a7sim[report]'") from error
    drawn = FigureBuilder(name, title, description, wide)
    with matplotlib.rc_context(_STYLE):
        figure = Figure(figsize=size, layout="constrained")
        if beside:
            axes = figure.subplots(1, len(ratios), squeeze=False, width_ratios=ratios)
        else:
            axes = figure.subplots(len(ratios), 1, squeeze=False, height_ratios=ratios)
        drawn.axes = tuple(axes.flat)
        yield drawn
        drawn.finish(figure)


def arrows(
    axes: "Axes", x: Places, y: Places, dx: Places, dy: Places, colour: str, width: float = 0.008, label: str = ""
) -> None:
    """Draw arrows of these lengths, all in the units of the axes."""
    shape: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1.0, "zorder": 3}
    axes.quiver(x, y, dx, dy, color=colour, width=width, label=label or None, **shape)
    axes.update_datalim([(at[0] + at[2], at[1] + at[3]) for at in zip(x, y, dx, dy, strict=True)])
    axes.autoscale_view()


def scale_arrow(
    axes: "Axes", at: tuple[float, float], length: tuple[float, float], text: str, colour: str, width: float = 0.008
) -> None:
    """Draw the arrow that shows the scale of the others."""
    (x, y), (dx, dy) = at, length
    arrows(axes, [x], [y], [dx], [dy], colour, width)
    axes.annotate(text, (x + dx, y + dy / 2.0), (8, 0), textcoords="offset points", va="center")


def _inline(svg: str, name: str, title: str, description: str) -> str:
    """Return an SVG for inlining, with unique names and an accessible name."""
    svg = re.sub(r"<metadata>.*?</metadata>|<!--.*?-->", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    svg = re.sub(r' xmlns(:xlink)?="[^"]*"| version="1.1"', "", svg).replace("xlink:href", "href")
    svg = re.sub(r'<g id="[^"]*"', "<g", svg)
    svg = re.sub(r'(?<= id=")', f"{name}-", svg)
    svg = re.sub(r'(?<=href="#)|(?<=url\(#)', f"{name}-", svg)
    svg = svg.replace("'DejaVu Sans', sans-serif", "'DejaVu Sans', 'Liberation Sans', Arial, sans-serif")
    for colour, variable in _VARIABLES.items():
        svg = svg.replace(colour, f"var(--{variable})")
    written = f'<title id="{name}-title">{escape(title)}</title><desc id="{name}-desc">{escape(description)}</desc>'
    named = f'<svg role="img" aria-labelledby="{name}-title {name}-desc"'
    return re.sub(r"<svg([^>]*)>", rf"{named}\1>{_safe(written)}", svg, count=1)


def standalone(picture: PageFigure) -> tuple[str, str]:
    """Return the name of a figure and its SVG as a separate file: light colours on a background."""
    svg = picture.markup
    for colour, variable in _VARIABLES.items():
        svg = svg.replace(f"var(--{variable})", colour)
    found = re.search(r'aria-labelledby="(.*?)-title ', svg)
    name = found.group(1) if found else "figure"
    opened = f'<svg xmlns="http://www.w3.org/2000/svg" style="background: {PANEL}"'
    return name, svg.replace("<svg", opened, 1).strip() + "\n"


def _safe(text: str) -> str:
    return text.replace("\\", r"\\")


def nice_number(value: float) -> float:
    """Return the largest 1, 2 or 5 times a power of ten that does not exceed a positive value."""
    power = 10.0 ** int(f"{value:e}".partition("e")[2])
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= value * (1.0 + 1e-9))
