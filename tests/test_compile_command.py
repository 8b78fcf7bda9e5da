"""The command `a7sim compile`: its folder, the map against the true ground, its table, its error messages."""

import json
import xml.etree.ElementTree as ET
from collections import Counter

import numpy as np
import pytest

from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.session.compiling import HALF_INTERVAL_FACTOR
from tests.support.processes import a7sim_in_process

SEED = 1985
HEIGHT = 471.0
CONTROL = {"C1", "C2", "C3", "C4"}
"""Points of control in model 1."""

WORDS = ("--seed", SEED, "--contour", f"{HEIGHT:g}", "--line", "road1", "--line", "track1")
"""Arguments of the session in the gallery."""


@pytest.fixture(scope="module")
def compiled(finished):
    """Return the result and the folder of the command."""
    out, result = finished("compile", SEED)
    return result, out


@pytest.fixture(scope="module")
def results(compiled):
    return json.loads((compiled[1] / "results.json").read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def features(compiled):
    return json.loads((compiled[1] / "map.geojson").read_text(encoding="utf-8"))["features"]


@pytest.fixture(scope="module")
def scene():
    return build_scene(load_scenario("akwanga"), SEED)


def drawn(features, kind):
    """Return the lines of a kind: name and coordinates ``(3, n)``, m."""
    return [
        (each["properties"]["name"], np.array(each["geometry"]["coordinates"]).T)
        for each in features
        if each["properties"]["kind"] == kind
    ]


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.slow
def test_a_complete_compilation_writes_map_book_journal_and_results(compiled, results):
    result, out = compiled
    assert (result.returncode, result.stderr) == (0, "")
    promised = {"map.svg", "map.geojson", "book.csv", "session.jsonl", "results.json"}
    assert promised <= {each.name for each in out.iterdir()}
    assert (results["command"], results["status"], results["seed"]) == ("compile", "complete", SEED)
    assert results["map_scale"] * 1.5 == results["model_scale"] == 3750.0


@pytest.mark.slow
def test_the_map_contains_the_lines_spot_heights_and_control_of_the_results(features, results):
    kinds = Counter(each["properties"]["kind"] for each in features)
    assert kinds == {
        **Counter(each["kind"] for each in results["lines"]),
        "spot height": results["spot_heights"],
        "control": len(CONTROL),
    }
    named = {each["properties"].get("name") for each in features if each["properties"]["kind"] == "control"}
    assert named == CONTROL == set(results["levelling"]["residuals_m"])
    assert {each["name"] for each in results["lines"]} == {f"contour {HEIGHT:g}", "road1", "track1"}
    assert [each["vertices"] for each in results["lines"] if each["kind"] == "contour"] == [
        places.shape[1] for _, places in drawn(features, "contour")
    ]


@pytest.mark.slow
def test_the_errors_in_the_results_are_the_differences_of_map_and_true_ground(features, results, scene):
    contours = [places for _, places in drawn(features, "contour")]
    errors = np.concatenate([places[2] - scene.ground.height(*places[:2]) for places in contours])
    beside = results["beside_the_truth"]["contours"]
    assert all((places[2] == HEIGHT).all() for places in contours)
    assert beside["rms_height_m"] == pytest.approx(rms(errors), abs=2e-4)
    assert beside["largest_m"] == pytest.approx(np.abs(errors).max(), abs=2e-3)
    assert beside["smallest_interval_m"] == pytest.approx(HALF_INTERVAL_FACTOR * rms(errors), abs=1e-3)
    assert beside["rms_height_m"] < 0.15, "docs/compilation.md: 0.07 m"
    off = {each["name"]: each for each in results["lines"] if each["kind"] != "contour"}
    for name, places in (*drawn(features, "road"), *drawn(features, "track")):
        true = rms([float(scene.lines[name].distance(place[:, None])[0]) for place in places[:2].T])
        assert off[name]["rms_off_m"] == pytest.approx(true, abs=2e-3)
        assert off[name]["rms_height_m"] == pytest.approx(rms(places[2] - scene.ground.height(*places[:2])), abs=2e-3)


@pytest.mark.slow
def test_the_sheet_draws_every_line_of_the_results_once(compiled, results):
    root = ET.fromstring((compiled[1] / "map.svg").read_text(encoding="utf-8"))
    classes = Counter((each.get("class") or "").split(" ")[0] for each in root.iter())
    kinds = Counter(each["kind"] for each in results["lines"])
    assert classes["contour"] == kinds["contour"]
    assert (classes["casing"], classes["surface"], classes["track"]) == (kinds["road"], kinds["road"], kinds["track"])
    closed = [each for each in results["lines"] if each["closed"]]
    assert len([each for each in root.iter() if each.tag.endswith("polygon") and "contour" in each.get("class")]) == (
        len(closed)
    )


@pytest.mark.slow
def test_the_printed_table_contains_the_numbers_of_the_results(compiled, results):
    printed = " ".join(compiled[0].stdout.split())
    beside = results["beside_the_truth"]["contours"]
    for each in results["lines"]:
        ends = "closed" if each["closed"] else " ".join(each["endings"])
        numbers = [each["rms_height_m"], each["largest_height_m"], each.get("rms_off_m"), each.get("largest_off_m")]
        row = [each["name"], ends, str(each["vertices"]), f"{each['length_m']:.0f}"]
        assert " ".join(row + [f"{value:.3f}" for value in numbers if value is not None]) in printed
    for words in (
        f"{results['spot_heights']} spot heights",
        f"Contours against the true ground: rms {beside['rms_height_m']:.3f} m",
        f"C-factor {beside['c_factor']}",
        f"{results['operator']['hours']:.1f} hours at the instrument",
    ):
        assert words in printed


@pytest.mark.slow
def test_an_operator_that_gives_up_leaves_results_without_a_map_and_exit_code_1(tmp_path):
    result = a7sim_in_process(
        "compile", "akwanga", *WORDS, "--set", "photos.1.laid=upside down", "--out", tmp_path / "out"
    )  # fmt: skip
    document = json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))
    assert result.returncode == 1
    assert document["status"] == "does not fit"
    assert result.stderr == f"a7sim: the operator gave up: {document['message']}\n"
    assert " ".join(result.stdout.split()) == f"does not fit: {document['message']}"
    assert not (tmp_path / "out" / "map.svg").exists()


@pytest.mark.parametrize(
    ("scenario", "words", "sentence"),
    [
        ("akwanga-a8", ("--contour", "455"), "instrument.variant: expected a plotter with by and bz"),
        ("dewitt-pair", ("--contour", "455"), "--model 1: expected photographs that show the ground, got measured"),
        ("akwanga", ("--contour", "455", "--set", "plan.plan_gear=2-2-2"), "plan.plan_gear: expected"),
        ("akwanga", (), "compile: expected a --contour, an --interval or a --line to be drawn, got none"),
    ],
)
def test_a_model_that_cannot_be_drawn_is_refused_in_one_sentence(typed, scenario, words, sentence):
    code, printed, error = typed("compile", scenario, *words)
    assert (code, printed, error.count("\n")) == (2, "", 1)
    assert sentence in error
