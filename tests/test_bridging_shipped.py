"""The bundled strip of ten models, bridged completely: a separate file, so that another worker can run it."""

import json
from itertools import islice

import pytest

from a7sim.operator.procedures.bridging import bridge_strip_batch
from a7sim.report.render import render_report
from a7sim.report.session_folder import read_session
from a7sim.scenario import load_scenario
from a7sim.session.bridge import bridge_tables
from a7sim.session.session_batch import open_batch
from tests.support.html_pages import Page


@pytest.fixture(scope="module")
def bundled_strip(finished):
    """Return scenario, results and folder of the bundled strip of ten models, bridged and as independent models."""
    out = finished("bridge", 2).folder
    results = json.loads((out / "results.json").read_text(encoding="utf-8"))
    return load_scenario("bridge", {"plan.parallax_readings": "1"}), results, out


@pytest.mark.slow
def test_the_bundled_strip_is_complete_when_bridged_and_as_independent_models(bundled_strip):
    _, document, _ = bundled_strip
    assert (document["status"], document["message"]) == ("complete", "")
    for way in ("bridged", "independent"):
        assert document[way]["strip"]["accuracy_m"]["checks"]["points"] == 20
        assert document[way]["strip"]["accuracy_m"]["checks"]["plan"] < 1.5
    assert len(document["bridged"]["models"]) == 10
    assert document["bridged"]["strip"].keys() == document["independent"]["strip"].keys() - {"joins"}
    bridge_tables(document)


@pytest.mark.slow
def test_a_bridge_writes_its_files(bundled_strip):
    _, document, out = bundled_strip
    journal = {"session.jsonl", "session.scenario.json", "session.states.jsonl"}
    assert {"independent", "book.csv", "models.csv", "results.json", *journal} == {p.name for p in out.iterdir()}
    assert json.loads((out / "independent" / "results.json").read_text())["strip"] == document["independent"]["strip"]


@pytest.mark.slow
def test_a_strip_is_the_same_over_the_link_and_in_a_batch(bundled_strip):
    """One procedure, two drivers: every reading of a session is equal, also with errors."""
    scenario, document, out = bundled_strip
    models = list(islice(bridge_strip_batch(open_batch(scenario, (2,)).workstation), 2))
    rows = [row.split(",")[:2] for row in (out / "models.csv").read_text().splitlines()[2:]]
    points = [[model.model.name, point] for model in models for point in model.coordinates_of(0)]
    assert rows[: len(points)] == points
    for written, model in zip(document["bridged"]["models"], models, strict=False):
        assert written["elements"] == {name: each[0] for name, each in model.orientation.elements.items()}
        assert written["scale"] == pytest.approx(model.scale[0], abs=1e-7)


@pytest.mark.slow
def test_the_report_of_a_bridge_has_both_strips(bundled_strip):
    _, document, out = bundled_strip
    page = Page(render_report(read_session(out)))
    table = page.table("Bridged models: scale carried by bx, rms of differences at common points")
    assert [row[3] for row in table.rows] == [f"{model['scale']:.5f}" for model in document["bridged"]["models"]]
    text = "".join(page.text)
    assert "Strip, bridged: residuals in plan" in text
    assert "Strip, independent: plan and profile" in text
