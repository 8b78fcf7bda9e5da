"""What the driver developer's guide tells to type works, with the servers that it tells to start (issue 10)."""

import json
import signal
import subprocess

import pytest

from tests.support.guide_pages import not_shown, page, steps
from tests.support.processes import COMMAND, RunningServer, a7sim
from tests.support.server_thread import TIMEOUT_S


class Room:
    """The terminals of somebody who follows the guide: what is served, and where it listens in place of the page."""

    def __init__(self):
        self.places, self.running = {}, []

    def here(self, words):
        """Return words with every door where it really is."""
        for told, found in self.places.items():
            words = [word.replace(told, found) for word in words]
        return words

    def serve(self, words):
        self.close()
        ports = {"--tcp": "127.0.0.1:5025", "--rfc2217": "127.0.0.1:2217"}
        anywhere = [word.replace(":5025", ":0").replace(":2217", ":0") for word in words]
        server = RunningServer(*anywhere[2:], of=anywhere[1:2])
        self.running = [server.process]
        for door in server.listening:
            if door["kind"] != "pty":
                self.places[ports[f"--{door['kind']}"]] = f"127.0.0.1:{door['port']}"

    def record(self, words):
        words = [*self.here(words), "--json"]
        words[words.index("127.0.0.1:5026")] = "127.0.0.1:0"
        recorder = subprocess.Popen([*COMMAND, *words], stdout=subprocess.PIPE, text=True)
        self.running.append(recorder)
        text = ""
        while not text.endswith("\n}\n"):
            line = recorder.stdout.readline()
            assert line, "the recorder has ended"
            text += line
        self.places["127.0.0.1:5026"] = json.loads(text)["url"].removeprefix("tcp://")

    def close(self):
        """End with Ctrl-C, the last begun first, as the page says; each leaves with exit code 0."""
        while self.running:
            process = self.running.pop()
            process.send_signal(signal.SIGINT)
            process.communicate(timeout=TIMEOUT_S)
            assert process.returncode == 0


@pytest.fixture
def room(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    room = Room()
    yield room
    for process in room.running:
        process.kill()
        process.communicate()


@pytest.mark.slow
def test_what_the_guide_tells_to_type_works_with_the_servers_it_tells_to_start(room):
    for step in steps(page("driver-guide")):
        printed = ""
        for words, remark in step.commands:
            if "until Ctrl-C" in remark:
                (room.serve if words[0] == "serve" else room.record)(words)
                continue
            if words[0] == "replay":
                room.close()
            done = a7sim(*room.here(words))
            expected = int(remark.partition("exit code ")[2][:1] or 0)
            assert done.returncode == expected, (words, done.stdout, done.stderr)
            printed += done.stdout
        assert not_shown(step.shown, printed) == [], (step.commands, printed)
    room.close()
