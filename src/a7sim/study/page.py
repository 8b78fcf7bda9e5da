"""A study on one page: what was asked, how, the answer in words, and every response in figures and tables."""

import math
from collections.abc import Iterator, Sequence

from a7sim.documents import Document
from a7sim.report.drawing import FILL, LEFT, RIGHT, drawing
from a7sim.report.page import Chapter, Paragraph, Part, Picture, Sheet, page
from a7sim.study.findings import in_words

_INCHES_A_CELL, _INCHES_BESIDE, _WIDTH_IN = 0.42, 1.3, 9.0
MOST_CELLS_DRAWN = 60
"""More than these cannot be told apart in a figure; tables have all."""


def page_of(document: Document) -> str:
    """Return the page of a study's document as HTML. Raises Mistake where matplotlib is not installed."""
    facts = (document["software"], f"seed {document['seed']}", f"{document['replicates']} replicates in every cell")
    lead: list[Part] = [Paragraph(document["question"]), Paragraph(" · ".join(facts))]
    if document.get("precision_reached") is False:
        lead.append(Paragraph("The precision asked for is not reached.", loud=True))
    chapters = [
        Chapter("The answer", [Paragraph("\n".join(document["answer"]))]),
        Chapter("How it was asked", list(_how(document))),
        *(Chapter(each["name"], list(_response(document, each))) for each in document["responses"]),
    ]
    return page(document["study"], lead, chapters)


def _how(document: Document) -> Iterator[Part]:
    yield Paragraph(
        f"Scenario {document['scenario']}, design {document['design']}. Cells share their random numbers: replicates "
        "of the same number have the same film, instrument and person, so that cells are compared replicate by "
        "replicate. Intervals are of 95 %: of means by Student's t, of standard deviations and quantiles by the "
        "bootstrap. Probabilities of comparisons are adjusted for their number (Holm)."
    )
    rows = [
        (str(cell["cell"]), in_words(cell), _settings(cell["settings"]), str(cell["replicates"]), str(cell["gave_up"]))
        for cell in document["cells"]
    ]
    yield Sheet("Cells", ("Cell", "Levels", "Settings", "Sessions", "Gave up"), rows, frozenset({0, 1, 2}))


def _settings(settings: Document) -> str:
    return ", ".join(f"{path} = {value}" for path, value in settings.items())


def _response(document: Document, response: Document) -> Iterator[Part]:
    name, unit = response["name"], response["unit"]
    yield Paragraph(f"{response['meaning']}{f', {unit}' if unit else ''}")
    there = [cell for cell in document["cells"] if cell["responses"][name]["count"]]
    if not there:
        yield Paragraph("Every session gave up.", loud=True)
        return
    if len(there) <= MOST_CELLS_DRAWN:
        yield _intervals(there, response)
    yield _spreads(there, name)
    if "theory" in document and any("theory" in cell["responses"][name] for cell in there):
        yield Paragraph(document["theory"])
    beside = [each for each in document["comparisons"] if each["response"] == name]
    if beside:
        yield _comparisons(beside, {cell["cell"]: in_words(cell) for cell in document["cells"]})
    for analysis in document["variance"]:
        if analysis["response"] == name:
            yield _variance(analysis["sources"])
    for hypercube in document["main_effects"]:
        if hypercube["response"] == name:
            yield from _main_effects(hypercube)


def _intervals(cells: Sequence[Document], response: Document) -> Picture:
    name = response["name"]
    spreads = [cell["responses"][name] for cell in cells]
    means = "; ".join(f"{in_words(c)} {s['mean']:.4g}" for c, s in zip(cells, spreads, strict=True))
    size = (_WIDTH_IN, _INCHES_BESIDE + _INCHES_A_CELL * len(cells))
    figure_name = "".join(each if each.isalnum() else "-" for each in name)
    with drawing(figure_name, f"{name} by cell", f"Means: {means}.", size, wide=True) as drawn:
        (axes,) = drawn.axes
        places = range(len(cells))
        low, high = ([s["quantiles"][share]["value"] for s in spreads] for share in ("0.05", "0.95"))
        axes.hlines(places, low, high, color=FILL, linewidth=7.0)
        axes.plot([s["quantiles"]["0.5"]["value"] for s in spreads], places, "|", color=RIGHT, markersize=11.0)
        low, high = ([s["mean_interval"][end] for s in spreads] for end in (0, 1))
        axes.hlines(places, low, high, color=LEFT, linewidth=2.5)
        axes.plot([s["mean"] for s in spreads], places, "o", color=LEFT, markersize=5.0)
        axes.set_yticks(places, [in_words(cell) for cell in cells])
        axes.invert_yaxis()
        axes.set_xlabel(f"{name}{', ' if response['unit'] else ''}{response['unit']}")
        drawn.legend = (
            "Bars hold 90 % of the sessions, strokes across are medians, dots means with their 95 % intervals"
        )
    return drawn.picture


