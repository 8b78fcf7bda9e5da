"""Results of a study as one document: cells, comparisons, variance by factor, and a summary sentence."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

import a7sim
from a7sim.geometry import Array
from a7sim.result_documents import Document, document_header
from a7sim.study.axis_positions import axis_positions
from a7sim.study.cells import Cell
from a7sim.study.claims import format_probability, test_claims
from a7sim.study.loading import LoadedStudy
from a7sim.study.main_effects import main_effects, noise_share
from a7sim.study.running import precision_reached
from a7sim.study.statistics import (
    CONFIDENCE,
    QUANTILES,
    Effect,
    compare_cells,
    densities,
    holm,
    mean_interval,
    quantile_with_interval,
    sd_interval,
    variance_by_factor,
)
from a7sim.study.tally import Tally
from a7sim.study.theory import theory_comparison, theory_sentence

SIGNIFICANT = 1.0 - CONFIDENCE
MAX_DENSITIES = 8
"""Maximum number of density curves that a figure can show."""


def findings_document(loaded: LoadedStudy, tally: Tally) -> Document:
    """Return the document of a study; the same study and tally give the same document."""
    study = loaded.study
    document = document_header("study") | {
        "software": f"a7sim {a7sim.__version__}",
        "study": study.title,
        "question": study.question,
        "scenario": study.scenario,
        "settings": study.settings,
        "design": study.design,
        "seed": study.seed,
        "replicates": int(tally.done.min()),
        "strips": study.strips is not None,
        "factors": list(loaded.factors),
        "places": {name: places for name, places in axis_positions(loaded).items() if places},
        "responses": [{"name": each.name, "unit": each.unit, "meaning": each.meaning} for each in loaded.responses],
        "confidence": CONFIDENCE,
        "cells": [_cell(loaded, tally, i, cell) for i, cell in enumerate(loaded.cells)],
        "comparisons": list(_comparisons(loaded, tally)),
        "variance": list(_variance(loaded, tally)),
        "main_effects": list(_main_effects(loaded, tally)),
        "levels": list(_levels(loaded, tally)),
        "densities": list(_densities(loaded, tally)),
    }
    document["claims"] = _claims(loaded, tally, document)
    if study.precision is not None:
        document["precision_reached"] = precision_reached(loaded, tally)
    document |= theory_sentence(document, loaded.scenarios)
    return document | {"in_a_sentence": summary_sentence(document), "answer": list(_answer(document))}


def _cell(loaded: LoadedStudy, tally: Tally, i: int, cell: Cell) -> Document:
    sample = tally.sample(i)
    return {
        "cell": cell.number,
        "levels": dict(cell.levels),
        "settings": cell.settings,
        "replicates": int(tally.done[i]),
        "gave_up": int(tally.done[i] - tally.count[i].max()),
        "responses": {
            response.name: _spread(loaded, tally, (i, j), sample[j]) for j, response in enumerate(loaded.responses)
        },
    }


def _spread(loaded: LoadedStudy, tally: Tally, at: tuple[int, int], sample: Array) -> Document:
    count = int(tally.count[at])
    if count == 0:
        return {"count": 0}
    mean, sd = float(tally.mean[at]), float(tally.sd[at])
    known = sample[np.isfinite(sample)]
    values, counts = tally.spread(*at)
    quantiles = {share: quantile_with_interval(values, share, counts) for share in QUANTILES}
    return {
        "count": count,
        "mean": mean,
        "mean_interval": mean_interval(mean, sd, count),
        "sd": sd,
        "sd_interval": sd_interval(known, loaded.study.seed, at),
        "least": float(tally.low[at]),
        "largest": float(tally.high[at]),
        "quantiles": {f"{share:g}": {"value": v, "interval": interval} for share, (v, interval) in quantiles.items()},
    } | _theory(loaded, at, mean, sd)


def _theory(loaded: LoadedStudy, at: tuple[int, int], mean: float, sd: float) -> Document:
    """Return the theoretical precision of a response in a cell.

    Empty for strips, whose models differ in their plans.
    """
    if loaded.study.strips is not None:
        return {}
    return theory_comparison(loaded.scenarios[at[0]], loaded.responses[at[1]].name, mean, sd)


def _comparisons(loaded: LoadedStudy, tally: Tally) -> Iterator[Document]:
    """Yield each further cell compared with the first, response by response, adjusted for the number of comparisons."""
    first = tally.sample(0)
    others = [tally.sample(i) for i in range(1, len(loaded.cells))]
    for j, response in enumerate(loaded.responses):
        found = [compare_cells(other[j], first[j]) for other in others]
        adjusted = holm([each.p for each in found])
        for cell, each, p in zip(loaded.cells[1:], found, adjusted, strict=True):
            yield {
                "response": response.name,
                "cell": cell.number,
                "against": 1,
                "pairs": each.pairs,
                "difference": each.difference,
                "interval": each.interval,
                "sd": each.sd,
                "effect": each.effect,
                "effect_interval": each.effect_interval,
                "p": each.p,
                "p_adjusted": p,
            }


def _variance(loaded: LoadedStudy, tally: Tally) -> Iterator[Document]:
    for j, response in enumerate(loaded.responses):
        for effects in _analyses(loaded, tally, j):
            if effects:
                yield {"response": response.name, "sources": [_effect(each) for each in effects]}


def _analyses(loaded: LoadedStudy, tally: Tally, response: int) -> Iterator[Sequence[Effect]]:
    """Yield one analysis for a full factorial, one per factor for one-at-a-time designs, none otherwise."""
    factors, design = loaded.factors, loaded.study.design
    if not factors or design == "latin-hypercube":
        return
    values = _replicates(loaded, tally, response)
    counts = [len(levels) for levels in factors.values()]
    if design == "full":
        yield variance_by_factor(values.reshape(*counts, values.shape[1]), list(factors))
        return
    begin = 1
    for factor, count in zip(factors, counts, strict=True):
        of_factor = [0, *range(begin, begin + count - 1)]
        yield variance_by_factor(values[of_factor], [factor])
        begin += count - 1


def _main_effects(loaded: LoadedStudy, tally: Tally) -> Iterator[Document]:
    """Yield the main effects of the factors of a Latin hypercube, response by response; none for another design."""
    if loaded.study.design != "latin-hypercube":
        return
    values = {
        factor.name: np.array([float(cell.settings[factor.path or ""]) for cell in loaded.cells])
        if factor.range
        else [cell.levels[factor.name] for cell in loaded.cells]
        for factor in loaded.study.factor
    }
    for j, response in enumerate(loaded.responses):
        means = np.where(tally.count[:, j] > 0, tally.mean[:, j], np.nan)
        effects = main_effects(means, values)
        if effects:
            found = {
                "chance": noise_share(_replicates(loaded, tally, j)),
                "factors": [asdict(each) for each in effects],
            }
            yield {"response": response.name} | found


def _replicates(loaded: LoadedStudy, tally: Tally, response: int) -> Array:
    """Return the replicates ``(cells, n)`` of a response that all cells have."""
    samples = [tally.sample(i)[response] for i in range(len(loaded.cells))]
    n = min(each.size for each in samples)
    return np.array([each[:n] for each in samples])


def _claims(loaded: LoadedStudy, tally: Tally, document: Document) -> list[Document]:
    responses = {each["name"]: each for each in document["responses"]}
    names = loaded.study.responses
    return test_claims(
        loaded.study.claim, loaded.cells, responses, lambda name: _replicates(loaded, tally, names.index(name))
    )


def _levels(loaded: LoadedStudy, tally: Tally) -> Iterator[Document]:
    """Yield the mean of each level of a factor: the mean over its cells, replicate by replicate."""
    for j, response in enumerate(loaded.responses):
        values = _replicates(loaded, tally, j)
        for factor, levels in loaded.factors.items():
            for level in levels if len(levels) < len(loaded.cells) or len(loaded.factors) == 1 else ():
                means = values[[cell.levels[factor] == level for cell in loaded.cells]].mean(axis=0)
                known = means[np.isfinite(means)]
                if known.size > 1:
                    mean, sd = float(known.mean()), float(known.std(ddof=1))
                    interval = mean_interval(mean, sd, known.size)
                    found = {"mean": mean, "interval": interval, "sd": sd, "count": known.size}
                    yield {"response": response.name, "factor": factor, "level": level} | found


def _densities(loaded: LoadedStudy, tally: Tally) -> Iterator[Document]:
    """Yield the distribution of a response at each level of a factor over all levels of the other factors."""
    for j, response in enumerate(loaded.responses):
        values = _replicates(loaded, tally, j)
        for factor, levels in loaded.factors.items():
            if len(levels) > MAX_DENSITIES:
                continue
            of_levels = {
                level: values[[i for i, cell in enumerate(loaded.cells) if cell.levels[factor] == level]].ravel()
                for level in levels
            }
            if curves := densities(of_levels):
                yield {"response": response.name, "factor": factor} | curves


def _effect(effect: Effect) -> Document:
    return {
        "source": " x ".join(effect.source) or "remaining",
        "squares": effect.squares,
        "freedom": effect.freedom,
        "remaining": effect.remaining,
        "F": effect.F,
        "p": effect.p,
        "epsilon": effect.epsilon,
        "partial_eta_squared": effect.partial_eta_squared,
    }


def summary_sentence(document: Document) -> str:
    """Return the answer to the question of a study as one sentence: of its hypotheses, or of its first response."""
    if document["claims"]:
        parts = "; ".join(each["short"] for each in document["claims"])
        return f"{parts[0].upper()}{parts[1:]}."
    return next(_answer(document))


def _answer(document: Document) -> Iterator[str]:
    """Yield one sentence per response: its mean and the factors on which it depends."""
    for response in document["responses"]:
        means = [
            (cell["responses"][response["name"]]["mean"], cell)
            for cell in document["cells"]
            if cell["responses"][response["name"]]["count"]
        ]
        if not means:
            yield f"{response['name']}: every session gave up."
            continue
        yield f"{response['name']}: {_range(means, response['unit'])}{_dependence(document, response['name'])}."
    gave_up = sum(cell["gave_up"] for cell in document["cells"])
    if gave_up:
        yield f"{gave_up} sessions gave up (nan in replicates.csv; `a7sim run` with their seed says why)."


def _range(means: Sequence[tuple[float, Any]], unit: str) -> str:
    unit = f" {unit}" if unit else ""
    (low, at_low), (high, at_high) = (choose(means, key=lambda each: each[0]) for choose in (min, max))
    if len(means) == 1:
        return f"{low:.4g}{unit} on the average"
    if low == high:
        return f"{low:.4g}{unit} on the average in every cell"
    return f"from {low:.4g}{unit} ({cell_label(at_low)}) to {high:.4g}{unit} ({cell_label(at_high)}) on the average"


def cell_label(cell: Document) -> str:
    """Return the levels of a cell of a document as text."""
    return ", ".join(f"{factor} {level}" for factor, level in cell["levels"].items()) or "as it stands"


def _dependence(document: Document, response: str) -> str:
    sources = [
        source
        for analysis in document["variance"]
        if analysis["response"] == response
        for source in analysis["sources"]
        if source["source"] != "remaining"
    ]
    for hypercube in document["main_effects"]:
        if hypercube["response"] == response:
            return _weighed(hypercube["factors"])
    matters = [each for each in sources if each["p"] < SIGNIFICANT]
    if not sources:
        return ""
    if not matters:
        return "; no factor was seen to matter"
    listed = [f"{each['source']} ({format_probability(each['p'])}, {_share(each)})" for each in matters]
    return f"; it depends on {', '.join(listed)}"


def _weighed(factors: Sequence[Document]) -> str:
    """Return the factors of a Latin hypercube that matter, the largest share first, with their signs."""
    matters = sorted((each for each in factors if each["p"] < SIGNIFICANT), key=lambda each: -each["share"])
    if not matters:
        return "; no factor was seen to matter"
    listed = [
        f"{each['factor']} ({100.0 * each['share']:.0f} % of the variance between cells{_way(each['slope_interval'])})"
        for each in matters
    ]
    return f"; alone it follows {', '.join(listed)}"


def _way(interval: Sequence[float]) -> str:
    low, high = interval
    return ", growing with it" if low > 0.0 else ", falling with it" if high < 0.0 else ""


def _share(source: Document) -> str:
    share = source["partial_eta_squared"]
    return "eta² unknown" if math.isnan(share) else f"partial eta² {share:.2f}"
