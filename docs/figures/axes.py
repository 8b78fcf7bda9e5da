"""Draw docs/figures/axes.svg, the picture of the axes and signs in conventions.md."""

from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt
from matplotlib.patches import Arc, FancyArrowPatch

LEFT, RIGHT, INK, SOFT = "#1f5f8b", "#a3431f", "#222222", "#8a8a8a"
MODEL = {
    "3": (0.0, 1.0), "a": (0.25, 1.0), "d": (0.5, 1.0), "g": (0.75, 1.0), "4": (1.0, 1.0),
    "1": (0.0, 0.0), "b": (0.25, 0.0), "e": (0.5, 0.0), "h": (0.75, 0.0), "2": (1.0, 0.0),
    "5": (0.0, -1.0), "c": (0.25, -1.0), "f": (0.5, -1.0), "i": (0.75, -1.0), "6": (1.0, -1.0),
}  # fmt: skip


def arrow(axes, start, end, colour=INK, width=1.6, style="-|>"):
    axes.add_patch(
        FancyArrowPatch(start, end, arrowstyle=style, mutation_scale=12, color=colour, lw=width, shrinkA=0, shrinkB=0)
    )


def turn(axes, at, colour, size, label, start=20, end=300):
    axes.add_patch(Arc(at, size, size * 0.55, theta1=start, theta2=end, color=colour, lw=1.4))
    axes.text(at[0] + size * 0.62, at[1] + size * 0.10, label, color=colour, ha="left", va="center")


def projectors(axes):
    axes.set_title("Base in: centres, elements and the mark, seen from the operator's side", loc="left")
    arrow(axes, (-1.6, 0), (-0.7, 0), SOFT)
    axes.text(-0.66, 0.02, "X", color=SOFT, va="center")
    arrow(axes, (-1.6, 0), (-1.6, 0.9), SOFT)
    axes.text(-1.6, 0.97, "Z", color=SOFT, ha="center")
    arrow(axes, (-1.6, 0), (-1.15, 0.42), SOFT)
    axes.text(-1.1, 0.45, "Y (away)", color=SOFT)
    left, right, mark = (0.0, 0.0), (3.0, 0.0), (1.15, -2.6)
    axes.plot([left[0], right[0]], [0, 0], color=SOFT, lw=1, ls=":")
    for at, colour, name in ((left, LEFT, "O'"), (right, RIGHT, 'O"')):
        axes.plot(*at, "o", color=colour, ms=7, zorder=5)
        axes.text(at[0] - 0.14, at[1] + 0.16, name, color=colour, ha="right", fontsize=13)
        axes.plot([at[0], mark[0]], [at[1], mark[1]], color=colour, lw=1.8)
        axes.plot([at[0] - 0.55, at[0] + 0.55], [-0.75, -0.75], color=colour, lw=3)
    axes.text(-0.62, -0.75, "picture,\nz = -c'", color=LEFT, ha="right", va="center")
    axes.text(3.62, -0.75, 'picture,\nz = -c"', color=RIGHT, ha="left", va="center")
    axes.plot(*mark, "o", color=INK, ms=5, zorder=6)
    axes.text(mark[0] + 0.1, mark[1] - 0.1, "floating mark (X, Y, -z)", va="top")
    arrow(axes, (0.1, 0.62), (2.9, 0.62), INK, style="<|-|>")
    axes.text(1.5, 0.7, "bx", ha="center", va="bottom")
    arrow(axes, (-0.2, 0), (-0.2, -2.6), INK, 1.0, style="<|-|>")
    axes.text(-0.28, -1.75, "z, below\nthe centres", ha="right", va="center")
    axes.plot([-0.3, mark[0]], [-2.6, -2.6], color=SOFT, lw=0.8, ls=":")
    for at, colour, mark_ in ((left, LEFT, "'"), (right, RIGHT, '"')):
        arrow(axes, at, (at[0] - 0.36, at[1] - 0.34), colour)
        axes.text(at[0] - 0.42, at[1] - 0.42, f"by{mark_}", color=colour, ha="right", va="center")
        arrow(axes, at, (at[0], at[1] + 0.5), colour)
        axes.text(at[0] + 0.07, at[1] + 0.45, f"bz{mark_}", color=colour, va="center")
    axes.text(
        3.95, -1.75,
        "+by moves a centre towards -Y,\n+bz upward:\nO' = (0, -by', bz')\nO\" = (bx, -by\", bz\")\n\n"
        "Base out exchanges the X:\nO\" = (0, ...), O' = (bx, ...)",
        va="center", ha="left", linespacing=1.35,
    )  # fmt: skip
    axes.set_xlim(-1.9, 6.2)
    axes.set_ylim(-3.05, 1.35)


