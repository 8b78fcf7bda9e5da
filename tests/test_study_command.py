"""`a7sim study` at the command line: its output and files, resuming after a kill, and its audit."""

import json
import os
import signal
import subprocess
import sys
import time

import pytest

from a7sim.study.auditing import AuditDifference
from a7sim.study.checkpoint import KINDS, checkpoint_path, load
from a7sim.study.folder import FILES, PAGE
from a7sim.study.loading import load_study
from tests.support.processes import COMMAND, a7sim, a7sim_captured
from tests.support.server_thread import TIMEOUT_S

STUDY = """
schema_version = 1
title = "Pointings"
question = "Do more pointings help?"
scenario = "a8-strip"
replicates = 12
responses = ["strip_plan_at_checks_m", "strip_height_at_checks_m"]
settings = { work = ["comparator"] }
[[factor]]
name = "pointings"
path = "comparator.pointings"
levels = [1, 4]
"""


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """Return a study, its output folder and its process, run without interruption."""
    folder = tmp_path_factory.mktemp("study")
    path = folder / "pointings.toml"
    path.write_text(STUDY)
    done = a7sim("study", path, "--executor", "process", "--out", folder / "out", "--audit", 1)
    assert done.returncode == 0, done.stderr
    return path, folder / "out", done


def test_a_study_prints_its_question_and_an_answer_in_words(study):
    words = " ".join(study[2].stdout.split())
    assert "Do more pointings help?" in words
    assert "strip_height_at_checks_m: from" in words
    assert "pointings 4" in words
    assert "1 session run again over the link: same digits." in words


def test_a_replicate_in_the_table_equals_the_session_of_run_with_its_seed(study, capsys):
    _, out, _ = study
    line = next(each for each in (out / "replicates.csv").read_text().splitlines() if each.startswith("2,1,"))
    _, _, seed, _, height = line.split(",")
    settings = ("--set", "work=['comparator']", "--set", "comparator.pointings=4")
    ran = json.loads(a7sim_captured(capsys, "run", "a8-strip", "--seed", seed, *settings, "--json").stdout)
    checks = ran["ways"]["comparator"]["accuracy_m"]["checks"]
    assert float(height) == pytest.approx(checks["height"], rel=1e-9)


def test_a_killed_study_resumes_to_the_same_bytes_and_leaves_no_worker_process(study, tmp_path, capsys):
    path, whole, _ = study
    out = tmp_path / "out"
    command = [*COMMAND, "study", str(path), "--workers", "1", "--out", str(out)]
    killed = subprocess.Popen(command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _wait_until(checkpoint_path(out).exists)
    os.kill(killed.pid, signal.SIGKILL)
    killed.wait()
    _wait_until(lambda: _gone(killed.pid))
    loaded = load_study(path)
    assert 0 < load(checkpoint_path(out), loaded.identity).done.sum() < 24
    assert a7sim_captured(capsys, "study", path, "--executor", "process", "--out", out, "--quiet").returncode == 0
    assert _files_in(out) == _files_in(whole)


def _files_in(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def _gone(group):
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


def _wait_until(is_reached):
    deadline = time.monotonic() + TIMEOUT_S
    while not is_reached():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_the_page_contains_question_method_and_answer(study):
    page = (study[1] / PAGE).read_text()
    for words in ("Do more pointings help?", "The answer", "Scenario a8-strip", "comparator.pointings = 4", "<svg"):
        assert words in page


def test_without_matplotlib_all_files_but_the_page_are_written_and_this_is_reported(
    study, tmp_path, capsys, monkeypatch
):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    done = a7sim_captured(
        capsys, "study", study[0], "--replicates", 2, "--executor", "process", "--out", tmp_path / "out"
    )
    assert done.returncode == 0
    assert "matplotlib" in done.stderr
    expected = {*FILES, checkpoint_path(tmp_path).name} - {PAGE} - ({*KINDS} - {checkpoint_path(tmp_path).name})
    assert set(_files_in(tmp_path / "out")) == expected


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--replicates", "0"), "expected a whole number from 1"),
        (("--replicates", "5"), "expected at least the 12 replicates already done, got 5"),
    ],
)
def test_an_impossible_number_of_replicates_gives_one_sentence_and_exit_code_2(study, capsys, arguments, words):
    path, out, _ = study
    done = a7sim_captured(capsys, "study", path, "--out", out, *arguments)
    assert (done.returncode, len(done.stderr.splitlines())) == (2, 1)
    assert words in done.stderr


def test_a_folder_with_other_files_is_not_changed(study, tmp_path, capsys):
    (tmp_path / "precious").write_text("x")
    done = a7sim_captured(capsys, "study", study[0], "--out", tmp_path)
    assert done.returncode == 2
    assert "expected an empty folder" in done.stderr
    assert [each.name for each in tmp_path.iterdir()] == ["precious"]


def test_a_failed_audit_gives_one_sentence_and_exit_code_3(study, capsys, monkeypatch):
    path, out, _ = study
    differences = [AuditDifference(2, each, 99, "strip.rms", 0.25, 0.5, 7) for each in (3, 4)]
    monkeypatch.setattr("a7sim.cli.study.audit_study", lambda laid, tally, picks: differences)
    done = a7sim_captured(capsys, "study", path, "--executor", "process", "--out", out, "--audit", 5, "--quiet")
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr == (
        "a7sim: 2 of 5 sessions differ over the link; cell 2, replicate 3, seed 99: "
        "strip.rms is 0.25 on the batch bench and 0.5 over the link (7 values more differ)\n"
    )
