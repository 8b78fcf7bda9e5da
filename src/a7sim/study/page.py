"""Page of a study: question, method, answer, and figures and tables of each response."""

import math
from collections.abc import Iterator, Sequence

from a7sim.report.markdown import markdown
from a7sim.report.page import Chapter, Details, Heading, Paragraph, Part, TableBlock, page
from a7sim.result_documents import Document
from a7sim.study import figures
from a7sim.study.findings import cell_label

_MAX_OPEN = 12
"""Above this number of cells their table is folded."""
_MAX_QUOTED = 3
"""Number of responses with figures in the short form if no hypothesis names any."""


def study_page(document: Document) -> str:
    """Return the page of a study document as HTML. Raises A7SimError if matplotlib is not installed."""
    return page(document["study"], _lead(document), _chapters(document, document["responses"]))


def study_markdown(document: Document, figures_at: str) -> tuple[str, dict[str, str]]:
    """Return the short form of the page as Markdown, and its figures as SVG by file name.

    It shows the responses that hypotheses name, or the first ones. `figures_at` is the path prefix of the figures in
    the Markdown.
    """
    named = {name for claim in document["claims"] for test in claim["tests"] for name in (test["response"],)}
    shown = [each for each in document["responses"] if each["name"] in named] or document["responses"][:_MAX_QUOTED]
    return markdown(document["study"], _lead(document), _chapters(document, shown), figures_at)


def _lead(document: Document) -> list[Part]:
    facts = (document["software"], f"seed {document['seed']}", f"{document['replicates']} replicates in every cell")
    lead: list[Part] = [Paragraph(document["question"]), Paragraph(" · ".join(facts))]
    if document.get("precision_reached") is False:
        lead.append(Paragraph("The precision asked for is not reached.", loud=True))
    return lead


def _chapters(document: Document, responses: Sequence[Document]) -> list[Chapter]:
    return [
        Chapter("The answer", list(_answer(document))),
        Chapter("How it was asked", list(_how(document))),
        *(Chapter(figures.axis_label(each), list(_response(document, each))) for each in responses),
    ]


def _answer(document: Document) -> Iterator[Part]:
    yield Paragraph(document["in_a_sentence"])
    for claim in document["claims"]:
        yield Heading(f"{figures.capitalize(claim['about'])} {claim['verdict']}")
        yield Paragraph(f"Claim: {claim['says']}")
        yield Paragraph("\n".join(claim["answer"]))
    yield from figures.claim_figures(document)
    if document["claims"]:
        yield Heading("Response by response")
    yield Paragraph("\n".join(document["answer"]))


def _how(document: Document) -> Iterator[Part]:
    yield Paragraph(
        f"Scenario {document['scenario']}, design {document['design']}. Cells share their random numbers: replicates "
        "of the same number have the same film, instrument and person, so that cells are compared replicate by "
        "replicate. Intervals are of 95 %: of means by Student's t, of standard deviations and quantiles by the "
        "bootstrap. Probabilities of comparisons, and of all tests of claims together, are adjusted for their number "
        "(Holm). Effects are standardised by the spread of one replicate; below 0.2, and correlations below 0.1, they "
        "are taken for too small to matter (Cohen). In the analysis of variance replicates are blocks: each effect is "
        "tested against its own interaction with them, with the freedom of Greenhouse and Geisser. It asks of all "
        "levels of a factor at once and is not adjusted; a claim asks of two sets of levels and is: of few replicates "
        "the one may say that a factor matters and the other not yet."
    )
    if document["strips"]:
        yield Paragraph(
            "A replicate is worked once in every case, each model with its own two perspective centres; its cells are "
            "the strips of all combinations of the cases of its models, and share these sessions."
        )
    rows = [
        (
            str(cell["cell"]),
            cell_label(cell),
            _settings(cell["settings"]),
            str(cell["replicates"]),
            str(cell["gave_up"]),
        )
        for cell in document["cells"]
    ]
    cells = TableBlock("Cells", ("Cell", "Levels", "Settings", "Sessions", "Gave up"), rows, frozenset({0, 1, 2}))
    yield Details(f"The {len(rows)} cells", [cells]) if len(rows) > _MAX_OPEN else cells


