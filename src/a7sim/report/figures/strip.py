"""Figures of a strip on the ground: residuals in plan and height, plan and profile."""

import math
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from a7sim.reduction.strips import CENTRE, is_centre
from a7sim.report.drawing import (
    FAINT,
    INK,
    LEFT,
    PANEL,
    RIGHT,
    SOFT,
    WIDTH_IN,
    arrows,
    drawing,
    nice_number,
    scale_arrow,
)
from a7sim.report.page import PageFigure
from a7sim.result_documents import Document
from a7sim.text import pluralize

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Places = Mapping[str, tuple[float, float, float]]
"""East, north and height of points, m."""

FAR_M = 20_000.0
"""Coordinates above this are shown without their kilometres."""

MANY = 20
"""Above this number of ground points a figure has the full width."""

_LOOKS = {False: ("^", LEFT, LEFT, "control"), True: ("o", RIGHT, PANEL, "check")}
"""Marker, edge, face and label of control and checks."""


def residuals_in_plan(strip: Document, places: Places, name: str, of: str) -> PageFigure | None:
    """Return residuals in plan at control and checks as arrows; None without positions."""
    residuals = {
        point: each
        for point, each in _last(strip)["residuals_m"].items()
        if point in places and None not in (each["X"], each["Y"])
    }
    if not residuals:
        return None
    origin = _origin(places)
    largest = max(math.hypot(each["X"], each["Y"]) for each in residuals.values())
    at = {point: (places[point][0] - origin[0], places[point][1] - origin[1]) for point in residuals}
    extent = _extent(at.values())
    step, length = nice_number(largest or 1e-3), 0.13 * extent / (largest or 1e-3)
    note = (
        f"Arrows computed minus given at {pluralize(len(residuals), 'ground point')}; the longest is {largest:.3f} m."
    )
    long = len(residuals) > MANY
    size, width = ((8.0, 4.2), 0.004) if long else ((WIDTH_IN, 4.8), 0.008)
    with drawing(name, f"{of}: residuals in plan", note, size=size, wide=long) as drawn:
        axes = drawn.axes[0]
        for check in (False, True):
            marker, edge, face, word = _LOOKS[check]
            chosen = [point for point, each in residuals.items() if (each["role"] == "check") is check]
            if not chosen:
                continue
            x, y = zip(*(at[point] for point in chosen), strict=True)
            dx, dy = ([length * residuals[point][axis] for point in chosen] for axis in "XY")
            arrows(axes, x, y, dx, dy, edge, width)
            axes.plot(x, y, marker, color=edge, markerfacecolor=face, markersize=7, label=word, zorder=4)
        _label_all(axes, at)
        low, left = min(y for _, y in at.values()), min(x for x, _ in at.values())
        scale_arrow(axes, (left, low - 0.15 * extent), (length * step, 0.0), f"{step:g} m", INK, width)
        axes.set_aspect("equal", adjustable="datalim")
        axes.margins(0.16)
        _axes_of_ground(axes, origin)
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        drawn.legend = "Computed minus given; the lowest arrow is the scale"
    return drawn.picture


def residuals_in_height(strip: Document, name: str, of: str) -> PageFigure | None:
    """Return residuals in height at control and checks, point by point."""
    residuals = {p: each for p, each in _last(strip)["residuals_m"].items() if each["Z"] is not None}
    if not residuals:
        return None
    points = list(residuals)
    largest = max(abs(each["Z"]) for each in residuals.values())
    note = f"Heights computed minus given at {pluralize(len(points), 'ground point')}; the largest is {largest:.3f} m."
    long = len(points) > MANY
    size = (8.0, 4.2) if long else (WIDTH_IN, 4.8)
    with drawing(name, f"{of}: residuals in height", note, size=size, wide=long) as drawn:
        axes = drawn.axes[0]
        for check in (False, True):
            marker, edge, face, word = _LOOKS[check]
            chosen = [i for i, point in enumerate(points) if (residuals[point]["role"] == "check") is check]
            z = [residuals[points[i]]["Z"] for i in chosen]
            axes.vlines(chosen, 0.0, z, color=edge, linestyle="--" if check else "-", linewidth=2.0)
            if chosen:
                axes.plot(chosen, z, marker, color=edge, markerfacecolor=face, markersize=7, label=word)
        axes.axhline(0.0, color=INK, linewidth=1.0)
        axes.set_xticks(range(len(points)), points, rotation=90 if len(points) > 14 else 0)
        axes.set(ylabel="Z computed minus given, m", xlabel="ground point")
        axes.grid(axis="y")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return drawn.picture


