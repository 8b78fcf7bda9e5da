"""Figures of a model: residual parallaxes, iterations, and perspective centres."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from a7sim.report.drawing import (
    FAINT,
    FILL,
    HEIGHT_IN,
    INK,
    LEFT,
    PANEL,
    RIGHT,
    SOFT,
    TRUE,
    WIDTH_IN,
    arrows,
    drawing,
    nice_number,
    scale_arrow,
)
from a7sim.report.page import PageFigure, TableBlock
from a7sim.result_documents import Document
from a7sim.standard_points import PLACES, POSITIONS
from a7sim.text import pluralize

if TYPE_CHECKING:
    from matplotlib.axes import Axes

CONFIDENT = 2.4477
"""Standard deviations of the ellipse that contains 95 % of normal errors in a plane."""

OTHER = {"left": "right", "right": "left"}

OF_PROJECTOR = {"left": ("′", LEFT, "o"), "right": ("″", RIGHT, "s")}
"""Sign, colour and marker of the projectors; with base out the left-hand photograph is in the right one."""


def residual_parallaxes(model: Document, name: str) -> PageFigure:
    """Return the residual y-parallaxes as arrows at the standard points in plan, with their scale."""
    orientation = model["relative_orientation"]
    residuals: Mapping[str, float] = orientation["residual_parallax_mm"]
    places, unit = _places(model, residuals)
    across = max(y for _, y in places.values()) - min(y for _, y in places.values())
    largest = max((abs(value) for value in residuals.values()), default=0.0)
    step = nice_number(largest or 1e-3)
    length = 0.26 * across / max(largest, 1e-3)
    title = f"Model {model['model']}: residual y-parallaxes, rms {orientation['rms_parallax_mm']:.4f} mm"
    note = f"Arrows along y at {pluralize(len(residuals), 'standard point')}; the largest parallax is {largest:.3f} mm."
    with drawing(name, title, note, size=(WIDTH_IN, 5.0)) as drawn:
        axes = drawn.axes[0]
        labels = list(residuals)
        x, y = zip(*(places[label] for label in labels), strict=True)
        p = [length * residuals[label] for label in labels]
        arrows(axes, x, y, [0.0] * len(p), p, RIGHT)
        axes.plot(x, y, "o", color=INK, markersize=4, zorder=4)
        for label in labels:
            at = places[label]
            axes.annotate(label, at, (-6, 3), textcoords="offset points", ha="right", fontweight="bold")
            value = f"{round(residuals[label], 3) + 0.0:+.3f}"
            axes.annotate(value, at, (5, -4), textcoords="offset points", va="top", fontsize=10, color=SOFT)
        low, high, left, right = min(y) - 0.52 * across, max(y) + 0.3 * across, min(x), max(x)
        margin = 0.12 * (right - left)
        scale_at = left - 0.5 * margin, low - 0.02 * across
        scale_arrow(axes, scale_at, (0.0, length * step), f"{step:g} mm", RIGHT)
        axes.set(xlim=(left - margin, right + 2.0 * margin), ylim=(low - 0.06 * across, high))
        axes.set(xlabel=f"X, {unit}", ylabel=f"Y, {unit}")
        axes.locator_params(nbins=5)
        drawn.legend = "X is drawn wider than Y; an arrow upward is a positive parallax"
    return drawn.picture


def _places(model: Document, labels: Mapping[str, float]) -> tuple[dict[str, tuple[float, float]], str]:
    """Return the positions of standard points in the model: measured, otherwise those of the pattern."""
    points, names = model["points"], model["standard_points"]
    if all(names.get(label) in points for label in labels):
        unit = "mm" if model["xy_units_per_mm"] == 1.0 else "counter units"
        return {label: (points[names[label]]["X"], points[names[label]]["Y"]) for label in labels}, unit
    return {label: PLACES[label] for label in labels}, "bases"


def parallax_table(model: Document) -> TableBlock:
    """Return the residual parallaxes by standard point."""
    orientation = model["relative_orientation"]
    residuals, names = orientation["residual_parallax_mm"], model["standard_points"]
    rows = [[label, names.get(label, ""), f"{residuals[label]:+.6f}"] for label in POSITIONS if label in residuals]
    return TableBlock("Residual y-parallaxes", ("position", "point", "p, mm"), rows, frozenset({0, 1}))


def iterations(model: Document, name: str) -> PageFigure:
    """Return rms and mean of the parallaxes of each round on a logarithmic scale."""
    orientation = model["relative_orientation"]
    rounds = orientation["rounds"]
    numbers = list(range(1, len(rounds) + 1))
    last = orientation["rms_parallax_mm"]
    title = f"Model {model['model']}: y-parallaxes round by round"
    first = f"Rms {rounds[0]['rms_mm']:.4f} mm in the first of {pluralize(len(rounds), 'round')}"
    note = f"{first}, {last:.4f} mm left at the end."
    with drawing(name, title, note, size=(WIDTH_IN, 5.0)) as drawn:
        axes = drawn.axes[0]
        axes.set_yscale("log")
        axes.plot(numbers, _above_zero(each["rms_mm"] for each in rounds), "o-", color=LEFT, label="rms about the mean")
        means = _above_zero(abs(each["mean_mm"]) for each in rounds)
        if any(each["mean_mm"] for each in rounds):
            axes.plot(numbers, means, "s--", color=RIGHT, markerfacecolor=PANEL, label="mean, without its sign")
        if last > 0.0:
            axes.axhline(last, color=INK, linestyle=":", label="rms left at all standard points")
        axes.set(xlabel="round", ylabel="y-parallax, mm", xticks=numbers)
        axes.grid(axis="y")
        axes.legend(loc="upper right")
    return drawn.picture


def _above_zero(values: Iterable[float]) -> list[float]:
    """Return values with gaps where a logarithmic scale cannot show them."""
    return [value if value > 0.0 else math.nan for value in values]


def perspective_centre(model: Document, side: str, rays: Mapping[str, tuple[float, float]], name: str) -> PageFigure:
    """Return a perspective centre with its error ellipse in plan and its height beside, the true one marked.

    `rays` are the positions (X, Y) of each point's ray at the height of the centre.
    """
    found, true = model["perspective_centres"][side], model["truth"]["centres"][side]
    sign, colour, marker = OF_PROJECTOR[side if model["base"] == "inside" else OTHER[side]]
    title = f"Model {model['model']}: perspective centre O{sign}, {side} photograph {model[side]}"
    note = (
        f"Found at X {found['X0']:.3f}, Y {found['Y0']:.3f}, Z {found['Z0']:.3f}; "
        f"standard deviations {found['sigma_X0']:.3f}, {found['sigma_Y0']:.3f}, {found['sigma_Z0']:.3f} counter units."
    )
    with drawing(name, title, note, size=(WIDTH_IN, HEIGHT_IN), ratios=(3.6, 1.0), beside=True) as drawn:
        plan, height = drawn.axes
        _ellipses(plan, found, colour)
        for point, (x, y) in rays.items():
            plan.plot(x, y, ".", color=SOFT, markersize=5)
            plan.annotate(point, (x, y), (3, 3), textcoords="offset points", fontsize=10, color=SOFT)
        plan.plot(found["X0"], found["Y0"], marker, color=colour, label="found")
        plan.plot(true["X0"], true["Y0"], "x", color=TRUE, markersize=10, markeredgewidth=2.5, label="true")
        plan.set(xlabel="X, counter units", ylabel="Y, counter units")
        plan.set_aspect("equal", adjustable="datalim")
        plan.margins(0.12)
        plan.grid()
        plan.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, columnspacing=1.0)
        plan.locator_params(axis="x", nbins=2)
        plan.locator_params(axis="y", nbins=4)
        height.errorbar([0.0], [found["Z0"]], [found["sigma_Z0"]], fmt=marker, color=colour, capsize=6)
        height.plot([0.0], [true["Z0"]], "x", color=TRUE, markersize=10, markeredgewidth=2.5)
        height.set(xticks=[], xlim=(-1.0, 1.0), title="Z ± σ")
        height.margins(y=0.25)
        height.grid()
        drawn.legend = "Filled: one standard deviation; dashed: 95 %"
        drawn.legend += "; dots: the ray of each point at that height" if rays else ""
    return drawn.picture


def _ellipses(axes: "Axes", found: Document, colour: str) -> None:
    from matplotlib.patches import Ellipse  # noqa: PLC0415

    at = (found["X0"], found["Y0"])
    for factor, style in (
        (1.0, {"facecolor": FILL, "alpha": 0.6}),
        (CONFIDENT, {"facecolor": "none", "linestyle": "--"}),
    ):
        wide, high = 2.0 * factor * found["sigma_X0"], 2.0 * factor * found["sigma_Y0"]
        axes.add_patch(Ellipse(at, wide, high, edgecolor=colour, linewidth=1.6, **style))
    axes.axhline(at[1], color=FAINT, linewidth=0.8, zorder=0)
    axes.axvline(at[0], color=FAINT, linewidth=0.8, zorder=0)


def centre_residuals(model: Document, rays: Mapping[str, Mapping[str, tuple[float, float]]]) -> TableBlock | None:
    """Return the distance of each point's ray from the centres, None if the book does not contain it."""
    points = list(dict.fromkeys(point for side in rays.values() for point in side))
    if not points:
        return None
    rows = []
    for point in points:
        row: list[str] = [point]
        for side, at in rays.items():
            found = model["perspective_centres"][side]
            missed: Sequence[float | None] = (None, None)
            if point in at:
                missed = (at[point][0] - found["X0"], at[point][1] - found["Y0"])
            row += ["" if each is None else f"{each:+.3f}" for each in missed]
        rows.append(row)
    columns = ["point", *(f"{axis}, {side}" for side in rays for axis in ("X", "Y"))]
    return TableBlock("Rays of the points beside the centres found, counter units", columns, rows)
