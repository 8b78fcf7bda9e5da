"""Many clients that poll one instrument at once: whether all have their turn, and each its own answers.

    python benchmarks/clients.py --clients 100 --seconds 30

Every client gives itself a number in a register of its own and asks for it with a counter, as fast as it is answered.
No reply is to be wrong, and the slowest client to have at least a fifth of the median's.
"""

import argparse
import asyncio
import statistics
import time

import processes
from figures import Figure, Target, tell
from round_trips import QUERY

MIN_SHARE = Target("at least", 0.2, "ratio")
NONE = Target("at most", 0)


class Poller(asyncio.Protocol):
    """Client that queries again as soon as it has its answer, until it is stopped."""

    def __init__(self, number):
        self._number = number % 256
        self._expected = b"-123.45;%d\n" % self._number
        self._heard = b""
        self._asked_at = 0.0
        self.answers = 0
        self.wrong = []
        self.longest = 0.0
        self.done = False

    def connection_made(self, transport):
        """Send the client's number."""
        self._transport = transport
        transport.write(b"*ESE %d\n" % self._number)

    def ask(self):
        """Send a query."""
        self._asked_at = time.perf_counter()
        self._transport.write(QUERY + b";*ESE?\n")

    def data_received(self, data):
        """Check the answer and query again."""
        self._heard += data
        if not self._heard.endswith(b"\n"):
            return
        if self._heard != self._expected:
            self.wrong.append(self._heard)
        self._heard = b""
        self.answers += 1
        self.longest = max(self.longest, time.perf_counter() - self._asked_at)
        self.ask()

    def connection_lost(self, exc):
        """Count a lost connection as a wrong answer."""
        if not self.done:
            self.wrong.append(b"hung up")


async def polled(port, clients, seconds):
    loop = asyncio.get_running_loop()
    pollers = [Poller(number) for number in range(1, clients + 1)]
    transports = [(await loop.create_connection(lambda p=p: p, "127.0.0.1", port))[0] for p in pollers]
    for poller in pollers:
        poller.ask()
    await asyncio.sleep(seconds)
    for poller, transport in zip(pollers, transports, strict=True):
        poller.done = True
        transport.abort()
    return pollers


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--clients", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=30.0)
    chosen = parser.parse_args()
    with processes.a7sim("--tcp", "127.0.0.1:0", "--clients", str(chosen.clients)) as (_, endpoints):
        port = endpoints["tcp"]["port"]
        processes.standing_at(port)
        pollers = asyncio.run(polled(port, chosen.clients, chosen.seconds))
    answers = sorted(poller.answers for poller in pollers)
    wrong = [each for poller in pollers for each in poller.wrong]
    median = statistics.median(answers)
    share = answers[0] / median if median else 0.0
    print(f"{chosen.clients} clients, {chosen.seconds:g} s: {sum(answers) / chosen.seconds:.0f} round trips/s")
    print(f"answers a client: slowest {answers[0]}, median {median:.0f}, quickest {answers[-1]}")
    print(f"slowest at {share:.2f} of the median; longest wait {1e3 * max(p.longest for p in pollers):.0f} ms")
    print(f"wrong replies: {len(wrong)}{''.join(f', {each!r}' for each in wrong[:3])}")
    asked = f"{chosen.clients} clients for {chosen.seconds:g} s"
    return [
        Figure(f"{asked}, all together", sum(answers) / chosen.seconds, "round trips/s"),
        Figure(f"{asked}, answers to the slowest", answers[0], "", "the median client", share, MIN_SHARE),
        Figure("wrong replies", len(wrong), target=NONE),
    ]


if __name__ == "__main__":
    tell(main)
