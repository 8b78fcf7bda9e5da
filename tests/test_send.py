"""`a7sim send` and `a7sim operate` at the command line: input, output and errors (issue 5)."""

import json
import os
import pty
import re
import select
import subprocess
import sys

import msgspec
import pytest

from a7sim.errors import A7SimError
from a7sim.link.client.checked_port import TwinCheckedPort, open_checked_port
from a7sim.result_documents import as_json
from a7sim.scenario import load_scenario
from a7sim.session import RunOptions, run
from tests.support.gallery import READ_ONCE
from tests.support.links import new_instrument, serve_on
from tests.test_cli import ROOT, a7sim

CONTROLS = re.compile(r"\x07|\x1b\[[0-9;?]*[A-Za-z]")

IN_PROCESS = "a7sim://akwanga?seed=7"


@pytest.fixture
def url():
    with serve_on("tcp", new_instrument()) as served_url:
        yield served_url


# --- send ----------------------------------------------------------------------------------------------


def test_each_reply_is_printed_on_a_line_and_a_command_prints_nothing(url):
    done = a7sim("send", url, "BASE:BX 194.99", "BASE:BX?;MODE?", "*OPC?")
    assert (done.returncode, done.stdout, done.stderr) == (0, "194.99;IN\n1\n", "")


def test_errors_are_reported_at_the_end_with_exit_code_1(url):
    done = a7sim("send", url, "FOO?", "BASE:BX 999;BX?")
    assert (done.returncode, done.stdout) == (1, "0.00\n")
    assert re.fullmatch(r'a7sim: -113,"Undefined header;FOO\?"\na7sim: -222,"Data out of range;.*"\n', done.stderr)


def test_lines_are_read_from_standard_input_if_none_are_given(url):
    done = subprocess.run(
        [sys.executable, "-m", "a7sim", "send", url],
        input="BASE:BX 20\n\n  BASE:BX?  \nFOO",
        capture_output=True, text=True, check=False, cwd=ROOT,
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (1, "20.00\n")
    assert "Undefined header" in done.stderr


def test_a_document_contains_all_exchanges(url):
    done = a7sim("send", url, "BASE:BX 20", "BASE:BX?", "FOO?", "--json")
    assert json.loads(done.stdout) == {
        "schema_version": 1,
        "command": "send",
        "exchanges": [
            {"sent": "BASE:BX 20", "reply": None},
            {"sent": "BASE:BX?", "reply": "20.00"},
            {"sent": "FOO?", "reply": None},
        ],
        "errors": ['-113,"Undefined header;FOO?"'],
    }
    assert (done.returncode, done.stderr) == (1, "")


def test_a_block_is_printed_as_its_size_and_stored_in_a_file(url, tmp_path):
    file = tmp_path / "left.grey"
    done = a7sim("send", url, "EYEP1:PICT? 33,33,0.5;*OPC?", "--out", file)
    assert (done.returncode, done.stdout) == (0, "#block of 1089 bytes;1\n")
    assert file.read_bytes() == new_instrument().open().feed(b"EYEP1:PICT? 33,33,0.5\n", 0.0)[6:-1]


def test_a_token_is_read_from_a_file_or_the_environment_and_sent_first(tmp_path, monkeypatch):
    (tmp_path / "token").write_text("of the file\n")
    instrument = new_instrument()
    heard = []
    instrument.listener = lambda event: heard.append(event.text) if event.direction == ">" else None
    with serve_on("tcp", instrument) as url:
        monkeypatch.setenv("A7SIM_TOKEN", "of the environment")
        a7sim("send", url, "*OPC?")
        a7sim("send", url, "*OPC?", "--token-file", tmp_path / "token")
    logins = [text for text in heard if text.startswith("SYST:LOG")]
    assert (heard[0], logins) == (logins[0], ['SYST:LOG "of the environment"', 'SYST:LOG "of the file"'])


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["tcp://127.0.0.1:1", "*OPC?"], "a7sim: tcp://127.0.0.1:1: expected an instrument to answer there"),
        (["nowhere", "*OPC?"], "a7sim: nowhere: expected an instrument to answer there: no such file"),
        (["127.0.0.1:5025", "*OPC?"], "tcp://HOST:PORT"),
        ([IN_PROCESS, "--timeout", "0", "*OPC?"], "more than 0, 1000000 at the most"),
        (
            [IN_PROCESS, "--token-file", "no/such/file", "*OPC?"],
            "--token-file no/such/file: expected a file with a token: No",
        ),
        (
            [IN_PROCESS, "--token-file", sys.executable, "*OPC?"],
            "expected a token of 1 to 1000 printable ASCII characters",
        ),
    ],
)
def test_the_error_message_for_bad_input_to_send_is_one_sentence(arguments, sentence):
    done = a7sim("send", *arguments)
    assert (done.returncode, done.stdout) == (2, "")
    assert sentence in done.stderr
    assert "Traceback" not in done.stderr


class Terminal:
    """A pseudo-terminal with a program and its user."""

    def __init__(self, arguments, home):
        environment = os.environ | {"XDG_DATA_HOME": str(home), "TERM": "dumb"}
        self.process, self._screen = pty.fork()
        if not self.process:
            os.chdir(ROOT)
            os.execve(sys.executable, [sys.executable, "-m", "a7sim", *arguments], environment)
        self.seen = ""

    def type_keys(self, keys):
        os.write(self._screen, keys.encode())

    def read_until(self, words):
        while words not in self.seen:
            assert select.select([self._screen], [], [], 20.0)[0], self.seen
            try:
                self.seen += CONTROLS.sub("", os.read(self._screen, 4096).decode())
            except OSError:
                break
        assert words in self.seen
        seen, self.seen = self.seen.split(words, 1)
        return seen

    def exit_code(self):
        _, status = os.waitpid(self.process, 0)
        os.close(self._screen)
        return os.waitstatus_to_exitcode(status)