def plan_and_profile(places: Places, strip: Document, name: str, of: str) -> PageFigure | None:
    """Return the points and centres of a strip in plan, and their heights along it."""
    centres = {point: at for point, at in places.items() if is_centre(point)}
    points = {point: at for point, at in places.items() if point not in centres}
    if len(centres) < 2 or not points:
        return None
    origin = _origin(places)
    roles = {point: each["role"] for point, each in _last(strip)["residuals_m"].items()}
    along = _along(centres)
    drawn_of = f"{pluralize(len(points), 'point')} and {pluralize(len(centres), 'perspective centre')}"
    note = f"{drawn_of}, from above and from the side."
    with drawing(name, f"{of}: plan and profile", note, size=(8.0, 8.6), ratios=(1.9, 0.8, 1.0), wide=True) as drawn:
        plan, air, ground = drawn.axes
        plan.plot(*_flat(centres, origin), "-", color=FAINT, zorder=1)
        for check in (False, True, None):
            marker, edge, face, word = _LOOKS[check] if check is not None else (".", SOFT, SOFT, "other point")
            chosen = {p: at for p, at in points.items() if _is(roles.get(p), check)}
            if chosen:
                look: dict[str, Any] = {"color": edge, "markerfacecolor": face, "markersize": 5 if check is None else 7}
                plan.plot(*_flat(chosen, origin), marker, label=word, **look)
                ground.plot([along(at) for at in chosen.values()], [at[2] for at in chosen.values()], marker, **look)
        plan.plot(*_flat(centres, origin), "*", color=INK, markersize=12, label="perspective centre")
        air.plot(
            [along(at) for at in centres.values()], [at[2] for at in centres.values()], "*-", color=INK, markersize=12
        )
        for point, at in centres.items():
            photo = point.removesuffix(CENTRE)
            plan.annotate(
                photo, (at[0] - origin[0], at[1] - origin[1]), (0, 9), textcoords="offset points", ha="center"
            )
            air.annotate(photo, (along(at), at[2]), (0, 8), textcoords="offset points", ha="center")
        plan.set_aspect("equal", adjustable="datalim")
        _axes_of_ground(plan, origin)
        plan.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=4)
        air.set(ylabel="centres Z, m", xticklabels=[])
        air.margins(y=0.5)
        ground.set(ylabel="ground Z, m", xlabel="along the strip from the first centre, m")
        for each in (air, ground):
            each.grid()
        ground.set_xlim(*_shared(air.get_xlim(), ground.get_xlim()))
        air.set_xlim(*ground.get_xlim())
    return drawn.picture


def _last(strip: Document) -> Document:
    """Return the strip after the last adjustment."""
    adjusted: Document = strip.get("polynomial", strip)
    return adjusted


def _is(role: str | None, check: bool | None) -> bool:
    return role is None if check is None else role is not None and (role == "check") is check


def _origin(places: Places) -> tuple[float, float]:
    """Return whole kilometres that may be left off east and north, zero if they are few."""
    least = (min(at[axis] for at in places.values()) for axis in (0, 1))
    east, north = (1000.0 * math.floor(metres / 1000.0) if metres > FAR_M else 0.0 for metres in least)
    return east, north


def _extent(at: Iterable[tuple[float, float]]) -> float:
    x, y = zip(*at, strict=True)
    return max(max(x) - min(x), max(y) - min(y)) or 1.0


def _flat(places: Places, origin: tuple[float, float]) -> tuple[list[float], list[float]]:
    return [at[0] - origin[0] for at in places.values()], [at[1] - origin[1] for at in places.values()]


def _along(centres: Places) -> Callable[[tuple[float, float, float]], float]:
    """Return the function of the distance along the strip from its first centre."""
    (x, y, _), *_, (end_x, end_y, _) = centres.values()
    length = math.hypot(end_x - x, end_y - y) or 1.0
    return lambda at: ((at[0] - x) * (end_x - x) + (at[1] - y) * (end_y - y)) / length


def _shared(one: tuple[float, float], other: tuple[float, float]) -> tuple[float, float]:
    return min(*one, *other), max(*one, *other)


def _axes_of_ground(axes: "Axes", origin: tuple[float, float]) -> None:
    east, north = (f" beyond {metres / 1000.0:.0f} km" if metres else "" for metres in origin)
    axes.set(xlabel=f"X{east}, m", ylabel=f"Y{north}, m")
    axes.locator_params(nbins=5)
    axes.grid()


def _label_all(axes: "Axes", at: Mapping[str, tuple[float, float]]) -> None:
    for point, place in at.items():
        axes.annotate(point, place, (6, -4), textcoords="offset points", va="top", fontsize=10, color=SOFT)
