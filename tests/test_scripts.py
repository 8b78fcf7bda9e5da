"""Operator scripts (issue 6): a script runs a session; a result other than expected is reported with its line."""

from pathlib import Path

import pytest

from a7sim.errors import A7SimError
from a7sim.journal.script_runner import ScriptRunner
from a7sim.journal.scripts import Expect, SourceLocation, find_script, read_script
from tests.support.processes import a7sim_in_process

SCRIPTS = Path(__file__).parents[1] / "scenarios" / "scripts"
FIRST = "scenario akwanga seed 7\n"


def replay(*arguments):
    done = a7sim_in_process("replay", *arguments)
    assert "Traceback" not in done.stderr
    return done


def played(tmp_path, text):
    (tmp_path / "s.a7s").write_text(FIRST + text)
    heard = []
    runner = ScriptRunner(read_script(tmp_path / "s.a7s"), heard.append)
    return runner.run(), [event.text for event in heard if event.direction == ">"], runner


@pytest.mark.parametrize("name", ["interior", "clearing", "centres"])
def test_the_scripts_of_the_thesis_get_all_expected_results(name):
    script = read_script(find_script(name))
    assert sum(isinstance(each, Expect) for each in script.statements) >= 11
    runner = ScriptRunner(script)
    assert runner.run() is None
    assert (
        len(runner.instrument.autograph.recorder.registrations) == {"interior": 0, "clearing": 12, "centres": 24}[name]
    )


def test_every_script_has_a_test():
    assert {path.stem for path in SCRIPTS.glob("*.a7s")} == {"interior", "clearing", "centres"}


def test_lines_waits_expectations_and_comments_are_read(tmp_path):
    text = """DRIV:X 10 # to the right
        NOTE "a # in quotes, and 'more'" # not here
        wait 12.5
        expect COUN:X? = 10
        expect COUN? = 10.5, 0, -300 +- 0.5   # half a mm
        expect PHOT:CAT? = "101", 102, *, "grid"
        """
    failed, sent, player = played(tmp_path, text)
    assert failed is None
    assert sent == ["DRIV:X 10", "NOTE \"a # in quotes, and 'more'\"", "COUN:X?", "COUN?", "PHOT:CAT?"]
    assert player.instrument.client_count == 1


@pytest.mark.parametrize(
    ("text", "line", "expected", "got"),
    [
        ("DRIV:X 10\nexpect COUN:X? = 10.02 +- 0.01", 3, "COUN:X? = 10.02 +- 0.01", "10.00"),
        ("expect COUN? = 0, 0", 2, "COUN? = 0, 0", "0.00, 0.00, -300.00"),
        ('expect PHOT1? = "101"', 2, 'PHOT1? = "101"', '""'),
        ("expect FOO? = 1", 2, "FOO? = 1", 'no answer (-113,"Undefined header;FOO?")'),
        ("COUN:X?\nDRIV:X 9999\nDRIV:X 1", 3, "DRIV:X 9999 to be obeyed", '-222,"Data out of range;DRIV:X 9999: X'),
    ],
)
def test_an_unexpected_result_is_reported_with_its_line(tmp_path, text, line, expected, got):
    failed, _, _ = played(tmp_path, text)
    assert (failed.place, failed.expected) == (SourceLocation(tmp_path / "s.a7s", line), expected)
    assert failed.got.startswith(got)


def test_an_expected_error_is_no_failure(tmp_path):
    failed, sent, _ = played(tmp_path, "DRIV:X 9999\nexpect SYST:ERR? = -222, *\nDRIV:X 1")
    assert failed is None
    assert sent[-1] == "DRIV:X 1"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "s.a7s, line 1: expected a first line such as 'scenario akwanga seed 7', got none"),
        ("DRIV:X 1", "s.a7s, line 1: expected a first line such as 'scenario akwanga seed 7', got 'DRIV:X 1'"),
        ("scenario nowhere", "s.a7s, line 1: nowhere: expected a scenario file or one of"),
        ("scenario akwanga seed x", "s.a7s, line 1: expected 'scenario NAME' or"),
        (FIRST + "wait long", "s.a7s, line 2: expected 'wait' and 0 to 1000000 s, got 'long'"),
        (FIRST + "expect COUN? 3", "s.a7s, line 2: expected 'expect QUERY? = VALUE"),
        (FIRST + "expect COUN? = 3 +- x", "s.a7s, line 2: expected a tolerance of 0 or more behind"),
        (FIRST + "expect COUN? = 3,,4", "s.a7s, line 2: expected values with commas between them, got '3,,4'"),
        (FIRST + "include no.a7s", "s.a7s, line 2: expected a script beside this one to include, got no.a7s"),
        (FIRST + "include s.a7s", "s.a7s, line 2: expected a script that does not include itself, got s.a7s"),
        (FIRST + "include other.a7s", "other.a7s, line 1: expected the scenario and seed of"),
    ],
)
def test_the_error_message_for_a_bad_script_names_file_and_line(tmp_path, text, sentence):
    (tmp_path / "other.a7s").write_text("scenario akwanga seed 8\n")
    (tmp_path / "s.a7s").write_text(text)
    with pytest.raises(A7SimError) as raised:
        read_script(tmp_path / "s.a7s")
    assert sentence in str(raised.value)


def test_the_command_line_prints_checks_and_stores_a_script(tmp_path):
    (tmp_path / "s.a7s").write_text(FIRST + "DRIV:X 10;*OPC?\nexpect COUN:X? = 10")
    done = replay(tmp_path / "s.a7s", "--out", tmp_path / "out")
    assert (done.returncode, done.stderr) == (0, "")
    assert [line.split()[2] for line in done.stdout.splitlines()[:-1]] == ["+", ">", "~", "<", ">", "<", "-"]
    assert done.stdout.endswith("2 statements: all as expected\n")
    assert replay(tmp_path / "out", "--verify").returncode == 0
    (tmp_path / "s.a7s").write_text(FIRST + "expect COUN:X? = 11")
    done = replay(tmp_path / "s.a7s", "--quiet")
    assert (done.returncode, done.stdout) == (3, "")
    assert done.stderr == f"a7sim: {tmp_path}/s.a7s, line 2: expected COUN:X? = 11, got 0.00\n"


def test_an_empty_script_runs_to_its_end(tmp_path):
    assert played(tmp_path, "")[:2] == (None, [])
