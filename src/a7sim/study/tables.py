"""Results of a study as tables for a terminal."""

import math
from collections.abc import Iterator, Sequence

from rich.console import Group, RenderableType
from rich.padding import Padding
from rich.table import Table
from rich.text import Text

from a7sim.result_documents import Document
from a7sim.study.findings import cell_label
from a7sim.text_tables import text_table


def study_tables(document: Document) -> RenderableType:
    """Return the tables of a study document: cells and variance by response, and the answer."""
    return Group(*_parts(document))


def _parts(document: Document) -> Iterator[RenderableType]:
    facts = f"{len(document['cells'])} cells, {document['replicates']} replicates each, seed {document['seed']}"
    yield Text(f"{document['study']}  {facts}", style="bold")
    yield Text(document["question"])
    for response in document["responses"]:
        name, unit = response["name"], response["unit"]
        yield Text(f"\n{name}{f', {unit}' if unit else ''}: {response['meaning']}")
        yield Padding(_cells(document, name), (0, 0, 0, 2))
        analyses = [each["sources"] for each in document["variance"] if each["response"] == name]
        if analyses:
            yield Padding(_variance([source for sources in analyses for source in sources]), (1, 0, 0, 2))
        for hypercube in document["main_effects"]:
            if hypercube["response"] == name:
                yield Padding(_main_effects(hypercube), (1, 0, 0, 2))
    yield Text(
        "\nn sessions; +- half the 95 % interval of the mean; minus 1: minus cell 1, pair by pair; p after Holm.\n"
    )
    if "theory" in document:
        yield Text(f"{document['theory']}\n")
    for claim in document["claims"]:
        yield Text(f"{claim['about']} {claim['verdict']}", style="bold")
        yield Text(f"Claim: {claim['says']}")
        for sentence in claim["answer"]:
            yield Padding(Text(sentence), (0, 0, 0, 2))
        yield Text()
    for sentence in document["answer"]:
        yield Text(sentence)
    if document.get("precision_reached") is False:
        yield Text("The precision asked for is not reached.", style="bold")


def _cells(document: Document, name: str) -> Table:
    spreads = [cell["responses"][name] for cell in document["cells"]]
    theory = ("theory", "ratio") if any("theory" in each for each in spreads) else ()
    columns = ("cell", "levels", "n", "mean", "+-", "sd", "median", "minus 1", "p", *theory)
    table = text_table(*columns, left=(0, 1), fold=(1,))
    beside = {each["cell"]: each for each in document["comparisons"] if each["response"] == name}
    for cell in document["cells"]:
        spread = cell["responses"][name]
        first = (str(cell["cell"]), cell_label(cell), str(spread["count"]))
        if not spread["count"]:
            table.add_row(*first, "all gave up")
            continue
        half = spread["mean_interval"][1] - spread["mean"]
        median = spread["quantiles"]["0.5"]["value"]
        numbers = (f"{spread['mean']:.4g}", f"{half:.2g}", f"{spread['sd']:.3g}", f"{median:.4g}")
        propagated = [f"{spread[each]:.3g}" if each in spread else "" for each in theory]
        table.add_row(*first, *numbers, *_difference(beside.get(cell["cell"])), *propagated)
    return table


def _difference(comparison: Document | None) -> Sequence[str]:
    if comparison is None:
        return ("", "")
    return f"{comparison['difference']:+.3g}", f"{comparison['p_adjusted']:.3f}"


def _main_effects(hypercube: Document) -> Table:
    table = text_table("factor", "share of variance", "from", "to", "p", "slope of ranks", "from", "to", left=(0,))
    for each in hypercube["factors"]:
        numbers = (each["share"], *each["interval"], each["p"], each["slope"], *each["slope_interval"])
        table.add_row(each["factor"], *("" if math.isnan(value) else f"{value:.3f}" for value in numbers))
    table.add_row("of that, chance", f"{hypercube['chance']:.3f}")
    return table


def _variance(sources: Sequence[Document]) -> Table:
    table = text_table("source", "squares", "freedom", "F", "p", "partial eta²")
    for each in sources:
        tested = each["source"] != "remaining"
        ratios = (
            (f"{each['F']:.2f}", f"{each['p']:.4f}", f"{each['partial_eta_squared']:.3f}") if tested else ("", "", "")
        )
        table.add_row(each["source"], f"{each['squares']:.4g}", str(each["freedom"]), *ratios)
    return table
