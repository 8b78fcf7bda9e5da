"""Journals lose no observation (issue 6): contents, detection of damage, resuming and replay."""

import errno
import json
import os
import resource
import shutil
import signal
import subprocess
import time
from itertools import pairwise
from pathlib import Path

import msgspec
import pytest

from a7sim import __version__
from a7sim.cli.replay import PlaybackClock
from a7sim.errors import A7SimError
from a7sim.instrument.language import LinkEvent
from a7sim.journal import append_file
from a7sim.journal.append_file import AppendOnlyFile, JournalWriteError
from a7sim.journal.checkpoints import read_checkpoints
from a7sim.journal.format import ChecksumChain, read_journal
from a7sim.journal.replay import Replay, replay_lines
from a7sim.journal.resuming import find_resumable
from a7sim.journal.scripts import find_script, read_script
from a7sim.journal.writer import Header, Journal, JournalOptions, make_header, make_header_without_scenario
from a7sim.link.clock import Clock
from a7sim.scenario import find_scenario, from_data, hash_scenario, load_scenario, to_data
from a7sim.scene import PICTURES
from a7sim.session import ProgressCallbacks, RunOptions, run, strip_combinations
from tests.support.processes import ANY_TCP_PORT, COMMAND, RunningServer, a7sim, a7sim_captured
from tests.support.server_thread import SocketClient

ROOT = Path(__file__).parents[1]
LIGHT = {"plan.parallax_readings": "1"}
SETTINGS = [part for key, value in LIGHT.items() for part in ("--set", f"{key}={value}")]


def files_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.fixture(scope="module")
def whole(finished):
    """Return the folder of an uninterrupted session of the operator, seed 7."""
    return finished("dewitt-pair", 7).folder


@pytest.fixture
def copied(whole, tmp_path):
    """Return a copy of the session that a test may damage."""
    return Path(shutil.copytree(whole, tmp_path / "copy"))


def resumed(folder):
    resumable = find_resumable(folder, "run")
    return run(resumable.scenario, resumable.seed, RunOptions(folder, journal_options=JournalOptions(resumes=True)))


def forged(journalled, header=None, change=lambda number, data: data):
    """Return the changed lines of a journal with checksums that fit."""
    chain = ChecksumChain()
    lines = []
    for number, line in enumerate(journalled.lines, start=1):
        data = json.loads(line)
        del data["crc"]
        data = header if number == 1 and header else change(number, data)
        lines.append(chain.line(data) + b"\n")
    return b"".join(lines)


# --- contents ----------------------------------------------------------------------------------------


def test_the_header_has_all_inputs_of_a_session_and_the_hash_of_the_scenario(whole):
    header = read_journal(whole / "session.jsonl").header
    assert header["software"] == f"a7sim {__version__}"
    assert (header["command"], header["seed"], header["variant"], header["pictures"]) == ("run", 7, "A7", PICTURES)
    assert header["scenario_hash"] == hash_scenario(load_scenario("dewitt-pair", LIGHT))
    assert "scenario" not in header
    scenario = (whole / "session.scenario.json").read_text()
    assert json.loads(scenario)["photos"][0]["measured"]["file"] == "dewitt-pair.csv"
    assert not any(str(part) in json.dumps(header) + scenario for part in (ROOT, Path.home()))


@pytest.mark.parametrize("name", sorted(path.stem for path in (ROOT / "scenarios").glob("*.toml")))
def test_a_journal_can_contain_every_scenario(name):
    carried_about = json.loads(json.dumps(to_data(load_scenario(name))))
    assert json.loads(json.dumps(to_data(from_data(carried_about)))) == carried_about
    assert find_scenario(name).is_file()


def test_a_journal_contains_the_book(whole):
    lines = [json.loads(line) for line in (whole / "session.jsonl").read_text().splitlines()[1:]]
    entries = [line for line in lines if line.get("kind") == "entry"]
    rows = (whole / "book.csv").read_text().splitlines()[1:]
    assert [f"{line['number']},{line['t']:.1f}" for line in entries] == [",".join(row.split(",")[:2]) for row in rows]


