"""Behaviour of the command line: options, printed text and written files."""

import csv
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from a7sim.errors import A7SimError
from tests.support.gallery import READ_ONCE
from tests.support.processes import a7sim as in_a_process
from tests.support.processes import a7sim_in_process

ROOT = Path(__file__).parents[1]
WORK_FILES = {
    "session.jsonl",
    "session.scenario.json",
    "session.states.jsonl",
    "book.csv",
    "models.csv",
    "results.json",
}
STRIP_FILES = {"strip.csv", "strip.crd", "strip-output.crd", "strip-numbers.csv"}
FILES = WORK_FILES | STRIP_FILES

PROGRAM_WITH_CTRL_C = """
import runpy, signal
signal.signal(signal.SIGINT, signal.default_int_handler)
runpy.run_module("a7sim", run_name="__main__")
"""
"""The command line with SIGINT enabled, also if the test run was started in the background and ignores it."""


def a7sim(*arguments, cwd=ROOT):
    return a7sim_in_process(*arguments, cwd=cwd)


@pytest.fixture(scope="module")
def akwanga_run(finished):
    out, done = finished("akwanga read once", 7)
    return done, out


def test_import_and_help_load_no_heavy_library():
    for program in ("import a7sim", "import sys; sys.argv = ['a7sim', '--help']; import a7sim.cli; a7sim.cli.main()"):
        seen = subprocess.run(
            [
                sys.executable,
                "-c",
                f"import atexit, sys; atexit.register(lambda: print(sorted(sys.modules)))\n{program}",
            ],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        modules = seen[seen.rindex("[") :]
        for heavy in ("scipy", "textual", "matplotlib"):
            assert f"'{heavy}" not in modules
        assert "'a7sim'" in modules


def test_a_run_prints_the_tables_of_the_thesis_beside_the_truth(akwanga_run):
    done, _ = akwanga_run
    for words in (
        "Model 1: 101 and 102, base inside",
        "Model 2: 102 and 103, base outside",
        "Numerical relative orientation, independent, case A",
        "Elements as set",
        "Residual y-parallaxes at the standard points",
        "Perspective centres, counter units",
        "Against the flight",
        "hours at the instrument",
    ):
        assert words in done.stdout
    assert done.stderr == ""


def test_a_run_writes_its_files(akwanga_run):
    _, out = akwanga_run
    assert {path.name for path in out.iterdir()} == FILES


def test_results_contain_the_documented_keys(akwanga_run):
    _, out = akwanga_run
    results = json.loads((out / "results.json").read_text(encoding="utf-8"))
    assert list(results)[:2] == ["schema_version", "command"]
    assert results["schema_version"] == 1
    assert results["seed"] == 7
    assert [model["model"] for model in results["models"]] == ["1", "2"]
    for model in results["models"]:
        orientation = model["relative_orientation"]
        assert (orientation["method"], orientation["case"]) == ("independent", "A")
        assert orientation["iterations"] == len(orientation["rounds"]) >= 3
        assert set(orientation["residual_parallax_mm"]) == set("123456abcdefghi")
        assert {"kappa1", "kappa2", "phi1", "phi2", "omega1", "omega2", "by1", "by2", "bx"} <= set(
            orientation["elements"]
        )
        assert all(round(value, 2) == value for value in orientation["elements"].values())
        for side in ("left", "right"):
            names = {"X0", "Y0", "Z0", "T0", "sigma_X0", "sigma_Y0", "sigma_Z0", "sigma_T0", "rms"}
            assert set(model["perspective_centres"][side]) == names
            for axis in ("X0", "Y0", "Z0"):
                truth = model["truth"]["centres"][side][axis]
                difference = model["truth"]["centre_differences"][side][axis]
                assert model["perspective_centres"][side][axis] - truth == pytest.approx(difference, abs=2e-5)
        assert {"relative_rotation", "base_direction", "rotation_difference_gon"} <= set(model["truth"])


def test_the_journal_contains_every_line_in_order_with_simulated_time(akwanga_run):
    _, out = akwanga_run
    header, *lines = map(json.loads, (out / "session.jsonl").read_text(encoding="utf-8").splitlines())
    assert header["schema_version"] == 3
    assert (header["seed"], header["variant"], header["command"]) == (7, "A7", "run")
    assert [line["t"] for line in lines] == sorted(line["t"] for line in lines)
    assert {line.get("kind") for line in lines} == {None, "entry", "strike", "state"}
    entries = [line for line in lines if line.get("kind") == "entry"]
    assert len(entries) == json.loads((out / "results.json").read_text())["operator"]["book_entries"]
    events = [line for line in lines if "dir" in line]
    assert {event["dir"] for event in events} == {"+", ">", "<"}
    asked = [event for event in events if event["dir"] == ">" and "?" in event["text"].split('"')[0]]
    answered = [event for event in events if event["dir"] == "<"]
    assert len(asked) == len(answered) > 1000
    assert any(event.get("text", "").startswith("NOTE") for event in events)
    assert events[-1]["t"] > 3600.0


def test_the_book_and_the_models_are_tables(akwanga_run):
    _, out = akwanga_run
    rows = list(csv.DictReader((out / "book.csv").read_text(encoding="utf-8").splitlines()))
    assert {"relative orientation", "model coordinates", "left perspective centre"} <= {row["form"] for row in rows}
    assert [int(row["number"]) for row in rows] == list(range(1, len(rows) + 1))
    lines = (out / "models.csv").read_text(encoding="utf-8").splitlines()
    models = list(csv.DictReader(line for line in lines if not line.startswith("#")))
    assert list(models[0]) == ["model", "point", "X", "Y", "Z"]
    centres = {(row["model"], row["point"]) for row in models if row["point"].endswith(":centre")}
    assert centres == {("1", "101:centre"), ("1", "102:centre"), ("2", "102:centre"), ("2", "103:centre")}
    places = {(row["model"], row["point"]): row for row in models}
    height = float(places["1", "101:centre"]["Z"]) - float(places["1", "1011"]["Z"])
    assert 310.0 < height < 340.0


def test_the_same_seed_gives_the_same_bytes_and_another_gives_other_numbers(akwanga_run, tmp_path):
    """Also in another process, which has another hash seed."""
    _, out = akwanga_run
    again = in_a_process("run", ROOT / "scenarios/akwanga.toml", "--seed", 7, *READ_ONCE, "--out", tmp_path / "again")
    assert again.returncode == 0
    for name in FILES:
        assert (tmp_path / "again" / name).read_bytes() == (out / name).read_bytes()
    assert a7sim("run", "akwanga", "--seed", 8, *READ_ONCE, "--out", tmp_path / "other").returncode == 0
    for name in FILES - {"strip-numbers.csv"}:
        assert (tmp_path / "other" / name).read_bytes() != (out / name).read_bytes()


def test_json_prints_one_document_and_nothing_else(akwanga_run):
    _, out = akwanga_run
    done = a7sim("run", "scenarios/akwanga.toml", "--seed", 7, *READ_ONCE, "--json")
    assert done.stdout.encode() == (out / "results.json").read_bytes()
    assert done.stderr == ""


def test_quiet_prints_nothing():
    done = a7sim("run", "dewitt-pair", *READ_ONCE, "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


def test_options_reach_the_session():
    options = ("--method", "dependent", "--perfect-observer", "--case", "c", "--set", "plan.bx=190")
    done = a7sim("run", "dewitt-pair", *options, "--json")
    results = json.loads(done.stdout)
    assert results["method"] == "dependent"
    assert results["models"][0]["relative_orientation"]["elements"]["bx"] == 190.0
    assert results["operator"]["struck_out"] == 0
    assert results["case"] == "C"


def test_an_existing_folder_is_refused_unless_forced_and_nothing_in_it_is_lost(tmp_path):
    thesis = tmp_path / "thesis.txt"
    thesis.write_text("mine", encoding="utf-8")
    refused = a7sim("run", "dewitt-pair", "--out", tmp_path)
    assert refused.returncode == 2
    assert refused.stderr.count("\n") == 1
    assert "--force" in refused.stderr
    assert {path.name for path in tmp_path.iterdir()} == {"thesis.txt"}
    assert a7sim("run", "dewitt-pair", *READ_ONCE, "--out", tmp_path, "--force").returncode == 0
    assert {path.name for path in tmp_path.iterdir()} == WORK_FILES | {"thesis.txt"}
    assert thesis.read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "nowhere"], ["nowhere", "akwanga"]),
        (["run", "akwanga", "--set", "plan.bx=long"], ["plan.bx", "10 to 280", "long"]),
        (["run", "akwanga", "--set", "plan"], ["--set", "PATH=VALUE"]),
        (["run", "akwanga", "--case", "F"], ["--case", "'F'"]),
        (["run", "akwanga", "--seed", "-1"], ["--seed"]),
        (["run", "akwanga", "--out", "Makefile"], ["Makefile", "folder"]),
        (["scenario", "validate", "LICENSE"], ["LICENSE", "TOML"]),
        (["run", "x" * 5000], ["x" * 100, "readable"]),
        (["run", "akwanga", "--set", "instrument.serial=Ä1"], ["instrument.serial", "ASCII"]),
        (["run", "akwanga", "--set", "photos.-1.phi=1"], ["photos.-1.phi"]),
        (["run", "akwanga", "--out", "/dev/null/here"], ["/dev/null/here", "folder"]),
        (["stereo"], ["stereo"]),
    ],
)
def test_bad_input_ends_with_one_sentence_and_exit_code_2_without_traceback(arguments, words):
    done = a7sim(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    last = done.stderr.strip().splitlines()[-1]
    for word in words:
        assert word in last


def test_bad_input_keeps_earlier_results_and_makes_no_new_folder(finished, tmp_path):
    out = finished("dewitt-pair", 7).copy_to(tmp_path / "out")
    before = {path.name: path.read_bytes() for path in out.iterdir()}
    (tmp_path / "dewitt-pair.csv").write_bytes("point,xl,yl,xr,yr\nä,1,2,3,4\n".encode("latin-1"))
    (tmp_path / "bad.toml").write_bytes((ROOT / "scenarios" / "dewitt-pair.toml").read_bytes())
    assert a7sim("run", tmp_path / "bad.toml", "--out", out, "--force").returncode == 2
    assert {path.name: path.read_bytes() for path in out.iterdir()} == before
    assert a7sim("run", tmp_path / "bad.toml", "--out", tmp_path / "new").returncode == 2
    assert not (tmp_path / "new").exists()


def test_names_may_contain_commas(tmp_path):
    scenario = (ROOT / "scenarios" / "akwanga.toml").read_text(encoding="utf-8")
    scenario = scenario.replace('"C1"', '"C,1"').replace('"101"', '"1,01"')
    (tmp_path / "commas.toml").write_text(scenario, encoding="utf-8")
    results = json.loads(a7sim("run", tmp_path / "commas.toml", *READ_ONCE, "--json").stdout)
    assert results["status"] == "complete"
    assert "C,1" in results["models"][0]["points"]


@pytest.mark.parametrize("environment", [{"PYTHONIOENCODING": "ascii"}, {"COLUMNS": "40"}, {"NO_COLOR": "1"}])
def test_tables_are_printed_on_any_terminal(environment, monkeypatch):
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    run = in_a_process if "PYTHONIOENCODING" in environment else a7sim
    done = run("run", "dewitt-pair", *READ_ONCE)
    assert (done.returncode, done.stderr) == (0, "")


def test_a_full_disk_is_reported_without_traceback():
    with Path("/dev/full").open("w", encoding="ascii") as full:
        done = subprocess.run(
            [sys.executable, "-m", "a7sim", "scenario", "schema"],
            cwd=ROOT,
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            check=False,
        )
    assert done.returncode == 2
    assert "Traceback" not in done.stderr


def test_pages_quote_the_output_of_a_run():
    printed = " ".join(a7sim("run", "scenarios/akwanga.toml").stdout.split())
    for page, heading in (("README.md", "## What `make run` shows"), ("docs/running.md", "## What it shows")):
        shown = (ROOT / page).read_text(encoding="utf-8").split(heading)[1].split("\n## ")[0]
        sample = [line[4:] for line in shown.splitlines() if line.startswith("    ") and "..." not in line]
        assert len(sample) > 5
        assert [line for line in sample if " ".join(line.split()) not in printed] == []


def test_debug_shows_the_traceback():
    """In a process the interpreter prints it; after the command, `--debug` raises the same error."""
    assert "Traceback" in in_a_process("--debug", "run", "nowhere").stderr
    with pytest.raises(A7SimError, match="nowhere"):
        a7sim("run", "nowhere", "--debug")


def test_a_session_that_does_not_fit_ends_with_exit_code_1_and_a_reason(tmp_path):
    done = a7sim("run", "akwanga", "--set", "photos.0.laid=upside down", "--out", tmp_path / "out")
    assert done.returncode == 1
    assert "101 lies upside down in projector 1" in done.stderr
    assert json.loads((tmp_path / "out" / "results.json").read_text(encoding="utf-8"))["status"] == "does not fit"
    assert "upside down" in (tmp_path / "out" / "book.csv").read_text(encoding="utf-8")


def test_ctrl_c_leaves_whole_files_and_exit_code_130(tmp_path):
    out = tmp_path / "out"
    settings = ["--case", "E", "--set", "plan.parallax_readings=20"]
    command = [sys.executable, "-c", PROGRAM_WITH_CTRL_C, "run", "akwanga", *settings, "--out", str(out)]
    running = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    deadline = time.monotonic() + 30.0
    journal = out / "session.jsonl"
    while not (journal.exists() and journal.stat().st_size > 20_000) and time.monotonic() < deadline:
        time.sleep(0.01)
    os.kill(running.pid, signal.SIGINT)
    _, error = running.communicate(timeout=30)
    assert running.returncode == 130
    assert "Traceback" not in error
    assert {path.name for path in out.iterdir()} == WORK_FILES
    assert json.loads((out / "results.json").read_text(encoding="utf-8"))["status"] == "interrupted"
    assert all(json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines())


def test_validate_names_every_mistake(tmp_path):
    bad = (ROOT / "scenarios" / "akwanga.toml").read_text(encoding="utf-8")
    bad = bad.replace("x = -106.0, y = -106.0", "x = 412.0, y = -106.0").replace("seed = 1985", "sed = 1985")
    (tmp_path / "bad.toml").write_text(bad, encoding="utf-8")
    done = a7sim("scenario", "validate", tmp_path / "bad.toml")
    assert done.returncode == 2
    assert "camera.fiducials[0].x: expected mm within the 230 mm format, got 412" in done.stderr
    assert "sed: expected a key that is known; did you mean seed?" in done.stderr
    document = json.loads(a7sim("scenario", "validate", tmp_path / "bad.toml", "--json").stdout)
    assert len(document["mistakes"]) == 2


def test_bundled_scenarios_are_valid():
    for name in ("scenarios/akwanga.toml", "scenarios/dewitt-pair.toml"):
        assert a7sim("scenario", "validate", name).returncode == 0


def test_schema_is_a_json_schema():
    schema = json.loads(a7sim("scenario", "schema").stdout)
    assert schema["$schema"].startswith("https://json-schema.org/")
    assert "Scenario" in schema["$defs"]


@pytest.mark.parametrize("arguments", [[], ["run"], ["scenario"], ["scenario", "validate"], ["scenario", "schema"]])
def test_help_has_an_example(arguments):
    done = a7sim(*arguments, "--help")
    assert done.returncode == 0
    if arguments != ["scenario"]:
        assert "Example: a7sim" in done.stdout
