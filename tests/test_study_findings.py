"""Findings of a study, in words and in tables for a terminal, from tallies with a known answer."""

import numpy as np
import pytest
from rich.console import Console

from a7sim.study.figures import response_figures
from a7sim.study.findings import MAX_DENSITIES, findings_document
from a7sim.study.loading import build_study
from a7sim.study.page import study_markdown
from a7sim.study.tables import study_tables
from a7sim.study.tally import Tally
from tests.test_study import BY_COMPARATOR

RESPONSE = "strip_plan_at_checks_m"
POINTINGS = {"name": "pointings", "path": "comparator.pointings", "levels": [1, 4]}
KIND = {"name": "kind", "path": "comparator.kind", "levels": ["mono", "stereo"]}
NOISE = 0.01 * np.random.default_rng(1).standard_normal((40, 8))


def found(folder, values, **changes):
    """Return the document of a study whose responses have values ``(cells, n)``, and its tables as text."""
    loaded = build_study(BY_COMPARATOR | {"responses": [RESPONSE]} | changes, folder)
    values = np.asarray(values, dtype=float)
    responses = len(loaded.responses)
    tally = Tally.empty(len(loaded.cells), responses)
    for i, each in enumerate(values):
        tally.add(i, np.tile(each, (responses, 1)))
    document = findings_document(loaded, tally)
    console = Console(width=200)
    with console.capture() as printed:
        console.print(study_tables(document))
    return document, printed.get()


@pytest.mark.parametrize(
    ("changes", "values", "answer"),
    [
        ({"factor": []}, 2.0 + NOISE[:1], " on the average."),
        ({}, np.full((2, 8), 2.0), ": 2 m on the average in every cell"),
        ({}, 2.0 + NOISE[:2] - NOISE[:2].mean(axis=1, keepdims=True), "; no factor was seen to matter."),
        ({}, np.array([[2.0], [3.0]]) + NOISE[:2], "; it depends on pointings (p < 0.001, partial eta² 1.00)."),
        ({}, np.array([[2.0], [np.nan]]) + NOISE[:2], " on the average"),
        ({}, np.full((2, 8), np.nan), ": every session gave up."),
    ],
    ids=["one cell", "nothing varies", "no effect", "an effect", "a cell gave up", "all gave up"],
)
def test_the_answer_contains_the_numbers(tmp_path, changes, values, answer):
    document, printed = found(tmp_path, values, **changes)
    assert answer in document["answer"][0]
    assert document["in_a_sentence"] == document["answer"][0]
    assert document["answer"][0] in " ".join(printed.split())
    lost = int(np.isnan(values).sum())
    assert [f"{lost} sessions gave up" in each for each in document["answer"][1:]] == ([True] if lost else [])
    assert printed.count("all gave up") == sum(np.isnan(each).all() for each in values)


def test_the_table_of_cells_shows_mean_spread_and_the_difference_from_the_first(tmp_path):
    document, printed = found(tmp_path, np.array([[2.0], [3.0]]) + NOISE[:2])
    rows = [line.split() for line in printed.splitlines()]
    (comparison,) = document["comparisons"]
    for cell, beside in zip(
        document["cells"], ([], [f"{comparison['difference']:+.3g}", f"{comparison['p_adjusted']:.3f}"]), strict=True
    ):
        spread = cell["responses"][RESPONSE]
        numbers = [f"{spread['mean']:.4g}", f"{spread['mean_interval'][1] - spread['mean']:.2g}", f"{spread['sd']:.3g}"]
        numbers += [f"{spread['quantiles']['0.5']['value']:.4g}", *beside]
        row = next(row for row in rows if row[:3] == [str(cell["cell"]), "pointings", cell["levels"]["pointings"]])
        assert row[3 : 4 + len(numbers)] == ["8", *numbers]


def test_factors_varied_one_at_a_time_have_an_analysis_each(tmp_path):
    values = np.array([[2.0], [3.0], [2.0]]) + NOISE[:3]
    document, printed = found(tmp_path, values, factor=[POINTINGS, KIND], design="one-at-a-time")
    assert [[source["source"] for source in each["sources"]] for each in document["variance"]] == [
        ["pointings", "remaining"],
        ["kind", "remaining"],
    ]
    assert "it depends on pointings (" in document["answer"][0]
    assert "kind" not in document["answer"][0].split("depends")[1]
    tested = document["variance"][0]["sources"][0]
    assert f"{tested['F']:.2f}" in printed


@pytest.mark.parametrize(
    ("slope", "words"),
    [
        (-1.0, "alone it follows film (100 % of the variance between cells, falling with it)"),
        (0.0, "no factor was seen to matter"),
    ],
)
def test_a_hypercube_reports_the_direction_of_a_factor_or_that_none_has_an_effect(tmp_path, slope, words):
    hypercube = {
        "design": "latin-hypercube",
        "samples": 40,
        "factor": [{"name": "film", "path": "film.irregular_um", "range": [0.0, 5.0]}],
    }
    loaded = build_study(BY_COMPARATOR | {"responses": [RESPONSE]} | hypercube, tmp_path)
    films = np.array([[cell.settings["film.irregular_um"]] for cell in loaded.cells])
    document, printed = found(tmp_path, 9.0 + slope * films + NOISE, **hypercube)
    assert words in document["answer"][0]
    (effects,) = document["main_effects"]
    assert f"{effects['factors'][0]['share']:.3f}" in printed
    assert f"{effects['chance']:.3f}" in printed
    assert document["variance"] == []