def test_the_truth_is_in_a_separate_file(whole):
    checkpoints = list(read_checkpoints(whole / "session.states.jsonl"))
    journalled = read_journal(whole / "session.jsonl")
    assert len(checkpoints) >= 2
    assert [journalled.event(each.line).hash for each in checkpoints] == [each.hash for each in checkpoints]
    laid = checkpoints[-1].state["autograph"]["carriers"]["1"][1]
    assert any(laid)
    assert not any(str(value) in (whole / "session.jsonl").read_text() for value in laid if value)


# --- damage -----------------------------------------------------------------------------------------------


def test_a_flipped_byte_is_found_and_its_line_named(whole, tmp_path):
    """Every byte of some lines in the middle, their ends too, and of the header's beginning."""
    data = (whole / "session.jsonl").read_bytes()
    lines = data.splitlines(keepends=True)
    path = tmp_path / "session.jsonl"
    starts = {number: sum(map(len, lines[: number - 1])) for number in (1, 2, len(lines) // 2, len(lines) // 2 + 1)}
    short = b"".join(lines[: len(lines) // 2 + 5])
    for number, start in starts.items():
        for offset in range(min(len(lines[number - 1]), 200)):
            flipped = bytearray(short)
            flipped[start + offset] ^= 1 << offset % 8
            path.write_bytes(flipped)
            with pytest.raises(A7SimError, match=rf"session\.jsonl, line {number}: expected"):
                read_journal(path)


def test_a_lost_and_an_exchanged_line_are_found(whole, tmp_path):
    lines = (whole / "session.jsonl").read_bytes().splitlines(keepends=True)
    for damaged in ([*lines[:40], *lines[41:]], [*lines[:40], lines[41], lines[40], *lines[42:]]):
        (tmp_path / "session.jsonl").write_bytes(b"".join(damaged))
        with pytest.raises(A7SimError, match="line 41: expected the checksum"):
            read_journal(tmp_path / "session.jsonl")


def test_a_journal_cut_at_any_of_its_last_300_bytes_is_read_to_its_last_whole_line(whole, tmp_path):
    """The journal of the first part of a session, which is read faster 300 times."""
    data = (whole / "session.jsonl").read_bytes()
    data = data[: data.index(b"\n", 20_000) + 1]
    path = tmp_path / "session.jsonl"
    for cut in range(1, 301):
        left = data[:-cut]
        path.write_bytes(left)
        journalled = read_journal(path)
        end = left.rfind(b"\n") + 1
        assert (len(journalled), journalled.size, journalled.truncated_tail) == (left.count(b"\n"), end, left[end:])


@pytest.mark.parametrize("flipped", [0x0B, ord("}")])
def test_a_flipped_last_line_end_is_not_read_as_a_torn_line(whole, tmp_path, flipped):
    data = bytearray((whole / "session.jsonl").read_bytes())
    data[-1] = flipped
    (tmp_path / "session.jsonl").write_bytes(data)
    with pytest.raises(A7SimError, match="expected a line end, got another byte"):
        read_journal(tmp_path / "session.jsonl")


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (b"", "expected the journal of a session, got no whole line"),
        (b'{"schema_version":2', "got no whole line: nothing was observed yet"),
        (
            b'{"schema_version":1,"software":"a7sim 0.1.0"}\n{}\n',
            "line 1: expected a journal of schema_version 2 or 3, got 1",
        ),
        (b"hello\n", "line 1: expected the checksum"),
        (b"\xff\xfe\n\n", "line 1: expected the checksum"),
    ],
)
def test_a_file_that_is_no_journal_gets_an_error_message_of_one_sentence(tmp_path, content, sentence, capsys):
    (tmp_path / "session.jsonl").write_bytes(content)
    for arguments in (("run", "--resume", tmp_path), ("replay", tmp_path)):
        done = a7sim_captured(capsys, *arguments)
        assert (done.returncode, done.stdout) == (2, "")
        assert sentence in done.stderr
        assert done.stderr.count("\n") == 1


# --- resuming ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.0, 0.37, 0.9, 1.0])
def test_a_resumed_run_writes_the_files_of_an_uninterrupted_run(whole, tmp_path, share):
    data = (whole / "session.jsonl").read_bytes()
    header = data.index(b"\n") + 1
    cut = data[: header + int(share * (len(data) - header))]
    (tmp_path / "session.jsonl").write_bytes(cut)
    shutil.copy(whole / "session.scenario.json", tmp_path)
    resumed(tmp_path)
    torn = cut[cut.rfind(b"\n") + 1 :]
    expected = files_of(whole) | ({"session.jsonl.torn": torn} if torn else {})
    assert files_of(tmp_path) == expected


def test_a_killed_run_resumes_to_the_same_bytes(whole, tmp_path, capsys):
    """SIGKILL after a third and after two thirds of the length of the journal; benchmarks/killed.py has more."""
    size = (whole / "session.jsonl").stat().st_size
    journal = tmp_path / "out" / "session.jsonl"
    command = ["run", "dewitt-pair", "--seed", "7", *SETTINGS, "--quiet", "--out", str(tmp_path / "out")]
    for share in (1 / 3, 2 / 3):
        running = subprocess.Popen([*COMMAND, *command])
        while not (journal.exists() and journal.stat().st_size > share * size) and running.poll() is None:
            time.sleep(0.001)
        running.kill()
        assert running.wait() == -signal.SIGKILL
        command = ["run", "--resume", str(tmp_path / "out"), "--quiet"]
    assert a7sim_captured(capsys, *command).returncode == 0
    left = files_of(tmp_path / "out")
    left.pop("session.jsonl.torn", None)
    assert {name: left[name] for name in files_of(whole)} == files_of(whole)


def test_a_journal_of_another_seed_is_refused_at_its_line(copied):
    journalled = read_journal(copied / "session.jsonl")
    header = make_header("run", load_scenario("dewitt-pair", LIGHT), 8).line
    (copied / "session.jsonl").write_bytes(forged(journalled, header))
    first = next(n for n in range(2, len(journalled)) if "FID?" in journalled.event(n).text) + 1
    with pytest.raises(A7SimError, match=rf"session\.jsonl, line {first}: expected this session's event"):
        resumed(copied)


@pytest.mark.parametrize(
    ("key", "value", "sentence"),
    [
        ("software", "a7sim 0.0.1", "line 1: expected a session of a7sim .*, got one of a7sim 0.0.1"),
        ("command", "serve", "line 1: expected a session of run to resume, got one of serve"),
        ("scenario_hash", "0" * 64, "line 1: expected the scenario and the measurements that the session began with"),
        ("schema_version", 2, "line 1: expected schema_version 3 to resume, got 2, which can be replayed only"),
    ],
)
def test_a_journal_of_something_else_is_refused_at_line_1(copied, key, value, sentence):
    journalled = read_journal(copied / "session.jsonl")
    (copied / "session.jsonl").write_bytes(forged(journalled, journalled.header | {key: value, "crc": ""}))
    with pytest.raises(A7SimError, match=sentence):
        resumed(copied)


@pytest.mark.parametrize(
    ("content", "sentence"),
    [
        (None, "expected the scenario of the session: No such file"),
        ("{", "expected the scenario of the session as JSON, got something else"),
        ('{"photos": []}', "expected a scenario of this version of a7sim"),
    ],
)
def test_the_error_message_names_an_invalid_scenario_and_another_may_be_given(copied, content, sentence, capsys):
    file = copied / "session.scenario.json"
    file.unlink() if content is None else file.write_text(content)
    done = a7sim_captured(capsys, "replay", copied, "--quiet")
    assert done.returncode == 2
    assert f"{file}: {sentence}" in done.stderr
    named = ["replay", copied, "--verify", "--quiet", "--scenario"]
    assert "expected the scenario and the measurements that" in a7sim_captured(capsys, *named, "akwanga").stderr


def test_a_journal_without_its_scenario_replays_with_a_given_scenario(tmp_path, capsys):
    assert a7sim_captured(capsys, "replay", "interior", "--out", tmp_path / "out", "--quiet").returncode == 0
    script = read_script(find_script("interior"))
    (tmp_path / "out" / "session.scenario.json").unlink()
    name = next(
        path.stem for path in (ROOT / "scenarios").glob("*.toml") if load_scenario(path.stem) == script.scenario
    )
    done = a7sim_captured(capsys, "replay", tmp_path / "out", "--verify", "--quiet", "--scenario", name)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_error_message_names_a_surplus_line(copied):
    with (copied / "session.jsonl").open("ab") as journal:
        chain = ChecksumChain(read_journal(copied / "session.jsonl").crc)
        journal.write(chain.line({"t": 99999.0, "client": "client1", "dir": ">", "text": "*IDN?"}) + b"\n")
    lines = len(read_journal(copied / "session.jsonl"))
    with pytest.raises(
        A7SimError, match=rf"line {lines}: expected the end of the session, got a line that is left over"
    ):
        resumed(copied)


def test_a_session_that_is_being_written_is_not_resumed(copied):
    journalled = read_journal(copied / "session.jsonl")
    file = AppendOnlyFile(journalled.path, size=journalled.size)
    try:
        with pytest.raises(A7SimError, match="expected a session that is over, got one that is being written"):
            resumed(copied)
    finally:
        file.close()


@pytest.mark.slow
def test_strips_of_all_cases_resume_where_they_were_interrupted(tmp_path, monkeypatch):
    """Interrupted in the second of two sessions, here of one model each."""
    monkeypatch.setattr(strip_combinations, "CASES", {case: strip_combinations.CASES[case] for case in "AB"})
    light = load_scenario("akwanga", LIGHT)
    light = msgspec.structs.replace(light, models=light.models[:1])
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    strip_combinations.run_combinations(light, 1985, RunOptions(whole))
    answers = iter(["no", "yes"])

    def interrupt(activity):
        if "model coordinates" in activity and next(answers) == "yes":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        strip_combinations.run_combinations(
            light, 1985, RunOptions(cut, callbacks=ProgressCallbacks(on_activity=interrupt))
        )
    assert not (cut / "results.json").exists()
    session = find_resumable(cut, "run")
    assert session.setting("strips") == "all"
    strip_combinations.run_combinations(
        session.scenario, session.seed, RunOptions(cut, journal_options=JournalOptions(resumes=True))
    )
    assert {name: files_of(cut / name) for name in ("case-A", "case-B")} == {
        name: files_of(whole / name) for name in ("case-A", "case-B")
    }
    assert (cut / "results.json").read_bytes() == (whole / "results.json").read_bytes()


def test_resume_accepts_no_other_option(whole, capsys):
    for extra in (["akwanga"], ["--seed", "7"], ["--out", "x"]):
        done = a7sim_captured(capsys, "run", "--resume", whole, *extra)
        assert done.returncode == 2
        assert "because the journal contains the options" in done.stderr


# --- served -----------------------------------------------------------------------------------------------


def journalled_events(out):
    journalled = read_journal(out / "session.jsonl")
    return [journalled.event(number) for number in range(2, len(journalled) + 1)]


def test_a_killed_server_resumes_with_all_registrations_of_two_clients(tmp_path, capsys):
    out = tmp_path / "out"
    with RunningServer(*ANY_TCP_PORT, "--out", str(out)) as first:
        one, other = first.line(), first.line()
        assert one.ask("SYST:LOCK:REQ?;:PROJ1:BY 1;*OPC?") == "1;1"
        assert one.ask('DRIV:X 100;*WAI;:DRIV:X 20;:REC "a",BY1;:REC:LAST?') == '1,"a",20.00,0.00,-300.00,BY1,1.00'
        other.send(b'PROJ2:BY 1\nREC "b"\n' + b"x" * 5000 + b"\n")
        assert other.ask("REC:COUN?;:SYST:ERR:COUN?") == "2;2"
    with RunningServer.resuming(out) as again:
        line = again.line()
        assert line.ask("REC:COUN?;:PROJ1:BY?;:COUN:X?;:SYST:LOCK:REQ?") == "2;1.00;20.00;1"
        line.send(b'REC "c"\n')
        assert line.ask("REC:LAST?").startswith('3,"c",20.00')
        assert again.stop(signal.SIGTERM)[0] == 0
    events = journalled_events(out)
    assert [(event.dir, event.client) for event in events if event.dir in ("+", "-")] == [
        *[("+", "client1"), ("+", "client2"), ("-", "client1"), ("-", "client2"), ("+", "client3"), ("-", "client3")]
    ]
    assert [before.t <= after.t for before, after in pairwise(events)] == [True] * (len(events) - 1)
    assert a7sim_captured(capsys, "replay", out, "--verify", "--quiet").returncode == 0


def test_a_server_with_a_token_resumes_with_a_token(tmp_path, capsys):
    out = tmp_path / "out"
    with RunningServer(*ANY_TCP_PORT, "--out", str(out), A7SIM_TOKEN="sesame") as first:
        line = first.line()
        assert line.ask('COUN?;:SYST:LOG "sesame";:DRIV:X 5;:COUN:X?') == "5.00"
    assert "sesame" not in (out / "session.jsonl").read_text()
    done = a7sim_captured(capsys, "serve", "--resume", out, *ANY_TCP_PORT)
    assert (done.returncode, done.stdout) == (2, "")
    assert "line 1: expected a token, as the session was begun with, got none" in done.stderr
    with RunningServer.resuming(out, A7SIM_TOKEN="open") as again:
        assert again.line().ask('SYST:LOG "open";:COUN:X?') == "5.00"
        again.stop(signal.SIGTERM)
    assert a7sim_captured(capsys, "replay", out, "--verify", "--quiet").returncode == 0


# --- write errors -------------------------------------------------------------------------------


def with_files_of_at_most(size):
    """Make writing beyond `size` bytes of a file fail, as on a full disk."""

    def limit():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

    return limit


def test_a_run_on_a_full_disk_stops_with_a_message_and_resumes_when_there_is_space(whole, tmp_path):
    out = tmp_path / "out"
    command = ("run", "dewitt-pair", "--seed", "7", *SETTINGS, "--out", out)
    done = a7sim(*command, preexec_fn=with_files_of_at_most(100_001))
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        f"a7sim: {out}/session.jsonl: it can no longer be written, so the session stops here: File too large\n"
    )
    journalled = read_journal(out / "session.jsonl")
    assert (journalled.size > 99_000, journalled.truncated_tail) == (True, b"")
    resumed(out)
    assert files_of(out) == files_of(whole)


def test_a_server_on_a_full_disk_reports_it_and_acknowledges_only_written_lines(tmp_path):
    out = tmp_path / "out"
    with RunningServer(*ANY_TCP_PORT, "--out", str(out), preexec_fn=with_files_of_at_most(20_000)) as running:
        one, other = running.line(), running.line()
        acknowledged = 0
        while one.ask(f'REC "{acknowledged + 1}";:REC:COUN?') == str(acknowledged + 1):
            acknowledged += 1
        assert other.wait_closed()
        _, errors = running.process.communicate(timeout=30)
        assert running.process.returncode == 2
        assert errors.endswith("so the session stops here: File too large\n")
        assert errors.count("\n") == 1
    with RunningServer.resuming(out) as again:
        assert again.line().ask("REC:COUN?") in (str(acknowledged), str(acknowledged + 1))
    assert acknowledged > 50


def test_a_half_written_line_is_removed(tmp_path, monkeypatch):
    file = AppendOnlyFile(tmp_path / "f", "none")
    file.add(b"one\n")
    writes = iter([2, OSError(errno.ENOSPC, "No space left on device")])

    def failing(handle, data):
        outcome = next(writes)
        if isinstance(outcome, OSError):
            raise outcome
        return real(handle, data[:outcome])

    real = os.write
    monkeypatch.setattr(append_file.os, "write", failing)
    with pytest.raises(
        JournalWriteError, match="f: it can no longer be written, so the session stops here: No space left"
    ):
        file.add(b"two\n")
    monkeypatch.setattr(append_file.os, "write", real)
    with pytest.raises(JournalWriteError, match="No space left"):
        file.add(b"three\n")
    with pytest.raises(JournalWriteError):
        file.close()
    assert (tmp_path / "f").read_bytes() == b"one\n"


@pytest.mark.parametrize("command", ["run", "serve"])
def test_a_folder_that_cannot_be_written_is_reported_before_the_start(tmp_path, command, capsys):
    (tmp_path / "file").write_text("")
    done = a7sim_captured(
        capsys, command, "akwanga", "--out", tmp_path / "file" / "out", *(ANY_TCP_PORT if command == "serve" else ())
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert "expected a folder that can be written" in done.stderr
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize("call", ["open", "ftruncate"])
def test_a_journal_on_a_read_only_disk_is_reported_in_one_sentence(tmp_path, monkeypatch, call):
    def refused(*_):
        raise OSError(errno.EROFS, "Read-only file system")

    monkeypatch.setattr(append_file.os, call, refused)
    with pytest.raises(
        A7SimError, match=r"session\.jsonl: expected a journal that can be written: Read-only file system"
    ):
        run(load_scenario("dewitt-pair", LIGHT), 7, RunOptions(tmp_path / "out"))


# --- on the disk ------------------------------------------------------------------------------------------


def synced(tmp_path, monkeypatch, durability, lines, waits=False):
    """Return how often the file was brought to the disk by lines that register (True) or not, before it was closed."""
    times = []
    monkeypatch.setattr(append_file, "_flush", lambda handle: times.append(time.monotonic()))
    file = AppendOnlyFile(tmp_path / "f", durability)
    began = time.monotonic()
    for registers in lines:
        file.add(b"line\n", registers)
    count = len(times)
    if waits:
        while not times and time.monotonic() < began + 5.0:
            time.sleep(0.005)
    file.close()
    return count, times[0] - began if times else None


def test_registrations_are_on_the_disk_at_once_and_other_lines_within_a_fifth_of_a_second(tmp_path, monkeypatch):
    assert synced(tmp_path, monkeypatch, "records", [False, True, False, True])[0] == 2
    count, first = synced(tmp_path, monkeypatch, "records", [False], waits=True)
    assert count == 0
    assert first < append_file.SYNCED_WITHIN_S


def test_durability_always_syncs_every_line_and_none_syncs_no_line(tmp_path, monkeypatch):
    assert synced(tmp_path, monkeypatch, "always", [False, True, False])[0] == 3
    assert synced(tmp_path, monkeypatch, "none", [False, True, False]) == (0, None)


@pytest.mark.parametrize(
    ("line", "registers"),
    [('REC "a"', True), ('record "a",BY1', True), (':REC:STR 1,"x"', True), ("REC:COUN?", False), ("COUN?", False)],
)
def test_a_line_that_registers_is_recognised_by_its_text(tmp_path, monkeypatch, line, registers):
    at_once = []
    monkeypatch.setattr(AppendOnlyFile, "add", lambda self, line, now=False: at_once.append(now))
    journal = Journal().recording(tmp_path, Header({"schema_version": 3}), None)
    journal.on_link_event(LinkEvent(0.0, "client1", ">", line))
    assert at_once == [False, registers]


# --- replay -----------------------------------------------------------------------------------------------


def test_a_replay_from_a_checkpoint_ends_where_one_from_the_beginning_ends(whole):
    journalled = read_journal(whole / "session.jsonl")
    states = []
    for line in (2, len(journalled) - 20):
        replay = Replay(journalled)
        first = replay.seek(line)
        assert all(difference is None for _, _, difference in replay_lines(replay, first))
        assert replay.final_difference() is None
        states.append(replay.instrument.state())
        assert (first > len(journalled) // 2) == (line > 2)
    assert states[0]["clients"] == states[1]["clients"]
    registered = [state["autograph"].pop("registered") for state in states]
    assert states[0]["autograph"] == states[1]["autograph"]
    assert registered[0] == registered[1] != []


def test_a_changed_reply_stops_the_replay_with_both_lines_and_the_state(copied, capsys):
    journalled = read_journal(copied / "session.jsonl")
    number = next(n for n in range(3000, len(journalled)) if "COUN" in journalled.event(n).text) + 1

    def change(n, data):
        return data | {"text": "1" + data["text"]} if n == number else data

    (copied / "session.jsonl").write_bytes(forged(journalled, change=change))
    done = a7sim_captured(capsys, "replay", copied, "--verify", "--quiet")
    original = journalled.event(number).text
    assert done.returncode == 3
    assert done.stderr.splitlines() == [
        f"a7sim: {copied}/session.jsonl, line {number}: the first difference",
        f"a7sim: the journal has      client1 < 1{original}",
        f"a7sim: the instrument says  client1 < {original}",
    ]


def test_a_replay_without_verification_continues_after_a_difference_and_counts_it(copied, capsys):
    journalled = read_journal(copied / "session.jsonl")
    number = next(n for n in range(3000, len(journalled)) if "COUN" in journalled.event(n).text) + 1

    def change(n, data):
        return data | {"text": "1" + data["text"]} if n == number else data

    (copied / "session.jsonl").write_bytes(forged(journalled, change=change))
    done = a7sim_captured(capsys, "replay", copied)
    printed = done.stdout.splitlines()
    assert not done.returncode
    assert [line.split(None, 1)[1] for line in printed if line.startswith("   differs ")] == [
        f"client1 < {journalled.event(number).text}"
    ]
    assert len(printed) == len(journalled) + 1
    assert printed[-1].endswith(": 1 different")
    assert f"line {number}: the first difference" in done.stderr.splitlines()[0]


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("interior", "--from", "@3"), "--from: expected a journal to seek in, got a script"),
        (("interior", "--scenario", "akwanga"), "--scenario: expected a journal, got a script, which names its own"),
        ((".", "--out", "out"), "--out: expected a script, got a session, which already has a journal"),
    ],
)
def test_an_invalid_option_of_a_replay_is_refused_in_one_sentence(typed, words, sentence):
    assert typed("replay", *words) == (2, "", f"a7sim: {sentence}\n")


