"""Figures of a study from its document: intervals, densities, heat maps, accuracy against factor values, hypotheses."""

from collections.abc import Iterator, Sequence
from math import isfinite
from typing import TYPE_CHECKING

from a7sim.report.drawing import FAINT, FILL, INK, LEFT, PANEL, RIGHT, SOFT, TRUE, drawing
from a7sim.report.page import PageFigure
from a7sim.result_documents import Document
from a7sim.study.claims import SMALL_CORRELATION, SMALL_EFFECT
from a7sim.study.findings import cell_label
from a7sim.study.responses import OF_MODEL

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WIDTH_IN = 9.0
"""Width of all figures in inches, so that letters have equal size on a page."""
_INCHES_A_ROW, _INCHES_BESIDE, _INCHES_HIGH = 0.36, 1.2, 3.9
_SIGNS = ((LEFT, "-"), (RIGHT, "-"), (TRUE, "-"), (LEFT, "--"), (RIGHT, "--"), (TRUE, "--"), (SOFT, "-"), (SOFT, "--"))
MAX_CELLS_DRAWN = 60
"""Maximum number of cells in a figure; tables list all cells."""
_STEEP = 10.0
"""Ratio of the outermost positions from which an axis is logarithmic."""
_UNITS = ("m", "mm", "gon")
_MAX_IN_A_MAP, _MAX_BESIDE = 10, 3


def response_figures(document: Document, response: Document) -> Iterator[PageFigure]:
    """Yield the figures of a response. Raises A7SimError if matplotlib is not installed."""
    name = response["name"]
    cells = [cell for cell in document["cells"] if cell["responses"][name]["count"]]
    if _is_a_map(document, cells):
        yield heat_map(document, response)
    if places := [each for each in document["places"] if _levels(document, name, each)][:_MAX_BESIDE]:
        yield axis_figure(document, response, places)
    if curves := [each for each in document["densities"] if each["response"] == name][:_MAX_BESIDE]:
        yield density_figure(curves, response)
    if len(cells) <= MAX_CELLS_DRAWN:
        yield intervals(cells, response)


def claim_figures(document: Document) -> Iterator[PageFigure]:
    """Yield figures of effects with their intervals, and of responses against the responses on which they depend."""
    tests = [(claim, test) for claim in document["claims"] for test in claim["tests"]]
    effects = [(c, t) for c, t in tests if "on" not in t and isfinite(t["effect_interval"][0])]
    if effects:
        yield _forest(effects, "effect", SMALL_EFFECT, "standardised effect d")
    correlations = [(c, t) for c, t in tests if "on" in t and isfinite(t["correlation_interval"][0])]
    if correlations:
        yield _forest(correlations, "correlation", SMALL_CORRELATION, "correlation r")
        yield from _dependences(document, [t for _, t in correlations])


def axis_label(response: Document) -> str:
    """Return the label of an axis: the name of a response and its unit."""
    unit = response["unit"]
    name, at, model = response["name"].partition(OF_MODEL)
    words = name.removesuffix(f"_{unit}").replace("_", " ") + (f", model {model}" if at else "")
    return f"{words} ({unit})" if unit else words


def _named(kind: str, response: Document) -> str:
    return f"{kind}-{''.join(each if each.isalnum() else '-' for each in response['name'])}"


def intervals(cells: Sequence[Document], response: Document) -> PageFigure:
    """Return quantiles, medians, means and their intervals by cell."""
    spreads = [cell["responses"][response["name"]] for cell in cells]
    means = "; ".join(f"{cell_label(c)} {s['mean']:.4g}" for c, s in zip(cells, spreads, strict=True))
    size = (WIDTH_IN, _INCHES_BESIDE + _INCHES_A_ROW * len(cells))
    title = f"{capitalize(axis_label(response))} by cell"
    with drawing(_named("intervals", response), title, f"Means: {means}.", size, wide=True) as drawn:
        (axes,) = drawn.axes
        places = range(len(cells))
        low, high = ([s["quantiles"][share]["value"] for s in spreads] for share in ("0.05", "0.95"))
        axes.hlines(places, low, high, color=FILL, linewidth=7.0)
        axes.plot([s["quantiles"]["0.5"]["value"] for s in spreads], places, "|", color=RIGHT, markersize=11.0)
        low, high = ([s["mean_interval"][end] for s in spreads] for end in (0, 1))
        axes.hlines(places, low, high, color=LEFT, linewidth=2.5)
        axes.plot([s["mean"] for s in spreads], places, "o", color=LEFT, markersize=5.0)
        axes.set_yticks(places, [cell_label(cell) for cell in cells])
        axes.set_ylim(len(cells) - 0.4, -0.6)
        axes.set_xlabel(axis_label(response))
        axes.grid(axis="x", linewidth=0.6)
        drawn.legend = (
            "Bars hold 90 % of the replicates, strokes across are medians, dots means with their 95 % intervals"
        )
    return drawn.picture