def rotations(axes):
    axes.set_title("Positive turns: anticlockwise from the axis's end", loc="left")
    origin = (0.0, 0.0)
    for end, name, symbol in (
        ((2.0, 0.0), "X", "ω primary"),
        ((1.05, 0.95), "Y", "φ secondary"),
        ((0.0, 1.6), "Z", "κ tertiary"),
    ):
        arrow(axes, origin, end)
        axes.text(end[0] * 1.06 + 0.03, end[1] * 1.06 + 0.03, name)
        axes.text(end[0] * 1.06 + 0.20, end[1] * 1.06 + 0.03, symbol, color=LEFT)
    axes.add_patch(Arc((1.35, 0.0), 0.22, 0.62, theta1=-150, theta2=100, color=LEFT, lw=1.5))
    arrow(axes, (1.345, 0.311), (1.30, 0.29), LEFT)
    axes.text(1.16, -0.48, "Y to Z", color=LEFT)
    axes.add_patch(Arc((0.70, 0.633), 0.50, 0.40, theta1=-60, theta2=200, color=LEFT, lw=1.5))
    arrow(axes, (0.822, 0.46), (0.77, 0.443), LEFT)
    axes.text(0.98, 0.52, "Z to X", color=LEFT)
    axes.add_patch(Arc((0.0, 1.05), 0.64, 0.24, theta1=-140, theta2=110, color=LEFT, lw=1.5))
    arrow(axes, (-0.11, 1.163), (-0.17, 1.152), LEFT)
    axes.text(-0.42, 0.88, "X to Y", color=LEFT, ha="right")
    axes.text(-0.75, -0.95, "R(ω, φ, κ) = Rx(ω) Ry(φ) Rz(κ) takes (x, y, -c) into the frame", ha="left")
    axes.set_xlim(-1.0, 3.0)
    axes.set_ylim(-1.15, 1.95)


def standard_points(axes):
    axes.set_title("Standard points of a model (thesis fig. 4.1)", loc="left")
    for label, (x, y) in MODEL.items():
        digit = label.isdigit()
        axes.plot(x * 4, y * 1.3, "o" if digit else "s", color=LEFT if x == 0 else RIGHT if x == 1 else INK, ms=6)
        axes.text(x * 4 + 0.1, y * 1.3 + 0.1, label, weight="bold" if digit else "normal")
    axes.plot([0, 4], [0, 0], color=SOFT, lw=0.8, ls=":")
    axes.text(0, -2.0, "left-hand nadir at 1", color=LEFT, ha="left")
    axes.text(4, -2.0, "right-hand nadir at 2", color=RIGHT, ha="right")
    axes.text(2, -2.45, "A: 1-6   B: + a b c   C: + g h i   D: + d e f   E: all", ha="center")
    axes.set_xlim(-0.6, 4.8)
    axes.set_ylim(-2.75, 1.9)


def main():
    plt.rcParams.update(
        {"font.size": 10.5, "svg.hashsalt": "a7sim", "svg.fonttype": "none", "font.family": "sans-serif"}
    )
    figure = plt.figure(figsize=(11, 8.6), layout="constrained")
    grid = figure.add_gridspec(2, 2, height_ratios=(1.15, 1))
    projectors(figure.add_subplot(grid[0, :]))
    rotations(figure.add_subplot(grid[1, 0]))
    standard_points(figure.add_subplot(grid[1, 1]))
    for axes in figure.axes:
        axes.set_aspect("equal")
        axes.axis("off")
    path = Path(__file__).with_suffix(".svg")
    figure.savefig(path, metadata={"Date": None}, facecolor="white")
    return figure


if __name__ == "__main__":
    main()