def test_a_script_with_other_replies_ends_with_exit_code_3_and_both_replies(typed, tmp_path):
    script = tmp_path / "mine.a7s"
    script.write_text("scenario akwanga seed 4\nDRIV:X 1.20\nexpect COUN:X? = 9.5\n", encoding="utf-8")
    code, printed, complained = typed("replay", script, "--json")
    document = json.loads(printed)
    difference = document["difference"]
    assert (code, document["status"], complained.count("\n")) == (3, "differs", 1)
    assert (difference["line"], difference["file"]) == (3, str(script))
    assert "9.5" in difference["expected"] and "1.20" in difference["got"]


def test_a_changed_command_shows_the_differences_of_the_state(copied, capsys):
    journalled = read_journal(copied / "session.jsonl")
    number = next(n for n in range(2, len(journalled)) if journalled.event(n).text.startswith("PROJ1:PDIS "))

    def change(n, data):
        return data | {"text": "PROJ1:PDIS 151.5"} if n == number else data

    (copied / "session.jsonl").write_bytes(forged(journalled, change=change))
    done = a7sim_captured(capsys, "replay", copied, "--verify", "--json")
    document = json.loads(done.stdout)
    assert (done.returncode, document["status"]) == (3, "differs")
    assert number < document["difference"]["line"] < number + 200
    assert any(line.startswith("a7sim: state, autograph.spindles.c1: [") for line in done.stderr.splitlines())