def _spreads(cells: Sequence[Document], name: str) -> Sheet:
    columns = ("Cell", "Sessions", "Mean", "95 %", "Sd", "95 %")
    quantiles = list(cells[0]["responses"][name]["quantiles"])
    rows = [_spread(cell, name) for cell in cells]
    header = (*columns, *(f"{100.0 * float(share):.0f} %" for share in quantiles))
    if any("theory" in cell["responses"][name] for cell in cells):
        header = (*header, "Theory", "Ratio")
        of_theory = [[cell["responses"][name].get(each, math.nan) for each in ("theory", "ratio")] for cell in cells]
        rows = [
            [*row, *("" if math.isnan(v) else _short(v) for v in two)] for row, two in zip(rows, of_theory, strict=True)
        ]
    return Sheet("Means, standard deviations and quantiles", header, rows)


def _spread(cell: Document, name: str) -> Sequence[str]:
    spread = cell["responses"][name]
    return (
        *(in_words(cell), str(spread["count"])),
        *(_short(spread["mean"]), _between(spread["mean_interval"])),
        *(_short(spread["sd"]), _between(spread["sd_interval"])),
        *(_short(each["value"]) for each in spread["quantiles"].values()),
    )


def _comparisons(beside: Sequence[Document], labels: dict[int, str]) -> Sheet:
    rows = [
        (
            labels[each["cell"]],
            str(each["pairs"]),
            f"{each['difference']:+.4g}",
            _between(each["interval"]),
            f"{each['effect']:+.2f}",
            f"{each['p_adjusted']:.4f}",
        )
        for each in beside
    ]
    return Sheet(f"Minus {labels[1]}, in pairs", ("Cell", "Pairs", "Difference", "95 %", "Cohen's d", "p"), rows)


def _variance(sources: Sequence[Document]) -> Sheet:
    rows = [
        (
            each["source"],
            _short(each["squares"]),
            str(each["freedom"]),
            *(
                (_short(each["F"]), f"{each['p']:.4f}", f"{each['partial_eta_squared']:.3f}")
                if tested
                else ("", "", "")
            ),
        )
        for each in sources
        for tested in [each["source"] != "remaining"]
    ]
    columns = ("Source", "Squares", "Freedom", "F", "p", "Partial eta²")
    return Sheet("Analysis of variance, replicates as blocks", columns, rows)


def _main_effects(hypercube: Document) -> Iterator[Part]:
    rows = [
        (
            *(each["factor"], f"{each['share']:.3f}", _between(each["interval"]), f"{each['p']:.3f}"),
            *(("", "") if math.isnan(each["slope"]) else (f"{each['slope']:+.3f}", _between(each["slope_interval"]))),
        )
        for each in hypercube["factors"]
    ]
    yield Sheet("What each factor weighs alone", ("Factor", "Share", "95 %", "p", "Slope of ranks", "95 %"), rows)
    yield Paragraph(
        "Share: of the variance between the means of cells, that of the curve fitted along a factor, the curves of all "
        "factors together, and what chance adds to it taken off; p by the F test of the curve; slope: standardised "
        "regression of ranks on the ranks of all factors; intervals by the jackknife over cells. Chance makes "
        f"{100.0 * hypercube['chance']:.1f} % of the variance between cells."
    )


def _between(interval: Sequence[float]) -> str:
    low, high = interval
    return f"{_short(low)} to {_short(high)}"


def _short(value: float) -> str:
    return f"{value:.4g}"
