"""Every session ends with a complete journal, book and results."""

import json

import msgspec
import pytest

from a7sim.errors import A7SimError
from a7sim.operator.procedures.grid_test import GridTestPlan
from a7sim.scenario import load_scenario
from a7sim.session import ProgressCallbacks, RunOptions, run
from a7sim.session.bridge import run_bridge
from a7sim.session.compiling import CompilationRequest, compile_model
from a7sim.session.grid_test import run_grid_test


def calibrated(scenario, seed, options):
    order = GridTestPlan(scenario.camera, scenario.grid_plate, 9, 1, 1, "positive")
    return run_grid_test(scenario, seed, order, options)


WORK = {
    "run": (run, "akwanga"),
    "bridge": (run_bridge, "bridge"),
    "compile": (
        lambda scenario, seed, options: compile_model(scenario, seed, CompilationRequest("1", interval=10.0), options),
        "akwanga",
    ),
    "calibrate": (calibrated, "grid-test"),
}


def results_of(out):
    return json.loads((out / "results.json").read_text())


@pytest.mark.parametrize("what", list(WORK))
def test_an_interrupted_session_leaves_complete_files(what, tmp_path):
    work, name = WORK[what]
    out = tmp_path / "out"

    def interrupt(_):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        work(load_scenario(name), 1, RunOptions(out, callbacks=ProgressCallbacks(on_activity=interrupt)))
    document = results_of(out)
    assert (document["status"], document["message"].split()[-2:]) == ("interrupted", ["was", "interrupted"])
    assert document["operator"]["book_entries"] == len((out / "book.csv").read_text().splitlines()) - 1
    header, *events = map(json.loads, (out / "session.jsonl").read_text().splitlines())
    assert header["seed"] == 1
    lines = [event for event in events if event.get("dir") in (">", "<")]
    assert len(lines) == document["operator"]["lines_over_the_link"]


@pytest.mark.parametrize("what", ["run", "compile"])
def test_an_operator_that_gives_up_reports_the_reason_and_the_document_equals_the_file(what, tmp_path):
    work, name = WORK[what]
    scenario = load_scenario(name, {"photos.0.laid": '"upside down"'})
    document = work(scenario, 1, RunOptions(tmp_path / "out"))
    assert document["status"] == "does not fit"
    assert "upside down" in document["message"]
    assert results_of(tmp_path / "out") == json.loads(json.dumps(document))


def test_another_error_is_written_to_the_file_and_raised(tmp_path):
    def fail(_):
        raise A7SimError("the lamp has burnt out")

    with pytest.raises(A7SimError, match="burnt out"):
        run(load_scenario("akwanga"), 1, RunOptions(tmp_path / "out", callbacks=ProgressCallbacks(on_activity=fail)))
    document = results_of(tmp_path / "out")
    assert (document["status"], document["message"]) == ("failed", "the lamp has burnt out")


def test_without_settings_of_a_plotter_nothing_is_written(tmp_path):
    scenario = msgspec.structs.replace(load_scenario("akwanga"), plotting=None)
    with pytest.raises(A7SimError, match="plan: expected the settings of a plotter"):
        run(scenario, 1, RunOptions(tmp_path / "out"))
    assert not (tmp_path / "out").exists()