def test_density_curves_are_drawn_up_to_a_maximum_of_levels(tmp_path):
    levels = list(range(1, MAX_DENSITIES + 2))
    for count in (MAX_DENSITIES, MAX_DENSITIES + 1):
        document, _ = found(tmp_path, 2.0 + NOISE[:count], factor=[POINTINGS | {"levels": levels[:count]}])
        assert len(document["densities"]) == (count <= MAX_DENSITIES)
        assert len(document["levels"]) == count


@pytest.mark.parametrize(("half_width", "reached"), [(1e-6, False), (1.0, True)])
def test_a_precision_that_is_not_reached_is_reported(tmp_path, half_width, reached):
    precision = {"response": RESPONSE, "half_width": half_width}
    document, printed = found(tmp_path, 2.0 + NOISE[:2], precision=precision)
    assert document["precision_reached"] is reached
    assert ("The precision asked for is not reached." in printed) is not reached


CLAIM = {"says": "One pointing does.", "about": "the second pointing", "factor": "pointings", "responses": [RESPONSE]}


@pytest.mark.parametrize(
    ("claim", "values", "verdict", "answer"),
    [
        ({"differ": [["1"], ["4"]]}, np.array([[2.0], [3.0]]) + NOISE[:2], "matters", ", 4 minus 1: +"),
        ({"alike": ["1", "4"]}, np.array([[2.0], [3.0]]) + NOISE[:2], "matters", ", 4 minus 1: +"),
        (
            {"differ": [["1"], ["4"]]},
            [[2.0], [3.0]],
            "is left open",
            "p unknown: left open by this number of replicates.",
        ),
    ],
    ids=["they differ", "they are not alike", "one replicate"],
)
def test_a_claim_is_printed_with_its_verdict_and_every_answer(tmp_path, claim, values, verdict, answer):
    document, printed = found(tmp_path, values, claim=[CLAIM | claim])
    printed = " ".join(printed.split())
    (result,) = document["claims"]
    assert result["verdict"] == verdict
    assert f"the second pointing {verdict} Claim: One pointing does." in printed
    assert document["in_a_sentence"].startswith(f"The second pointing {verdict}")
    (sentence,) = result["answer"]
    assert answer in sentence
    assert " ".join(sentence.split()) in printed


def test_each_response_of_a_hypercube_has_its_own_effects_everywhere(tmp_path):
    hypercube = {
        "design": "latin-hypercube",
        "samples": 12,
        "factor": [{"name": "film", "path": "film.irregular_um", "range": [0.0, 5.0]}],
        "responses": [RESPONSE, "strip_height_at_checks_m"],
    }
    document, printed = found(tmp_path, 2.0 + NOISE[:12], **hypercube)
    assert [each["response"] for each in document["main_effects"]] == hypercube["responses"]
    assert printed.count("of that, chance") == 2
    page, _ = study_markdown(document, "figures")
    assert page.count("What each factor weighs alone") == 2


def test_a_page_highlights_that_all_gave_up_and_that_a_precision_is_not_reached(tmp_path):
    precision = {"response": RESPONSE, "half_width": 1e-6}
    page, figures = study_markdown(found(tmp_path, np.full((2, 8), np.nan), precision=precision)[0], "figures")
    assert "**Every session gave up.**" in page
    assert "**The precision asked for is not reached.**" in page
    assert figures == {}


@pytest.mark.parametrize(
    ("factor", "places"),
    [
        (POINTINGS, {"counts": "pointings", "at": {"1": 1, "4": 4}}),
        (
            {"name": "heights", "path": "strip.polynomial", "levels": [2, 3]},
            {"counts": "heights", "at": {"2": 2, "3": 3}},
        ),
    ],
)
def test_numeric_levels_have_their_positions_on_an_axis(tmp_path, factor, places):
    document, _ = found(tmp_path, 2.0 + NOISE[:2], factor=[factor])
    assert document["places"] == {factor["name"]: places}


def test_pairs_of_numbers_have_distances_in_proportion(tmp_path):
    levels = {"name": "levels", "path": "plan.centre_levels", "levels": [[4900.0, 5100.0], [4800.0, 5200.0]]}
    at_the_plotter = {"scenario": "akwanga", "settings": {}, "responses": ["hours"]}
    document, _ = found(tmp_path, 2.0 + NOISE[:2], factor=[levels], **at_the_plotter)
    (places,) = document["places"].values()
    assert places == {"counts": "separation of levels", "at": {"4900 - 5100": 200.0, "4800 - 5200": 400.0}}


def test_levels_far_apart_have_a_logarithmic_axis_and_too_many_cells_are_not_drawn_singly(tmp_path, monkeypatch):
    factor = {"name": "film", "path": "film.irregular_um", "levels": [0.1, 1.0]}
    document, _ = found(tmp_path, 2.0 + NOISE[:2], factor=[factor])
    document["densities"] = []
    drawn = {}
    for most in (2, 1):
        monkeypatch.setattr("a7sim.study.figures.MAX_CELLS_DRAWN", most)
        drawn[most] = [each.caption for each in response_figures(document, document["responses"][0])]
    assert len(drawn[2]) == 2
    assert drawn[1] == drawn[2][:1]
    assert "against film" in drawn[1][0]
