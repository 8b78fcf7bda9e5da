"""Each command with an operator resumes an interrupted session and writes the same bytes as without interruption."""

import json
import shutil
from pathlib import Path

import msgspec
import pytest

from a7sim.journal.resuming import find_resumable
from a7sim.journal.writer import JournalOptions
from a7sim.scenario import load_scenario
from a7sim.session import RunOptions
from a7sim.session.bridge import INDEPENDENT, run_bridge
from tests.support.processes import a7sim_captured

JOURNAL = "session.jsonl"
HURRIED = {"plan.parallax_readings": "1"}
UPSIDE_DOWN = ("--set", "photos.1.laid=upside down")


def files_of(folder):
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def cut_off(whole, folder, share):
    """Write the files of a session that was killed after a share of its journal."""
    folder.mkdir()
    data = (whole / JOURNAL).read_bytes()
    header = data.index(b"\n") + 1
    (folder / JOURNAL).write_bytes(data[: header + int(share * (len(data) - header))])
    shutil.copy(whole / "session.scenario.json", folder)


def without_torn_files(files):
    return {name: data for name, data in files.items() if not name.endswith(".torn")}


@pytest.mark.parametrize(
    ("words", "ends_with"),
    [
        (("calibrate", "akwanga", "--points", 9, "--levels", 1, "--pointings", 1), 0),
        (("compile", "akwanga", "--contour", 455, "--line", "road1", "--tremor", 3, *UPSIDE_DOWN), 1),
        (("bridge", "bridge", "--seed", 3, *UPSIDE_DOWN), 1),
    ],
    ids=["calibrate", "compile", "bridge"],
)
def test_an_interrupted_command_resumes_to_the_same_bytes_and_exit_code(tmp_path, capsys, words, ends_with):
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    before = a7sim_captured(capsys, *words, "--out", whole)
    cut_off(whole, cut, 0.6)
    after = a7sim_captured(capsys, words[0], "--resume", cut)
    assert (before.returncode, after.returncode) == (ends_with, ends_with)
    assert (after.stdout, after.stderr) == (before.stdout, before.stderr)
    assert without_torn_files(files_of(cut)) == files_of(whole)


@pytest.mark.parametrize("command", ["run", "bridge", "compile", "calibrate"])
@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ((), "{command}: expected SCENARIO or --resume DIR, got none"),
        (("--resume", "{folder}", "--seed", 7), "--resume: expected no --seed with it, because the journal contains"),
        (("--resume", "{folder}"), "{folder}/session.jsonl: expected the journal of a session: No such file"),
    ],
)
def test_the_error_message_for_missing_excess_or_wrong_arguments_is_one_sentence(
    tmp_path, capsys, command, words, sentence
):
    named = {"command": command, "folder": tmp_path}
    done = a7sim_captured(capsys, command, *(str(word).format(**named) for word in words))
    assert (done.returncode, done.stdout, done.stderr.count("\n")) == (2, "", 1)
    assert sentence.format(**named) in done.stderr


@pytest.fixture(scope="module")
def bridged(tmp_path_factory):
    """Return the folder of two models that were bridged and then measured as independent models."""
    scenario = load_scenario("bridge", HURRIED)
    scenario = msgspec.structs.replace(scenario, models=scenario.models[:2])
    out = tmp_path_factory.mktemp("bridged") / "whole"
    run_bridge(scenario, 3, RunOptions(out))
    return out


@pytest.mark.slow
def test_a_bridge_interrupted_in_the_independent_models_resumes_there(bridged, tmp_path):
    cut = Path(shutil.copytree(bridged, tmp_path / "cut"))
    (cut / "results.json").unlink()
    shutil.rmtree(cut / INDEPENDENT)
    cut_off(bridged / INDEPENDENT, cut / INDEPENDENT, 0.3)
    resumable = find_resumable(cut, "bridge")
    document = run_bridge(
        resumable.scenario, resumable.seed, RunOptions(cut, journal_options=JournalOptions(resumes=True))
    )
    assert json.loads((cut / "results.json").read_text(encoding="utf-8")) == json.loads(json.dumps(document))
    assert without_torn_files(files_of(cut)) == files_of(bridged)


@pytest.mark.slow
def test_results_of_a_bridge_interrupted_in_the_independent_models_state_the_interruption(
    bridged, tmp_path, monkeypatch
):
    def interrupted(*_, **__):
        raise KeyboardInterrupt

    cut = Path(shutil.copytree(bridged, tmp_path / "cut"))
    resumable = find_resumable(cut, "bridge")
    monkeypatch.setattr("a7sim.session.bridge.run", interrupted)
    with pytest.raises(KeyboardInterrupt):
        run_bridge(resumable.scenario, resumable.seed, RunOptions(cut, journal_options=JournalOptions(resumes=True)))
    results = msgspec.json.decode((cut / "results.json").read_bytes())
    assert results["status"] == "interrupted"
    assert results["bridged"]["strip"]


@pytest.mark.slow
def test_the_independent_models_of_another_strip_are_not_resumed(bridged, tmp_path):
    """Interrupt while bridging in a folder taken with --force that had other independent models."""
    cut = tmp_path / "cut"
    (cut / INDEPENDENT).mkdir(parents=True)
    shutil.copy(bridged / JOURNAL, cut / INDEPENDENT)
    JournalOptions().prepare(cut, force=True, parts=(INDEPENDENT,))
    assert files_of(cut) == {}
    assert JournalOptions(resumes=True).for_part(cut / INDEPENDENT) == JournalOptions(resumes=False)


@pytest.mark.parametrize(("left", "resumes"), [(None, False), (b"", False), (b'{"schema', False), (b'{}\n{"t"', True)])
def test_a_part_is_resumed_if_the_header_of_its_journal_is_complete(tmp_path, left, resumes):
    """Without a complete header the part has no observation and starts again."""
    if left is not None:
        (tmp_path / JOURNAL).write_bytes(left)
    assert JournalOptions(resumes=True).for_part(tmp_path) == JournalOptions(resumes=resumes)
