"""A run computes the strip: its models on the ground, and all combinations of the cases of its models."""

import csv
import json
import re

import numpy as np
import pytest

from a7sim.errors import A7SimError
from a7sim.reduction import Ground, absolute_orientation, formed_strip, read_cards
from a7sim.report.render import render_report
from a7sim.report.session_folder import read_session
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.session import run
from a7sim.session.strip_combinations import run_combinations
from a7sim.strip_methods.strip import (
    card_numbers,
    ground_control,
    models_from_documents,
    orient_strip,
    oriented_strip_document,
)
from tests.support.html_pages import Page
from tests.support.sessions import tilted_flight
from tests.test_cli import a7sim


def residuals(strip, role):
    return np.array([[each[axis] for axis in "XYZ"] for each in strip["residuals_m"].values() if each["role"] == role])


@pytest.fixture(scope="module")
def all_strips(finished):
    session = finished("all strips")
    results = json.loads((session.folder / "results.json").read_text(encoding="utf-8"))
    return results, session.folder, session.result.stdout


def test_without_errors_the_strip_returns_the_ground_within_the_least_counts():
    """Counters cause 0.02 gon in a model and 0.12 mm in the height of a centre; film and eye add nothing.

    0.02 gon over a base are 0.23 m in plan; 0.15 is a bound for this session, which has 0.122 (below 0.12 before
    drums were turned finely).
    """
    strip = run(tilted_flight([(0.4, -0.3, 0.2), (-0.5, 0.6, -0.4), (0.2, 0.1, 0.5)]), 5)["strip"]
    everywhere = np.concatenate([residuals(strip, "control"), residuals(strip, "check")])
    assert np.abs(everywhere[:, :2]).max() < 0.15
    assert np.abs(everywhere[:, 2]).max() < 0.25
    assert strip["joins"][0]["max_residual_mm"] < 0.15


def test_accuracy_is_given_for_control_and_checks_separately(all_strips):
    """Accuracy is the rms of the residuals of that role; plan is the distance of both coordinates."""
    for strip in all_strips[0]["strips"]:
        for on, role in (("control", "control"), ("checks", "check")):
            rms = np.sqrt((residuals(strip, role) ** 2).mean(axis=0))
            accuracy = strip["accuracy_m"][on]
            assert accuracy["plan"] == pytest.approx(np.hypot(rms[0], rms[1]))
            assert accuracy["height"] == pytest.approx(rms[2])
            assert accuracy["points"] == 6


def test_checks_do_not_affect_the_strip():
    """A check moved by ten metres changes only its own residual; a control point changes the strip."""
    scenario = load_scenario("akwanga", {"plan.parallax_readings": "1"})
    models = models_from_documents(run(scenario, 3)["models"])
    ground = ground_control(scenario, build_scene(scenario, 3))

    def strip_with(name):
        moved = ground.coordinates.copy()
        moved[:, ground.points.index(name)] += 10.0
        return oriented_strip_document(orient_strip(models, Ground(ground.points, moved, ground.roles)))

    strip = oriented_strip_document(orient_strip(models, ground))
    with_check = strip_with("K2")
    assert with_check["absolute"] == strip["absolute"]
    changed = [name for name, each in strip["residuals_m"].items() if each != with_check["residuals_m"][name]]
    assert changed == ["K2"]
    assert with_check["residuals_m"]["K2"]["X"] == pytest.approx(strip["residuals_m"]["K2"]["X"] - 10.0)
    assert strip_with("C3")["absolute"] != strip["absolute"]