def test_surplus_lines_fail(copied, capsys):
    """The journal lacks its last reply, or has a reply without a query."""
    journalled = read_journal(copied / "session.jsonl")
    last = max(n for n in range(2, len(journalled)) if journalled.event(n).dir == "<")
    chain = ChecksumChain(int(json.loads(journalled.lines[last - 1])["crc"], 16))
    unasked = chain.line({"t": 99999.0, "client": "client1", "dir": "<", "text": "5"})
    reply = f"client1 < {journalled.event(last).text}"
    for lines, number, of_journal, of_instrument in (
        (journalled.lines[: last - 1], last, "nothing", reply),
        ([*journalled.lines[:last], unasked], last + 1, "client1 < 5", "nothing"),
    ):
        (copied / "session.jsonl").write_bytes(b"\n".join(lines) + b"\n")
        done = a7sim_captured(capsys, "replay", copied, "--verify", "--quiet")
        assert done.returncode == 3
        assert done.stderr.splitlines()[:3] == [
            f"a7sim: {copied}/session.jsonl, line {number}: the first difference",
            f"a7sim: the journal has      {of_journal}",
            f"a7sim: the instrument says  {of_instrument}",
        ]


@pytest.mark.parametrize(
    ("begin", "first"),
    [("@100", lambda n, e: n == 100), ("0:30:00", lambda n, e: e.t >= 1800.0), ("2000.5", lambda n, e: e.t >= 2000.5)],
)
def test_a_replay_prints_from_a_line_or_a_time(whole, begin, first, capsys):
    journalled = read_journal(whole / "session.jsonl")
    number = next(n for n in range(2, len(journalled)) if first(n, journalled.event(n)))
    done = a7sim_captured(capsys, "replay", whole, "--from", begin, "--verify")
    assert done.returncode == 0
    assert len(done.stdout.splitlines()) == len(journalled) - number + 2
    assert done.stdout.split()[0] == f"{journalled.event(number).t:.2f}"