def test_a_prompt_completes_headers_and_prints_replies_and_errors_after_each_line(tmp_path):
    terminal = Terminal(["send", IN_PROCESS], tmp_path)
    assert "WILD HEERBRUGG,A7" in terminal.read_until("a7sim> ")
    terminal.type_keys("BASE:BX 20\nbas:\nBASE:B\t?\n")
    assert "-102: Syntax error: expected a blank after bas" in terminal.read_until("a7sim> BASE:BX?")
    assert terminal.read_until("a7sim> ").strip() == "20.00"
    terminal.type_keys("help\n")
    assert "PROJector<n>:KAPPa?" in terminal.read_until("a7sim> ")
    terminal.type_keys("exit\n")
    assert terminal.exit_code() == 0
    again = Terminal(["send", IN_PROCESS], tmp_path)
    again.read_until("a7sim> ")
    again.type_keys("\x1b[A\x1b[A\x1b[A\n")
    assert again.read_until("a7sim> ").splitlines()[-1].strip() == "0.00"
    again.type_keys("\x04")
    assert again.exit_code() == 0


# --- operate -------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def one_model():
    """Return a scenario of the first model of Akwanga and its results in process."""
    scenario = load_scenario("akwanga", {"plan.parallax_readings": "1"})
    scenario = msgspec.structs.replace(scenario, models=scenario.models[:1])
    return scenario, as_json(run(scenario, 7))


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tcp", "pty", "rfc2217"])
def test_an_operator_at_a_served_instrument_gives_the_same_results(one_model, kind, tmp_path):
    scenario, results = one_model
    with serve_on(kind, new_instrument(scenario)) as url, open_checked_port(url, timeout=5.0) as port:
        run(scenario, 7, RunOptions(tmp_path / "out", port_adapter=lambda twin: TwinCheckedPort(port, twin, url)))
    assert (tmp_path / "out" / "results.json").read_text(encoding="utf-8") == results


@pytest.mark.slow
def test_operate_writes_the_results_of_run_to_the_byte(url, finished, tmp_path):
    run_folder = finished("akwanga read once", 7).folder
    done = a7sim("operate", "akwanga", "--seed", 7, *READ_ONCE, "--out", tmp_path / "operate", "--quiet", "--link", url)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    for file in ("results.json", "book.csv", "session.jsonl", "strip.csv"):
        assert (tmp_path / "operate" / file).read_bytes() == (run_folder / file).read_bytes()


def test_the_operator_reads_replies_of_the_served_instrument_and_never_of_the_twin(one_model):
    scenario, _ = one_model
    read = []

    class Eavesdropper(TwinCheckedPort):
        def readline(self, size=-1):
            line = super().readline(size)
            read.append((line, self._served.given))
            return line

    class Served:
        def __init__(self, engine):
            self._engine, self._replies = engine, b""

        def write(self, data):
            self._replies += self._engine.feed(data, 0.0)

        def readline(self, size=-1):
            self.given, _, self._replies = self._replies.partition(b"\n")
            self.given += b"\n"
            return self.given

    def eavesdrop(twin):
        return Eavesdropper(Served(new_instrument(scenario).open()), twin, "url")

    run(scenario, 7, RunOptions(port_adapter=eavesdrop))
    assert len(read) > 1000
    assert all(line is given for line, given in read if line)


@pytest.mark.parametrize(
    ("scenario", "seed", "sentence"),
    [
        (
            "akwanga",
            8,
            r"is not a new one of this scenario and seed \(serve it anew\); expected .* in answer to PHOT1:FID",
        ),
        ("akwanga-a8", 7, r"is not a new one .* expected WILD HEERBRUGG,A7.* in answer to \*IDN\?, got .*A8"),
    ],
)
def test_the_error_message_for_an_instrument_of_another_scenario_or_seed_is_one_sentence(
    one_model, scenario, seed, sentence
):
    with (
        serve_on("tcp", new_instrument(scenario, seed)) as url,
        pytest.raises(A7SimError, match=f"{url}: the instrument served {sentence}"),
        open_checked_port(url, timeout=1.0) as port,
    ):
        run(one_model[0], 7, RunOptions(port_adapter=lambda twin: TwinCheckedPort(port, twin, url)))


def test_a_missing_reply_has_another_error_message_than_a_different_reply(one_model):
    class Silent:
        def write(self, data):
            return len(data)

        def readline(self, size=-1):
            return b""

    with pytest.raises(A7SimError, match=r"url: expected an answer to \*IDN\? in time, got none"):
        run(one_model[0], 7, RunOptions(port_adapter=lambda twin: TwinCheckedPort(Silent(), twin, "url")))


def test_operate_holds_the_lock_and_releases_it():
    instrument = new_instrument()
    with serve_on("tcp", instrument) as url:
        with open_checked_port(url, timeout=1.0):
            assert instrument.lock_holder is not None
            with pytest.raises(A7SimError, match="another client holds its lock"), open_checked_port(url, timeout=1.0):
                pytest.fail("two operators at one instrument")
        assert instrument.lock_holder is None


def test_operate_requires_work_at_the_plotter(url):
    done = a7sim("operate", "schut-1956", "--link", url)
    assert done.returncode == 2
    assert "expected work at the plotter" in done.stderr
