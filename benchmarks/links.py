"""Round trips per second of `COUN:X?`, against servers that only echo and against other simulators of instruments.

    python benchmarks/links.py
    python benchmarks/links.py --peers DIR    # makes the environments of requirements-links.txt in DIR once

In three groups (TCP by a bare socket, a pseudo-terminal by pyserial, VISA in process) the same client asks all in
turn, a short batch each, round after round, and all answer eight bytes. A ratio is the median over the rounds of the
rate to that of the group's floor in the same round. Client and servers share one processor, since what waking another
costs depends on where a scheduler happened to put them; servers are stopped while another is asked. A missing
peer is reported and omitted.
"""

import argparse
import json
import os
import signal
import statistics
import subprocess
import sys
import tempfile
import venv
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path

import processes
from figures import Figure, Target, tell
from round_trips import by_pyserial, by_socket, timed

HERE = Path(__file__).parent
PEERS = HERE / "peers"
TARGET = Target("at least", 0.8, "ratio")
AHEAD = Target("above", 1, "ratio")
FEW = 5
"""Round trips of even the shortest batch."""

SINSTRUMENTS, PYVISA_SIM = "sinstruments==1.5.0", "pyvisa-sim==0.7.1"
LEWIS = {"lewis==1.3.5": 0.1, "lewis==1.4.0": 0}
"""With the cycle delay in s at which each answers soonest: 1.3.5 wakes for a client, 1.4.0 looks once a cycle."""


@dataclass
class Contender:
    """Server with its query function and the times of its answers, s."""

    name: str
    batch: object
    process: object = None
    rounds: list = field(default_factory=list)

    def asked(self, seconds):
        """Query for about `seconds`; a few first queries determine the number."""
        with self._awake():
            first = self.batch(FEW)
            self.rounds.append(self.batch(max(FEW, int(seconds * FEW / sum(first)))))

    @contextmanager
    def _awake(self):
        if self.process is not None:
            self.process.send_signal(signal.SIGCONT)
        yield
        if self.process is not None:
            self.process.send_signal(signal.SIGSTOP)

    @property
    def rates(self):
        return [len(took) / sum(took) for took in self.rounds]

    def percentile_us(self, percent):
        return 1e6 * statistics.quantiles(chain(*self.rounds), n=100, method="inclusive")[percent - 1]


def raced(contenders, rounds, seconds):
    for number in range(rounds):
        first = number % len(contenders)
        for contender in contenders[first:] + contenders[:first]:
            contender.asked(seconds)


def table(group, contenders):
    """Print a group."""
    floor_rates = contenders[1].rates
    print(f"\n{group:44}round trips/s   ratio   p50 us   p99 us")
    for each in contenders:
        ratio = ratio_of(each.rates, floor_rates)
        median, late = each.percentile_us(50), each.percentile_us(99)
        rate = statistics.median(each.rates)
        print(f"  {each.name:42}{rate:13.0f}{ratio:8.2f}{median:9.0f}{late:9.0f}")


def ratio_of(rates, others):
    return statistics.median(rate / other for rate, other in zip(rates, others, strict=True))


def figures_of(group, contenders, peers, target):
    """Return the ratio of ours to the floor and to each peer, including the missing peers."""
    ours, floor, *_ = contenders
    rates = {each.name: each.rates for each in contenders}
    name, rate = f"{group}: COUN:X?", statistics.median(ours.rates)
    latest = ours.percentile_us(99)
    return [
        Figure(name, rate, "round trips/s", floor.name, ratio_of(ours.rates, floor.rates), target),
        *(
            Figure(
                name, rate, "round trips/s", peer, ratio_of(ours.rates, rates[peer]) if peer in rates else None, AHEAD
            )
            for peer in peers
        ),
        Figure(f"{group}: p99", latest, "us", floor.name, latest / floor.percentile_us(99)),
    ]


class Environments:
    """Virtual environments, one for each line of requirements-links.txt."""

    def __init__(self, folder):
        self._folder = folder

    def python(self, requirement):
        """Return the interpreter with a peer, None with a printed reason if it is missing."""
        if self._folder is None:
            print(f"{requirement}: left out; --peers DIR says where it is, or is to be made")
            return None
        line = next(line for line in (HERE / "requirements-links.txt").read_text().splitlines() if requirement in line)
        home = self._folder / requirement
        python = home / "bin" / "python"
        ready = home / ".ready"
        if not ready.exists():
            venv.create(home, clear=True, with_pip=True)
            made = subprocess.run(
                [python, "-m", "pip", "install", "-q", *line.split()], capture_output=True, text=True, check=False
            )
            if made.returncode:
                print(f"{requirement}: left out, not installed: {made.stderr.strip().splitlines()[-1]}")
                return None
            ready.touch()
        return python.absolute()


