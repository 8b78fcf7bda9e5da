"""Tests of hypotheses: verdict, size of the effect and its uncertainty."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import combinations

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.result_documents import Document
from a7sim.study.cells import Cell
from a7sim.study.schema import Hypothesis, StudyDefinition
from a7sim.study.statistics import CONFIDENCE, binned, compare_cells, holm, regress_on

SMALL_EFFECT = 0.2
"""In standard deviations of one replicate: a smaller difference is too small to matter (Cohen)."""
SMALL_CORRELATION = 0.1
"""Below this, one response explains less than a hundredth of the variance of the other (Cohen)."""

Verdict = str
MATTERS, LITTLE, NOTHING, OPEN = "matters", "matters little", "does not matter", "is left open"

Values = Callable[[str], Array]
"""Replicates ``(cells, n)`` of a response."""


def validate_claims(study: StudyDefinition, cells: Sequence[Cell]) -> None:
    """Raise A7SimError for a hypothesis about factors, levels or responses that the study does not have."""
    for number, claim in enumerate(study.claim, start=1):
        where = f"claim {number}"
        kinds = [each for each in ("differ", "alike", "depends_on") if getattr(claim, each) is not None]
        if len(kinds) != 1 or (claim.factor is None) != (kinds == ["depends_on"]):
            raise A7SimError(
                f"{where}: expected a factor with differ or alike, or depends_on alone, got {_listed(kinds)}"
            )
        for name in [*claim.responses, *(claim.depends_on or [])]:
            if name not in study.responses:
                raise A7SimError(f"{where}: expected a response of {', '.join(study.responses)}, got {name!r}")
        if claim.factor is not None:
            known = list(dict.fromkeys(cell.levels.get(claim.factor, "") for cell in cells))
            if known == [""]:
                raise A7SimError(f"{where}: expected a factor of {', '.join(cells[0].levels)}, got {claim.factor!r}")
            if [] in (claim.differ or []):
                raise A7SimError(f"{where}: expected a level or more in both groups of differ, got none in one")
            levels = _levels(claim)
            for level in levels:
                if level not in known:
                    raise A7SimError(f"{where}: expected a level of {', '.join(known)}, got {level!r}")
                if levels.count(level) > 1:
                    raise A7SimError(f"{where}: expected every level once, got {level!r} twice")


def _listed(kinds: Sequence[str]) -> str:
    return " and ".join(kinds) or "none"


def _levels(claim: Hypothesis) -> list[str]:
    return [*(claim.alike or []), *(level for group in claim.differ or [] for level in group)]


def test_claims(
    claims: Sequence[Hypothesis], cells: Sequence[Cell], responses: Mapping[str, Document], values: Values
) -> list[Document]:
    """Return the hypotheses with tests, verdicts and answers; p values are adjusted for the number of all tests."""
    tests = [list(_tests(claim, cells, values)) for claim in claims]
    together = [each for of_claim in tests for each in of_claim]
    for each, p in zip(together, holm([each["p"] for each in together]), strict=True):
        each["p_adjusted"] = p
        each["verdict"] = _verdict(each)
    return [_document(claim, of_claim, responses) for claim, of_claim in zip(claims, tests, strict=True)]


def _tests(claim: Hypothesis, cells: Sequence[Cell], values: Values) -> Iterator[Document]:
    for response in claim.responses:
        of_response = values(response)
        for on in claim.depends_on or []:
            found = regress_on(of_response, values(on))
            yield {"response": response, "on": on} | asdict(found) | {"bins": binned(of_response, values(on))}
        for one, other in _pairs(claim):
            first, second = (of_response[_having(cells, claim.factor or "", levels)] for levels in (one, other))
            against = float(np.nanmean(first)) if np.isfinite(first).any() else math.nan
            yield {
                "response": response,
                "levels": [" and ".join(one), " and ".join(other)],
                "mean": against,
            } | asdict(compare_cells(second, first))


def _pairs(claim: Hypothesis) -> Iterator[tuple[Sequence[str], Sequence[str]]]:
    """Yield pairs of groups of levels; the second group is compared with the first."""
    if claim.differ is not None:
        yield claim.differ[0], claim.differ[1]
    for one, other in combinations(claim.alike or [], 2):
        yield [one], [other]


def _having(cells: Sequence[Cell], factor: str, levels: Sequence[str]) -> list[int]:
    return [i for i, cell in enumerate(cells) if cell.levels[factor] in levels]


def _verdict(test: Document) -> Verdict:
    if "on" in test:
        size, (low, high), small = test["correlation"], test["correlation_interval"], SMALL_CORRELATION
    else:
        size, (low, high), small = test["effect"], test["effect_interval"], SMALL_EFFECT
    if test["p_adjusted"] < 1.0 - CONFIDENCE:
        return MATTERS if abs(size) >= small else LITTLE
    return NOTHING if -small < low and high < small else OPEN


def _document(claim: Hypothesis, tests: Sequence[Document], responses: Mapping[str, Document]) -> Document:
    verdict = _overall([each["verdict"] for each in tests])
    telling = [each for each in tests if each["verdict"] == verdict]
    return {
        "says": claim.says,
        "about": claim.about,
        "factor": claim.factor,
        "kind": "depends on" if claim.depends_on else "alike" if claim.alike else "differ",
        "verdict": verdict,
        "short": f"{claim.about} {verdict}{_in_brackets(telling)}",
        "answer": [_in_words(each, responses) for each in tests],
        "tests": list(tests),
    }


def _overall(verdicts: Sequence[Verdict]) -> Verdict:
    """Return the strongest verdict; "too small to matter" requires that all tests agree."""
    return next((each for each in (MATTERS, OPEN, LITTLE) if each in verdicts), NOTHING)


def _in_brackets(tests: Sequence[Document]) -> str:
    """Return a short text of the test with the largest effect."""
    most = max(tests, key=_size)
    response = most["response"]
    if "on" in most:
        low, high = most["correlation_interval"]
        return f" (r = {most['correlation']:.2f} of {response} with {most['on']}, {low:.2f} to {high:.2f})"
    low, high = most["effect_interval"]
    one, other = most["levels"]
    return f" ({response}, {other} against {one}: {_share(most)}, d = {most['effect']:.2f}, {low:.2f} to {high:.2f})"


def _size(test: Document) -> float:
    return abs(float(test["correlation"] if "on" in test else test["effect"]))


def _share(test: Document) -> str:
    return f"{100.0 * test['difference'] / test['mean']:+.1f} %" if test["mean"] else f"{test['difference']:+.3g}"


def _in_words(test: Document, responses: Mapping[str, Document]) -> str:
    response = responses[test["response"]]
    unit = f" {response['unit']}" if response["unit"] else ""
    if "on" in test:
        other = responses[test["on"]]
        per = f"{unit} for {_a(other['unit'])}" if other["unit"] else unit
        (low, high), (r_low, r_high) = test["interval"], test["correlation_interval"]
        return (
            f"The {response['meaning']}, on the {other['meaning']}: slope {test['slope']:.3g} ({low:.3g} to {high:.3g})"
            f"{per}, r = {test['correlation']:.2f} ({r_low:.2f} to {r_high:.2f}), "
            f"{format_probability(test['p_adjusted'])}; it "
            f"explains {100.0 * test['correlation'] ** 2:.1f} % of the variance: {_describe(test)}."
        )
    one, other_level = test["levels"]
    (low, high), (d_low, d_high) = test["interval"], test["effect_interval"]
    return (
        f"The {response['meaning']}, {other_level} minus {one}: {test['difference']:+.3g} ({low:+.3g} to {high:+.3g})"
        f"{unit}, {_share(test)}, d = {test['effect']:.2f} ({d_low:.2f} to {d_high:.2f}), "
        f"{format_probability(test['p_adjusted'])}: {_describe(test)}."
    )


def _a(unit: str) -> str:
    return f"a {unit.removesuffix('s')}" if unit.endswith("units") else f"a {unit}"


def _describe(test: Document) -> str:
    return {
        MATTERS: "it matters",
        LITTLE: "there is a difference, too small to matter" if "on" not in test else "a dependence too weak to matter",
        NOTHING: "it does not matter",
        OPEN: "left open by this number of replicates",
    }[test["verdict"]]


def format_probability(p: float) -> str:
    """Return a probability as printed text."""
    if math.isnan(p):
        return "p unknown"
    return "p < 0.001" if p < 0.001 else f"p = {p:.3f}"