def test_a_replay_prints_from_a_note(whole, capsys):
    done = a7sim_captured(capsys, "replay", whole, "--from", "left perspective centre")
    assert done.stdout.splitlines()[0].endswith('client1   > NOTE "1: left perspective centre"')
    assert done.returncode == 0
    done = a7sim_captured(capsys, "replay", whole, "--from", "coffee")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "--from coffee: expected a time, @LINE or the text of a note" in done.stderr


def test_a_replay_runs_at_the_requested_speed(monkeypatch):
    slept = []
    clock = Clock()
    monkeypatch.setattr(time, "monotonic", lambda: clock.now)
    monkeypatch.setattr(time, "sleep", lambda s: (slept.append(round(s, 6)), clock.advance(s)))
    pace = PlaybackClock(10.0)
    for now in (100.0, 100.0, 105.0, 106.0):
        pace.until(now)
    assert slept == [0.0, 0.0, 0.5, 0.1]


@pytest.mark.parametrize("path", sorted((ROOT / "tests" / "journals").glob("*.jsonl")), ids=lambda path: path.stem)
def test_a_journal_of_every_version_replays_for_ever(path, capsys):
    assert path.stat().st_size < 150_000
    done = a7sim_captured(capsys, "replay", path, "--verify", "--quiet")
    assert (done.returncode, done.stderr) == (0, "")