def density_figure(curves: Sequence[Document], response: Document) -> PageFigure:
    """Return kernel densities of a response: axes for each factor, a curve for each of its levels."""
    factors = " and ".join(each["factor"] for each in curves)
    size = (WIDTH_IN if len(curves) > 1 else 0.75 * WIDTH_IN, _INCHES_HIGH)
    title = f"{capitalize(axis_label(response))}: densities by {factors}"
    text = f"Kernel densities by {factors}."
    with drawing(_named("densities", response), title, text, size, [1.0] * len(curves), True, True) as drawn:
        for axes, each in zip(drawn.axes, curves, strict=True):
            for (level, density), (colour, line) in zip(each["densities"].items(), _SIGNS, strict=False):
                axes.plot(each["places"], density, color=colour, linestyle=line, label=level, linewidth=1.6)
            axes.legend(title=each["factor"])
            axes.set_xlabel(axis_label(response))
            axes.set_ylim(bottom=0.0)
            axes.set_yticks([])
            axes.spines["left"].set_visible(False)
        drawn.axes[0].set_ylabel("density")
        drawn.legend = "Gaussian kernels of Scott's width; the other factors at all their levels"
    return drawn.picture


def _is_a_map(document: Document, cells: Sequence[Document]) -> bool:
    counts = [len({cell["levels"][factor] for cell in document["cells"]}) for factor in document["factors"]]
    whole = len(cells) == len(document["cells"]) and document["design"] == "full"
    return whole and len(counts) == 2 and max(counts) <= _MAX_IN_A_MAP


def heat_map(document: Document, response: Document) -> PageFigure:
    """Return the means of all combinations of two factors, each with its interval."""
    name, (down, across) = response["name"], document["factors"]
    rows, columns = (list(dict.fromkeys(cell["levels"][f] for cell in document["cells"])) for f in (down, across))
    means = [cell["responses"][name]["mean"] for cell in document["cells"]]
    low, span = min(means), (max(means) - min(means)) or 1.0
    size = (min(WIDTH_IN, 2.6 + 1.2 * len(columns)), _INCHES_BESIDE + 0.72 * len(rows))
    title = f"{capitalize(axis_label(response))} by {down} and {across}"
    text = "; ".join(f"{cell_label(c)} {m:.4g}" for c, m in zip(document["cells"], means, strict=True))
    with drawing(_named("map", response), title, f"Means: {text}.", size, wide=True) as drawn:
        from matplotlib.patches import Rectangle  # noqa: PLC0415

        (axes,) = drawn.axes
        for i, (cell, mean) in enumerate(zip(document["cells"], means, strict=True)):
            y, x = divmod(i, len(columns))
            shade = 0.06 + 0.84 * (mean - low) / span
            place = (x - 0.5, y - 0.5)
            axes.add_patch(Rectangle(place, 1, 1, facecolor=LEFT, alpha=shade, edgecolor="none"))
            half = cell["responses"][name]["mean_interval"][1] - mean
            colour = PANEL if shade > 0.72 else INK
            axes.text(x, y - 0.13, f"{mean:#.3g}", ha="center", va="center", color=colour)
            axes.text(x, y + 0.2, f"± {half:#.2g}", ha="center", va="center", color=colour, fontsize=9.5)
        axes.set_xlim(-0.5, len(columns) - 0.5)
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xticks(range(len(columns)), columns)
        axes.set_yticks(range(len(rows)), rows)
        axes.tick_params(length=0)
        axes.set_xlabel(across)
        axes.set_ylabel(down)
        for spine in axes.spines.values():
            spine.set_visible(False)
        drawn.legend = "Means with half their 95 % intervals; the darker, the larger"
    return drawn.picture


def _levels(document: Document, response: str, factor: str) -> list[Document]:
    return [each for each in document["levels"] if (each["response"], each["factor"]) == (response, factor)]


def axis_figure(document: Document, response: Document, factors: Sequence[str]) -> PageFigure:
    """Return means against the values of factors: number of points, or distance of levels."""
    size = (WIDTH_IN if len(factors) > 1 else 0.75 * WIDTH_IN, _INCHES_HIGH)
    counts = [document["places"][factor]["counts"] for factor in factors]
    title = f"{capitalize(axis_label(response))} against {' and '.join(counts)}"
    text = f"Means against {' and '.join(counts)}."
    with drawing(_named("against", response), title, text, size, [1.0] * len(factors), True, True) as drawn:
        for axes, factor in zip(drawn.axes, factors, strict=True):
            _against(axes, document, response["name"], factor)
        low, high = (choose(axes.get_ylim()[end] for axes in drawn.axes) for end, choose in ((0, min), (1, max)))
        for axes in drawn.axes:
            axes.set_ylim(low, high)
        drawn.axes[0].set_ylabel(axis_label(response))
        drawn.legend = (
            "Means with 95 % intervals, the other factors at all their levels; a single mark is the first level"
        )
    return drawn.picture