def test_twenty_five_strips_are_numbered_as_in_the_thesis(all_strips):
    document, out, _ = all_strips
    cases = ["".join(strip["cases"]) for strip in document["strips"]]
    assert len(cases) == len(set(cases)) == 25
    assert (cases[0], cases[1], cases[5], cases[24]) == ("AA", "AB", "BA", "EE")
    assert [strip["number"] for strip in document["strips"]] == list(range(1, 26))
    with (out / "strips.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["cases"] for row in rows] == cases
    assert float(rows[24]["checks_height_m"]) == pytest.approx(
        document["strips"][24]["accuracy_m"]["checks"]["height"], abs=1e-4
    )
    assert {path.name for path in out.iterdir()} >= {f"case-{case}" for case in "ABCDE"}


def test_a_strip_of_equal_cases_equals_that_of_a_run_of_this_case(all_strips):
    document, out, _ = all_strips
    for number, case in ((1, "A"), (13, "C"), (25, "E")):
        alone = json.loads((out / f"case-{case}" / "results.json").read_text(encoding="utf-8"))["strip"]
        strip = document["strips"][number - 1]
        assert {key: strip[key] for key in alone} == alone


def test_the_text_diagram_names_the_points_of_every_case_and_the_ties(all_strips):
    words = all_strips[0]["strips"][3]["in_words"]
    assert "model 1 (101 and 102) case A, oriented on 1 2 3 4 5 6;" in words
    assert "model 2 (102 and 103) case D, oriented on 1 2 3 4 5 6 d e f;" in words
    assert set(words.rpartition("joined on ")[2].split()) == {"102:centre", "1021", "1023", "1025", "C3", "C4"}


def test_cards_of_a_run_reproduce_its_strip(all_strips):
    """The cards read, joined and oriented give the strip of the session to three decimals."""
    _, out, _ = all_strips
    folder = out / "case-A"
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    deck = read_cards(folder / "strip.crd")
    assert [len(model.points) for model in deck.models] == [len(m["points"]) + 1 for m in results["models"]]
    oriented = absolute_orientation(formed_strip(deck.models), deck.ground)
    with (folder / "strip-numbers.csv").open(encoding="utf-8") as file:
        number = {row["point"]: row["number"] for row in csv.DictReader(file)}
    with (folder / "strip.csv").open(encoding="utf-8") as file:
        strip = {row["point"]: [float(row[axis]) for axis in "XYZ"] for row in csv.DictReader(file)}
    for point in ("C1", "K5", "1023", "102:centre"):
        back = oriented.model.at([number[point]])[:, 0]
        np.testing.assert_allclose(back, strip[point], atol=0.03)


def test_points_get_card_numbers_of_their_own():
    key = card_numbers(["9001", "C1", "1023", "102:centre", "123456", "x:centre"])
    assert list(key.values()) == ["9001", "9002", "1023", "102:centre", "9003", "9004:centre"]


def test_accuracy_is_of_the_order_of_the_theses_first_case(all_strips):
    """The thesis prints 0.16 in plan and height for case 1; no operator here gets the values of case 25 (2.9, 0.5)."""
    for strip in all_strips[0]["strips"]:
        checks = strip["accuracy_m"]["checks"]
        assert 0.02 < checks["plan"] < 0.16
        assert 0.03 < checks["height"] < 0.16


def test_a_scenario_without_control_or_of_too_many_models_is_rejected():
    with pytest.raises(A7SimError, match="expected ground control in the scenario, got none"):
        run_combinations(load_scenario("dewitt-pair"), 1)


def test_the_command_line_prints_one_line_for_each_strip(all_strips):
    lines = re.findall(r"^\d+ +[A-E] [A-E] .*$", all_strips[2], re.M)
    assert len(lines) == 25
    assert lines[24].split()[1:3] == ["E", "E"]
    wrong = a7sim("run", "akwanga", "--strips", "all", "--case", "B")
    assert wrong.returncode == 2
    assert "--strips all: expected no --case beside it" in wrong.stderr


def test_a_run_without_control_reports_that_there_is_no_strip(finished):
    done = finished("dewitt-pair", 7).result
    assert "No strip on the ground: the scenario has no ground control" in done.stdout


def test_the_command_line_reproduces_schuts_strip_to_a_millimetre():
    """S: eleven exactly vertical photographs, 3 km bases; horizontal and vertical control at the ends."""
    done = a7sim("run", "schut-1956", "--json")
    assert done.returncode == 0, done.stderr
    strip = json.loads(done.stdout)["ways"]["comparator"]
    assert len(strip["joins"]) == 9
    assert max(strip["accuracy_m"]["checks"]["largest"].values()) < 0.001


def test_the_strip_of_paper_p_is_measured_by_two_methods(finished):
    out, done = finished("a8-strip")
    document = json.loads((out / "results.json").read_text(encoding="utf-8"))
    assert set(document["ways"]) == {"comparator", "A8"}
    for strip in document["ways"].values():
        assert len(strip["joins"]) == 7
        assert strip["polynomial"]["accuracy_m"]["checks"]["points"] == 36
        assert strip["polynomial"]["accuracy_m"]["control"]["points"] == 9
    assert document["a8_minus_comparator_m"]["points"] >= 36
    assert {path.name for path in out.iterdir()} == {
        "results.json", "comparator-models.csv", "comparator-strip.csv", "a8-models.csv", "a8-strip.csv"
    }  # fmt: skip
    for words in ("Strip, comparator", "Strip, A8", "After the polynomial of degree 2", "A8 minus"):
        assert words in done.stdout


def test_the_report_of_all_strips_has_a_row_and_a_mark_for_each(all_strips):
    """The numbers are those of the results; each case's folder has a report of its own, with its own command."""
    document, out, _ = all_strips
    page = Page(render_report(read_session(out)))
    table = page.table("Strips of all cases, rms residuals in m")
    assert [row[0] for row in table.rows] == [str(strip["number"]) for strip in document["strips"]]
    assert [row[5] for row in table.rows] == [f"{s['accuracy_m']['checks']['plan']:.3f}" for s in document["strips"]]
    assert sum(tag == "svg" for tag, _ in page.elements) == 2
    alone = json.loads((out / "case-C" / "results.json").read_text(encoding="utf-8"))
    assert alone["command_line"] == "a7sim run akwanga --seed 1985 --case C --set plan.parallax_readings=1"
