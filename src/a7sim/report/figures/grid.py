"""Figure of a grid test: residuals at the crosses of the plate."""

import math
from collections.abc import Mapping, Sequence

from a7sim.report.drawing import INK, LEFT, RIGHT, SOFT, WIDTH_IN, arrows, drawing, nice_number, scale_arrow
from a7sim.report.page import PageFigure
from a7sim.text import pluralize

_STYLES = ((LEFT, 0.009), (RIGHT, 0.005), (INK, 0.004), (SOFT, 0.009), (LEFT, 0.004))
"""Colour and width of the arrows of each level."""


def grid_residuals(rows: Sequence[Mapping[str, str]], projector: str, name: str) -> PageFigure | None:
    """Return the residuals of a projector as arrows at the crosses, a colour for each level."""
    found = [row for row in rows if row["projector"] == projector]
    if not found:
        return None
    x, y, vx, vy = ([float(row[key]) for row in found] for key in ("x_mm", "y_mm", "vx_um", "vy_um"))
    levels = list(dict.fromkeys(row["level_mm"] for row in found))
    largest = max(math.hypot(*each) for each in zip(vx, vy, strict=True))
    extent = max(x) - min(x) or 1.0
    length, step = 0.14 * extent / (largest or 1.0), nice_number(largest or 1.0)
    crosses = pluralize(len(set(zip(x, y, strict=True))), "cross", "crosses")
    note = f"Arrows at {crosses} and {pluralize(len(levels), 'level')}; largest {largest:.1f} µm."
    with drawing(
        name, f"{projector.capitalize()} projector: residuals at the crosses", note, size=(WIDTH_IN, 5.4)
    ) as drawn:
        axes = drawn.axes[0]
        for level, (colour, width) in zip(levels, _STYLES, strict=False):
            at = [i for i, row in enumerate(found) if row["level_mm"] == level]
            parts = ([x[i] for i in at], [y[i] for i in at], [length * vx[i] for i in at], [length * vy[i] for i in at])
            arrows(axes, *parts, colour, width, f"Z {-float(level):g} mm below the centre")
        axes.plot(x, y, "+", color=SOFT, markersize=7)
        low = min(y) - 0.16 * extent
        scale_arrow(axes, (min(x), low), (length * step, 0.0), f"{step:g} µm", INK)
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.1)
        axes.set(xlabel="x on the plate, mm", ylabel="y on the plate, mm")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=1)
    return drawn.picture
