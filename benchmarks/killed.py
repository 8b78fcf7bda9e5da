"""Kill sessions with SIGKILL at seeded random moments, resume them, and check that nothing is lost.

Half are runs of the operator, whose folder must then hold, byte for byte, what an uninterrupted run leaves. Half are
servers with two clients, where every registration that was acknowledged must be there after resuming, and where the
clients, who then finish their work, must leave the registrations that they leave uninterrupted.

    python benchmarks/killed.py [SESSIONS [SEED]]
"""

import json
import os
import random
import shutil
import signal
import socket
import sys
import tempfile
import time
from pathlib import Path

from figures import Figure, Target, tell

from a7sim.cli.run import command as run
from a7sim.cli.serve import command as serve
from a7sim.journal.format import read_journal
from a7sim.journal.replay import Replay, replay_lines

RUN = ("dewitt-pair", "--seed", "7", "--set", "plan.parallax_readings=1", "--quiet")
STEPS = 150
"""Registrations of each of the two clients."""


class Forked:
    """Command in a forked process, with its standard output as a pipe."""

    def __init__(self, command, *arguments):
        read, write = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            os.dup2(write, 1)
            os.close(read)
            code = 1
            try:
                code = command.main([str(each) for each in arguments], standalone_mode=False) or 0
            finally:
                os._exit(code)
        os.close(write)
        self.out = os.fdopen(read)

    def kill(self, number=signal.SIGKILL):
        os.kill(self.pid, number)
        return self.wait()

    def wait(self):
        code = os.waitstatus_to_exitcode(os.waitpid(self.pid, 0)[1])
        self.out.close()
        return code

    def port(self):
        text = ""
        while not text.endswith("\n}\n"):
            text += self.out.readline()
        return json.loads(text)["listening"][0]["port"]


def files_of(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != "session.jsonl.torn"}


def killed_run(folder, whole, took, dice):
    """Return how far the journal had come, as a share of the whole one, when a run was killed and then resumed."""
    process = Forked(run, *RUN, "--out", folder)
    time.sleep(dice.uniform(0.05, 1.0) * took)
    process.kill()
    journal = folder / "session.jsonl"
    acknowledged = journal.read_bytes() if journal.exists() else b""
    if b"\n" not in acknowledged:
        return 0.0
    assert whole["session.jsonl"].startswith(acknowledged[: acknowledged.rfind(b"\n") + 1])
    assert Forked(run, "--resume", folder, "--quiet").wait() == 0
    assert files_of(folder) == whole, folder
    return len(acknowledged) / len(whole["session.jsonl"])


class Clerk:
    """Client that repeatedly sets an element, registers it and queries the number of registrations."""

    def __init__(self, number, port, step):
        self._number = number
        self.step = step
        self._file = socket.create_connection(("127.0.0.1", port), timeout=10.0).makefile("rwb", buffering=0)

    def work(self):
        element, step = f"PROJ{self._number}:BY", self.step + 1
        self._file.write(f'{element} {step / 100:.2f};:REC "{self._number}-{step}",BY{self._number}\n'.encode())
        self._file.write(b"REC:COUN?\n")
        if not self._file.readline().endswith(b"\n"):
            raise ConnectionError
        self.step = step


def registered(folder):
    """Return, by client, the points and readings that a journal makes a fresh instrument register."""
    replay = Replay(read_journal(folder / "session.jsonl"))
    assert all(difference is None for _, _, difference in replay_lines(replay))
    found = {1: [], 2: []}
    for each in replay.instrument.autograph.recorder.registrations:
        found[int(each.point[0])].append((each.point, each.readings))
    return found


def work_both(port, steps, dice, until=STEPS):
    """Run two clients in a random order until the server ends; return the acknowledged steps of each."""
    try:
        clerks = [Clerk(number, port, steps[number]) for number in (1, 2)]
    except ConnectionError:
        return steps
    try:
        while any(clerk.step < until for clerk in clerks):
            dice.choice([clerk for clerk in clerks if clerk.step < until]).work()
    except (ConnectionError, TimeoutError):
        pass
    return {number: clerk.step for number, clerk in enumerate(clerks, start=1)}


def killed_server(folder, whole, took, dice):
    """Return how many registrations had been acknowledged when a server was killed, as a share; then it is resumed."""
    process = Forked(serve, "akwanga", "--tcp", "127.0.0.1:0", "--json", "--out", folder)
    port = process.port()
    signal.signal(signal.SIGALRM, lambda *_: os.kill(process.pid, signal.SIGKILL))
    signal.setitimer(signal.ITIMER_REAL, dice.uniform(0.02, 1.0) * took)
    acknowledged = work_both(port, {1: 0, 2: 0}, dice)
    process.wait()
    process = Forked(serve, "--resume", folder, "--tcp", "127.0.0.1:0", "--json")
    port = process.port()
    recorded = {number: len(each) for number, each in registered(folder).items()}
    assert all(recorded[number] - 1 <= acknowledged[number] <= recorded[number] for number in (1, 2)), (
        recorded,
        acknowledged,
    )
    work_both(port, recorded, dice)
    assert process.kill(signal.SIGTERM) == 0
    assert registered(folder) == whole, folder
    return sum(acknowledged.values()) / (2 * STEPS)


def timed(work):
    began = time.perf_counter()
    done = work()
    return done, time.perf_counter() - began


def served_whole(folder):
    process = Forked(serve, "akwanga", "--tcp", "127.0.0.1:0", "--json", "--out", folder)
    port = process.port()
    _, took = timed(lambda: work_both(port, {1: 0, 2: 0}, random.Random(0)))
    process.kill(signal.SIGTERM)
    return registered(folder), took


ASKED_OF = 200
"""Sessions that the target is asked of."""


def main():
    sessions, seed = (*map(int, sys.argv[1:]), *(ASKED_OF, 1)[len(sys.argv) - 1 :])
    dice = random.Random(seed)
    with tempfile.TemporaryDirectory() as temporary:
        home = Path(temporary)
        whole = [timed(lambda: Forked(run, *RUN, "--force", "--out", home / "run").wait()) for _ in range(3)]
        assert {code for code, _ in whole} == {0}
        run_took = min(took for _, took in whole)
        whole_run = files_of(home / "run")
        whole_served, serve_took = served_whole(home / "served")
        shares = {"runs": [], "servers": []}
        for number in range(sessions):
            folder = home / "killed"
            if number % 2:
                shares["servers"].append(killed_server(folder, whole_served, serve_took, dice))
            else:
                shares["runs"].append(killed_run(folder, whole_run, run_took, dice))
            shutil.rmtree(folder, ignore_errors=True)
    for what, each in shares.items():
        within = sum(0.0 < share < 1.0 for share in each)
        print(f"{len(each)} {what} killed, {within} of them within their work, at {min(each):.0%} to {max(each):.0%}")
    print("all resumed: nothing acknowledged was lost, and what they left is the same to the byte")
    target = Target("at most", 0) if sessions >= ASKED_OF else None
    return [Figure(f"of {sessions} sessions killed and resumed, those that lost anything", 0, target=target)]


if __name__ == "__main__":
    tell(main)
