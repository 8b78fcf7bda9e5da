"""`a7sim serve` at the command line (issue 5): its output, errors, end and memory."""

import errno
import json
import os
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest
import serial

import a7sim
from a7sim.link.client.client import Client
from tests.support.processes import ANY_TCP_PORT, SERVE, RunningServer, a7sim_captured
from tests.support.server_thread import TIMEOUT_S

IDENTITY = f"WILD HEERBRUGG,A7,3268,{a7sim.__version__}"


@pytest.fixture
def refused(capsys, monkeypatch):
    """Return a function that gives the error message of a server that does not start."""

    def error_of(*arguments, **environment):
        for name, value in environment.items():
            monkeypatch.setenv(name, value)
        done = a7sim_captured(capsys, "serve", *arguments)
        assert (done.returncode, done.stdout) == (2, "")
        assert "Traceback" not in done.stderr
        return done.stderr

    return error_of


@pytest.fixture(scope="module")
def three_endpoints(tmp_path_factory):
    """Run a server with three endpoints."""
    link = tmp_path_factory.mktemp("line") / "a7"
    with RunningServer(*ANY_TCP_PORT, "--rfc2217", "127.0.0.1:0", "--pty", str(link), "--seed", "7") as running:
        yield running


def test_the_document_contains_all_endpoints_and_they_share_one_instrument(three_endpoints):
    document = three_endpoints.document
    assert (document["schema_version"], document["command"], document["seed"]) == (1, "serve", 7)
    assert [endpoint["kind"] for endpoint in document["listening"]] == ["tcp", "rfc2217", "pty"]
    assert [endpoint["url"].partition("://")[0] for endpoint in document["listening"][:2]] == ["tcp", "rfc2217"]
    for n, endpoint in enumerate(document["listening"]):
        with serial.serial_for_url(endpoint["url"], timeout=TIMEOUT_S) as port:
            client = Client(port)
            assert client.ask("*IDN?") == IDENTITY
            assert client.ask(f"COUN:X?;:DRIV:X {n + 1};:COUN:X?") == f"{n}.00;{n + 1}.00"


def test_a_second_server_does_not_take_the_terminal_of_a_running_one(three_endpoints, refused):
    link = next(endpoint["path"] for endpoint in three_endpoints.document["listening"] if endpoint["kind"] == "pty")
    device = Path(link).readlink()
    assert f"--pty {link}: expected a path of its own" in refused("akwanga", "--tcp", "127.0.0.1:0", "--pty", link)
    assert Path(link).readlink() == device


def test_an_endless_line_of_64_mib_does_not_increase_the_memory_of_the_server(three_endpoints):
    with three_endpoints.line() as line:
        piece = b"x" * (1 << 20)
        line.send(piece)
        line.send(b"\n")
        assert line.ask("SYST:ERR?").startswith("-363,")
        before = _resident(three_endpoints.process.pid)
        for _ in range(64):
            line.send(piece)
        line.send(b"\n")
        assert line.ask("SYST:ERR?").startswith("-363,")
        assert _resident(three_endpoints.process.pid) - before < 1024
        assert line.ask("*IDN?") == IDENTITY


def _resident(pid):
    """Return the resident memory of a process in KiB."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(next(line for line in status.splitlines() if line.startswith("VmRSS")).split()[1])


def test_no_line_of_the_language_opens_reads_or_writes_a_file():
    """Send every header with texts that name files, under the audit hooks of the interpreter (PEP 578)."""
    done = subprocess.run([sys.executable, "-c", _WATCHED], capture_output=True, check=False, text=True)
    assert done.stdout.splitlines()[-1] == "audited: ['open']", done.stdout + done.stderr


_WATCHED = """
import sys
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle
scenario = load_scenario("akwanga")
engine = SharedInstrument(build_autograph(scenario.instrument, build_scene(scenario, 7).mountable, 7)).open()
clock = Clock()
def say(line):
    return feed_until_idle(engine, line.encode() + b"\\n", clock).decode("latin-1")
headers = say("SYST:HELP:HEAD?").replace("<n>", "1").replace("[", "").replace("]", "").strip().split(",")
lines = [header.strip('"') for header in headers]
mount = ['PHOT1:LOAD "101"', 'PHOT2:LOAD "102"']
def everything():
    for more in ("", ' "/etc/passwd"', " 1", " 9,9,1", ' 1,"x"'):
        for line in mount + lines:
            say(line + more * (line in lines))