def ask_batches(ask):
    return lambda count: timed(ask, count)


def answering(name, ask, process):
    """Return a contender. Raises ValueError unless it answers eight bytes."""
    heard = ask()
    if len(heard) != 8:
        raise ValueError(f"{name}: expected an answer of eight bytes, got {heard!r}")
    return Contender(name, ask_batches(ask), process)


def echoes(stack, kind):
    process = stack.enter_context(processes.running([sys.executable, HERE / "echoes.py", kind]))
    return process, process.stdout.readline().strip()


def instrument(stack, link):
    process, endpoints = stack.enter_context(processes.a7sim("--tcp", "127.0.0.1:0", "--pty", str(link)))
    processes.standing_at(endpoints["tcp"]["port"])
    return process, endpoints


def lewis(stack, python, delay):
    port = processes.free_port()
    options = ["-a", PEERS, "-k", "lewis_devices", "-c", delay, "-o", "none"]
    bound = ["-p", f"stream: {{bind_address: 127.0.0.1, port: {port}}}"]
    command = [python.parent / "lewis", *options, *bound, "counter"]
    return stack.enter_context(processes.running(command)), port


def tcp(stack, environments, device, port, sinstruments):
    contenders = [answering("a7sim", by_socket(port), device)]
    for kind in ("asyncio", "threads"):
        process, echo = echoes(stack, kind)
        contenders.append(answering(f"echo, {kind}", by_socket(int(echo)), process))
    for requirement, delay in LEWIS.items():
        python = environments.python(requirement)
        if python:
            process, at = lewis(stack, python, delay)
            contenders.append(answering(requirement, processes.once(partial(by_socket, at)), process))
    if sinstruments:
        process, at, _ = sinstruments
        contenders.append(answering(SINSTRUMENTS, processes.once(partial(by_socket, at)), process))
    return contenders


def pty(stack, device, link, sinstruments):
    process, echo = echoes(stack, "pty")
    contenders = [answering("a7sim", by_pyserial(str(link)), device)]
    contenders.append(answering("echo, pty", by_pyserial(echo), process))
    if sinstruments:
        process, _, link = sinstruments
        contenders.append(answering(SINSTRUMENTS, processes.once(partial(by_pyserial, link)), process))
    return contenders


def visa(stack, environments):
    clients = [
        ("a7sim", sys.executable, "ASRLa7sim://akwanga::INSTR", "@py"),
        ("echo, loop://", sys.executable, "ASRLloop://::INSTR", "@py"),
    ]
    python = environments.python(PYVISA_SIM)
    if python:
        clients.append((PYVISA_SIM, python, "ASRL1::INSTR", f"{PEERS / 'pyvisa_sim_counter.yaml'}@sim"))
    return [visa_client(stack, *client) for client in clients]


def visa_client(stack, name, python, resource, library):
    command = [python, HERE / "round_trips.py", resource, library]
    process = stack.enter_context(processes.running(command, stdin=subprocess.PIPE))
    heard = process.stdout.readline().strip()
    if len(heard) != 7:
        raise ValueError(f"{name}: expected an answer of seven characters, got {heard!r}")

    def batch(count):
        print(count, file=process.stdin, flush=True)
        return json.loads(process.stdout.readline())

    return Contender(name, batch)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--peers", type=Path, metavar="DIR", help="folder of the peers' virtual environments")
    parser.add_argument("--rounds", type=int, default=60)
    parser.add_argument("--batch", type=float, default=0.03, metavar="SECONDS", help="how long each is asked at a time")
    chosen = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    environments = Environments(chosen.peers)
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        device, endpoints = instrument(stack, folder / "a7sim")
        sinstruments = None
        python = environments.python(SINSTRUMENTS)
        if python:
            at, link = processes.free_port(), str(folder / "sinstruments")
            command = [python, PEERS / "sinstruments_counter.py", at, link]
            sinstruments = stack.enter_context(processes.running(command)), at, link
        groups = [
            (
                "TCP, bare socket",
                [*LEWIS, SINSTRUMENTS],
                TARGET,
                tcp(stack, environments, device, endpoints["tcp"]["port"], sinstruments),
            ),
            (
                "pseudo-terminal, pyserial",
                [SINSTRUMENTS],
                TARGET,
                pty(stack, device, folder / "a7sim", sinstruments),
            ),
            ("VISA in process, pyvisa", [PYVISA_SIM], None, visa(stack, environments)),
        ]
        figures = []
        for group, peers, target, contenders in groups:
            raced(contenders, chosen.rounds, chosen.batch)
            table(group, contenders)
            figures += figures_of(group, contenders, peers, target)
        return figures


if __name__ == "__main__":
    tell(main)
