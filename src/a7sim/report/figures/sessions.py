"""Figures of the time spent, and of the strips of all cases."""

from collections.abc import Mapping, Sequence

from a7sim.report.drawing import FAINT, FILL, INK, LEFT, PANEL, RIGHT, WIDTH_IN, drawing
from a7sim.report.page import PageFigure
from a7sim.result_documents import Document


def hours(spent: Mapping[str, float], name: str, title: str) -> PageFigure:
    """Return hours as bars, in order of first occurrence."""
    text = "; ".join(f"{what} {each:.2f} hours" for what, each in spent.items())
    with drawing(name, title, text, size=(WIDTH_IN, 1.3 + 0.5 * len(spent))) as drawn:
        axes = drawn.axes[0]
        bars = axes.barh(_in_two_lines(spent), list(spent.values()), color=FILL, edgecolor=INK, height=0.65)
        axes.bar_label(bars, [f"{each:.2f} h" for each in spent.values()], padding=4)
        axes.invert_yaxis()
        axes.set(xlabel="hours")
        axes.margins(x=0.18)
        axes.grid(axis="x")
        axes.set_axisbelow(True)
    return drawn.picture


def _in_two_lines(names: Mapping[str, float]) -> list[str]:
    return [name.replace(" and ", "\nand ").replace("perspective ", "perspective\n") for name in names]


def all_strips(strips: Sequence[Document], name: str) -> PageFigure:
    """Return the rms residuals at the checks, or at control if there are none, of each strip."""
    on = "checks" if all("checks" in strip["accuracy_m"] for strip in strips) else "control"
    title = f"Rms residuals at {on} by strip"
    text = f"{len(strips)} strips, one for every combination of cases, numbered as in the thesis."
    numbers = [strip["number"] for strip in strips]
    with drawing(name, title, text, size=(8.0, 4.4), wide=True) as drawn:
        axes = drawn.axes[0]
        for what, marker, colour, face in (("plan", "o", LEFT, LEFT), ("height", "s", RIGHT, PANEL)):
            values = [strip["accuracy_m"].get(on, {}).get(what) or float("nan") for strip in strips]
            axes.plot(numbers, values, marker, color=colour, markerfacecolor=face, markersize=8, label=what)
        for i in range(1, len(strips)):
            if strips[i]["cases"][:-1] != strips[i - 1]["cases"][:-1]:
                axes.axvline(numbers[i] - 0.5, color=FAINT)
        if len(strips) <= 30:
            axes.set_xticks(numbers, ["".join(strip["cases"]) for strip in strips], rotation=90)
        axes.set(xlabel="cases of the models, in the strip's order", ylabel="rms, m")
        axes.set_ylim(bottom=0.0)
        axes.grid(axis="y")
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    return drawn.picture
