"""The commands of the driver developer's guide work with the servers that it starts (issue 10)."""

import json
import signal
import subprocess

import pytest

from tests.support.guide_pages import not_shown, page, steps
from tests.support.processes import COMMAND, RunningServer, a7sim
from tests.support.server_thread import TIMEOUT_S


class Terminals:
    """The terminals of a reader of the guide: running servers and their addresses in place of those of the page."""

    def __init__(self):
        self.addresses, self.running = {}, []

    def with_actual_addresses(self, words):
        """Return words with every documented address replaced by the actual one."""
        for documented, actual in self.addresses.items():
            words = [word.replace(documented, actual) for word in words]
        return words

    def serve(self, words):
        self.close()
        ports = {"--tcp": "127.0.0.1:5025", "--rfc2217": "127.0.0.1:2217"}
        with_free_ports = [word.replace(":5025", ":0").replace(":2217", ":0") for word in words]
        server = RunningServer(*with_free_ports[2:], of=with_free_ports[1:2])
        self.running = [server.process]
        for endpoint in server.listening:
            if endpoint["kind"] != "pty":
                self.addresses[ports[f"--{endpoint['kind']}"]] = f"127.0.0.1:{endpoint['port']}"

    def record(self, words):
        words = [*self.with_actual_addresses(words), "--json"]
        words[words.index("127.0.0.1:5026")] = "127.0.0.1:0"
        recorder = subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, text=True)
        self.running.append(recorder)
        text = ""
        while not text.endswith("\n}\n"):
            line = recorder.stdout.readline()
            assert line, "the recorder has ended"
            text += line
        self.addresses["127.0.0.1:5026"] = json.loads(text)["url"].removeprefix("tcp://")

    def close(self):
        """End all processes with Ctrl-C, the last one first, as on the page, and require exit code 0."""
        while self.running:
            process = self.running.pop()
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=TIMEOUT_S)
            assert process.returncode == 0


@pytest.fixture
def terminals(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    terminals = Terminals()
    yield terminals
    for process in terminals.running:
        process.kill()
        process.communicate()


@pytest.mark.slow
def test_the_commands_of_the_guide_work_with_its_servers(terminals):
    for step in steps(page("driver-guide")):
        printed = ""
        for words, remark in step.commands:
            if "until Ctrl-C" in remark:
                (terminals.serve if words[0] == "serve" else terminals.record)(words)
                continue
            if words[0] == "replay":
                terminals.close()
            done = a7sim(*terminals.with_actual_addresses(words))
            expected = int(remark.partition("exit code ")[2][:1] or 0)
            assert done.returncode == expected, (words, done.stdout, done.stderr)
            printed += done.stdout
        assert not_shown(step.shown, printed) == [], (step.commands, printed)
    terminals.close()