def _settings(settings: Document) -> str:
    return ", ".join(f"{path} = {value}" for path, value in settings.items())


def _response(document: Document, response: Document) -> Iterator[Part]:
    name, unit = response["name"], response["unit"]
    yield Paragraph(f"{response['meaning']}{f', {unit}' if unit else ''}")
    present = [cell for cell in document["cells"] if cell["responses"][name]["count"]]
    if not present:
        yield Paragraph("Every session gave up.", loud=True)
        return
    yield from figures.response_figures(document, response)
    for analysis in document["variance"]:
        if analysis["response"] == name:
            yield _variance(analysis["sources"])
    for hypercube in document["main_effects"]:
        if hypercube["response"] == name:
            yield from _main_effects(hypercube)
    if any("theory" in cell["responses"][name] for cell in present):
        yield Paragraph(document["theory"])
    sheets: list[Part] = [_spreads(present, name)]
    beside = [each for each in document["comparisons"] if each["response"] == name]
    if beside:
        sheets.append(_comparisons(beside, {cell["cell"]: cell_label(cell) for cell in document["cells"]}))
    yield Details("Cells in numbers", sheets)


def _spreads(cells: Sequence[Document], name: str) -> TableBlock:
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
    return TableBlock("Means, standard deviations and quantiles", header, rows)


def _spread(cell: Document, name: str) -> Sequence[str]:
    spread = cell["responses"][name]
    return (
        *(cell_label(cell), str(spread["count"])),
        *(_short(spread["mean"]), _between(spread["mean_interval"])),
        *(_short(spread["sd"]), _between(spread["sd_interval"])),
        *(_short(each["value"]) for each in spread["quantiles"].values()),
    )


def _comparisons(beside: Sequence[Document], labels: dict[int, str]) -> TableBlock:
    rows = [
        (
            labels[each["cell"]],
            str(each["pairs"]),
            f"{each['difference']:+.4g}",
            _between(each["interval"]),
            f"{each['effect']:+.2f}",
            _between(each["effect_interval"]),
            f"{each['p_adjusted']:.4f}",
        )
        for each in beside
    ]
    return TableBlock(
        f"Minus {labels[1]}, in pairs", ("Cell", "Pairs", "Difference", "95 %", "Cohen's d", "95 %", "p"), rows
    )


def _variance(sources: Sequence[Document]) -> TableBlock:
    rows = [
        (
            each["source"],
            _short(each["squares"]),
            str(each["freedom"]),
            *(
                (
                    *(_short(each["remaining"]), _short(each["F"]), f"{each['epsilon']:.2f}"),
                    *(f"{each['p']:.4f}", f"{each['partial_eta_squared']:.3f}"),
                )
                if tested
                else ("",) * 5
            ),
        )
        for each in sources
        for tested in [each["source"] != "remaining"]
    ]
    columns = ("Source", "Squares", "Freedom", "Against", "F", "Epsilon", "p", "Partial eta²")
    return TableBlock("Analysis of variance, replicates as blocks", columns, rows)


def _main_effects(hypercube: Document) -> Iterator[Part]:
    rows = [
        (
            *(each["factor"], f"{each['share']:.3f}", _between(each["interval"]), f"{each['p']:.3f}"),
            *(("", "") if math.isnan(each["slope"]) else (f"{each['slope']:+.3f}", _between(each["slope_interval"]))),
        )
        for each in hypercube["factors"]
    ]
    yield TableBlock("What each factor weighs alone", ("Factor", "Share", "95 %", "p", "Slope of ranks", "95 %"), rows)
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