everything()
heard = []
touching = ("open", "os.", "shutil.", "subprocess.", "import", "socket.")
sys.addaudithook(lambda event, _: event.startswith(touching) and heard.append(event))
everything()
open("/dev/null").close()
print("audited:", heard)
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_signal_stops_the_server_within_a_second_with_link_removed_and_journal_complete(tmp_path, number):
    link, out = tmp_path / "a7", tmp_path / "session"
    with RunningServer(*ANY_TCP_PORT, "--pty", str(link), "--out", str(out)) as running:
        line = running.line()
        assert line.ask("DRIV:X 5;:COUN:X?") == "5.00"
        line.send(b"COUN:X?\n" * 20000)
        code, took, errors = running.stop(number)
    assert (code, errors) == (0, "")
    assert took < 1.0
    assert not os.path.lexists(link)
    text = (out / "session.jsonl").read_text()
    assert text.endswith("}\n")
    header, *events = map(json.loads, text.splitlines())
    assert header["seed"] == running.document["seed"]
    lines = [event["text"] for event in events if event.get("dir") in (">", "<")]
    assert lines[:2] == ["DRIV:X 5;:COUN:X?", "5.00"]


def test_ready_is_the_last_line_printed():
    with subprocess.Popen([*SERVE, "akwanga", *ANY_TCP_PORT], stdout=subprocess.PIPE, text=True) as process:
        kind, url = process.stdout.readline().split()
        assert process.stdout.readline() == "ready\n"
        with serial.serial_for_url(url, timeout=TIMEOUT_S) as port:
            assert (kind, Client(port).ask("*IDN?")) == ("tcp", IDENTITY)
        process.terminate()
        assert (process.stdout.read(), process.wait(TIMEOUT_S)) == ("", 0)


def test_a_token_from_a_file_or_the_environment_is_required(tmp_path):
    token = tmp_path / "token"
    token.write_text("heerbrugg\n")
    for arguments, environment in (
        (("--allow-remote", "--tcp", "0.0.0.0:0", "--token-file", str(token)), {}),
        (ANY_TCP_PORT, {"A7SIM_TOKEN": "heerbrugg"}),
    ):
        with RunningServer(*arguments, **environment) as running, running.line() as line:
            line.send(b'COUN:X?\nSYST:LOG "aarau"\nCOUN:X?\n')
            assert line.ask("*IDN?") == IDENTITY
            assert line.ask('SYST:LOG "heerbrugg";:COUN:X?;:SYST:ERR:COUN?') == "0.00;3"


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--tcp", "0.0.0.0:0"], "0.0.0.0:0: expected an address of this machine alone"),
        (["--rfc2217", "192.0.2.1:2217"], "192.0.2.1:2217: expected an address of this machine alone"),
        (["--tcp", "[::]:0"], "[::]:0: expected an address of this machine alone"),
        (["--tcp", "example.org:0"], "example.org:0: expected an address of this machine alone"),
        (["--allow-remote"], "--allow-remote: expected a token"),
        (["--token-file", "nowhere"], "--token-file nowhere: expected a file with a token"),
        (["--token-file", os.devnull], f"--token-file {os.devnull}: expected a token of 1 to 1000 printable ASCII"),
        (["--token-file", __file__], "characters on one line"),
        (["--tcp", "5025"], "--tcp: expected HOST:PORT such as 127.0.0.1:5025, got '5025'"),
        (["--rfc2217", "127.0.0.1:99999"], "--rfc2217: expected HOST:PORT"),
        (["--pty", os.devnull], "expected nothing there or an old link"),
        (["--pty", "a7", "--pty", "a7"], "--pty: expected a path of its own for each, got a7, a7"),
        (["--fault", "often"], "--fault: expected drop-reply, delay, garble or disconnect"),
        (["--baud", "1"], "--baud"),
    ],
)
def test_the_error_message_for_wrong_arguments_is_one_sentence(arguments, sentence, refused):
    assert sentence in refused("akwanga", *arguments, A7SIM_TOKEN="")


def test_the_error_message_names_an_address_in_use_and_no_link_remains(tmp_path, refused):
    link = tmp_path / "a7"
    with socket.create_server(("127.0.0.1", 0)) as taken:
        address = f"127.0.0.1:{taken.getsockname()[1]}"
        message = refused("akwanga", "--tcp", "127.0.0.1:0", "--tcp", address, "--pty", str(link))
    assert f"--tcp {address}: expected an address to listen on: {os.strerror(errno.EADDRINUSE)}\n" in message
    assert not os.path.lexists(link)