# --- record -----------------------------------------------------------------------------------------------


def test_lines_of_a_client_and_an_instrument_are_recorded_and_replay(tmp_path, capsys):
    out = tmp_path / "recorded"
    with RunningServer(*ANY_TCP_PORT) as served:
        command = ["record", served.listening[0]["url"], "--scenario", "akwanga", "--out", str(out), "--json"]
        recorder = subprocess.Popen([*COMMAND, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        text = ""
        while not text.endswith("\n}\n"):
            text += recorder.stdout.readline()
        scheme, _, port = json.loads(text)["url"].split(":")
        assert scheme == "tcp"
        port = int(port)
        with SocketClient(port) as line:
            assert line.ask("DRIV:X 30;*OPC?;:COUN:X?") == "1;30.00"
            line.send(b"EYEP1:PICT? 4,4,1\n" + b"x" * 5000 + b"\n")
            assert line.read().startswith("#216")
            assert line.ask("SYST:ERR?").endswith('-363,"Input buffer overrun;expected at most 4096 bytes a line"')
        with SocketClient(port) as line:
            assert line.ask("COUN:X?") == "30.00"
        recorder.send_signal(signal.SIGTERM)
        _, errors = recorder.communicate(timeout=30)
        assert (recorder.returncode, errors) == (0, "")
    events = journalled_events(out)
    assert [event.dir for event in events if event.dir != "<"] == [*"+>>!>-", *"+>-"]
    assert [event.text[:10] for event in events if event.dir == "<"] == ["1;30.00", "#block of ", '-363,"Inpu', "30.00"]
    assert a7sim_captured(capsys, "replay", out, "--verify", "--quiet").returncode == 0


def test_a_record_of_an_unknown_instrument_is_printed_and_not_verified(tmp_path, capsys):
    with Journal().recording(tmp_path, make_header_without_scenario("record", instrument="a7"), None) as journal:
        journal.on_link_event(LinkEvent(1.0, "client1", ">", "*IDN?"))
    done = a7sim_captured(capsys, "replay", tmp_path)
    assert done.stdout.splitlines()[0] == "      1.00 client1   > *IDN?"
    done = a7sim_captured(capsys, "replay", tmp_path, "--verify")
    assert done.returncode == 2
    assert "expected a session whose scenario is known" in done.stderr


def test_a_client_may_leave_without_a_writable_journal_and_any_other_event_needs_one(tmp_path, monkeypatch):
    """A full disk does not stop a client from leaving; all else is acknowledged only if written."""
    with Journal().recording(tmp_path, make_header_without_scenario("record", instrument="a7"), None) as journal:

        def full(*_, **__):
            raise JournalWriteError("the disk is full")

        monkeypatch.setattr(journal, "_write", full)
        journal.on_link_event(LinkEvent(1.0, "client1", "-", ""))
        with pytest.raises(JournalWriteError, match="the disk is full"):
            journal.on_link_event(LinkEvent(2.0, "client1", ">", "*IDN?"))


def test_a_quiet_replay_without_verification_prints_nothing(tmp_path, capsys):
    with Journal().recording(tmp_path, make_header_without_scenario("record", instrument="a7"), None) as journal:
        journal.on_link_event(LinkEvent(1.0, "client1", ">", "*IDN?"))
    quiet = a7sim_captured(capsys, "replay", tmp_path, "--quiet")
    assert (quiet.returncode, quiet.stdout) == (0, "")