def _against(axes: "Axes", document: Document, name: str, factor: str) -> None:
    at = document["places"][factor]["at"]
    found = _levels(document, name, factor)
    lowest, highest = min(at.values()), max(at.values())
    steep = lowest > 0.0 and highest >= _STEEP * lowest
    beside = 0.0 if steep else 0.02 * (highest - lowest)
    together = {place: [each for each in found if at[each["level"]] == place] for place in sorted(set(at.values()))}
    means = [sum(each["mean"] for each in members) / len(members) for members in together.values()]
    axes.plot(list(together), means, color=FAINT, linewidth=1.4, zorder=1)
    for place, members in together.items():
        for i, each in enumerate(members):
            x = place + beside * (2 * i - len(members) + 1)
            axes.vlines(x, *each["interval"], color=LEFT, linewidth=2.2)
            axes.plot(x, each["mean"], "o", color=LEFT, markersize=5.0)
            label = each["level"] if len(members) > 1 or document["strips"] or each is found[0] else ""
            axes.annotate(label, (x, each["interval"][1]), (0, 4), textcoords="offset points", ha="center", color=SOFT)
    axes.set_xlabel(document["places"][factor]["counts"])
    if steep:
        axes.set_xscale("log")
        axes.minorticks_off()
    axes.set_xticks(sorted(together), [f"{place:g}" for place in sorted(together)])
    axes.margins(x=0.08, y=0.16)
    axes.grid(axis="y", linewidth=0.6)


def _forest(tests: Sequence[tuple[Document, Document]], size_of: str, small: float, label: str) -> PageFigure:
    rows = [_row(claim, test) for claim, test in tests]
    size = (WIDTH_IN, _INCHES_BESIDE + _INCHES_A_ROW * len(tests))
    text = "; ".join(f"{row} {test[size_of]:.2f}" for row, (_, test) in zip(rows, tests, strict=True))
    with drawing(f"claims-{size_of}", f"Tests of the claims: {label}", f"{text}.", size, wide=True) as drawn:
        (axes,) = drawn.axes
        axes.axvspan(-small, small, color=FILL, alpha=0.3, linewidth=0)
        axes.axvline(0.0, color=SOFT, linewidth=0.8)
        for y, (_, test) in enumerate(tests):
            axes.hlines(y, *test[f"{size_of}_interval"], color=LEFT, linewidth=2.2)
            axes.plot(test[size_of], y, "o", color=LEFT, markersize=5.5)
        axes.set_yticks(range(len(tests)), rows)
        axes.set_ylim(len(tests) - 0.4, -0.6)
        axes.set_xlabel(label)
        drawn.legend = (
            f"Dots with 95 % intervals; in the band, below {small:g}, is what is too small to matter. Effects are in "
            "standard deviations of one replicate"
        )
    return drawn.picture


def _row(claim: Document, test: Document) -> str:
    name = _in_words(test["response"])
    if "on" in test:
        return f"{name} with {_in_words(test['on'])}"
    one, other = test["levels"]
    return f"{name}: {claim['factor']}, {other} − {one}"


def _in_words(name: str) -> str:
    name, _, model = name.partition(OF_MODEL)
    words = " ".join(name.split("_")[: -1 if name.rpartition("_")[2] in _UNITS else None])
    return f"{words} of model {model}" if model else words


def _dependences(document: Document, tests: Sequence[Document]) -> Iterator[PageFigure]:
    """Yield for each response its means against the means of the responses on which it depends."""
    responses = {each["name"]: each for each in document["responses"]}
    for name in dict.fromkeys(test["response"] for test in tests):
        of = [test for test in tests if test["response"] == name][:_MAX_BESIDE]
        words = axis_label(responses[name])
        title = f"{capitalize(words)} against what it is said to depend on"
        text = "; ".join(f"{test['on']}: r = {test['correlation']:.2f}" for test in of)
        with drawing(
            _named("dependence", responses[name]), title, text, (WIDTH_IN, _INCHES_HIGH), [1.0] * len(of), True, True
        ) as drawn:
            for axes, test in zip(drawn.axes, of, strict=True):
                bins = test["bins"]
                axes.vlines(bins["on"], bins["low"], bins["high"], color=LEFT, linewidth=2.0)
                axes.plot(bins["on"], bins["mean"], "o-", color=LEFT, markersize=4.5, linewidth=1.0)
                axes.set_xlabel(axis_label(responses[test["on"]]).replace(" (", "\n("))
                axes.grid(axis="y", linewidth=0.6)
            low, high = (choose(axes.get_ylim()[end] for axes in drawn.axes) for end, choose in ((0, min), (1, max)))
            for axes in drawn.axes:
                axes.set_ylim(low, high)
            drawn.axes[0].set_ylabel(words)
            drawn.legend = "Means of ten shares, equal in number, with 95 % intervals as if all were independent"
        yield drawn.picture


def capitalize(words: str) -> str:
    """Return a text with a capital first letter."""
    return words[:1].upper() + words[1:]
