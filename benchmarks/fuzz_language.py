"""Send random and mutated lines to the command language and check its rules.

    python benchmarks/fuzz_language.py --lines 1000000 --seed 1
    python benchmarks/fuzz_guided.py -max_total_time=60     # guided by coverage; needs `pip install atheris`

After every line: nothing was raised; a command had no reply; a query had one reply or one error; the reply is one
whole line of printable ASCII and blocks; the error queue, the event bits and the status byte agree with what was
reported. Stops at the first line that breaks a rule and prints it, exit code 1.
"""

import argparse
import random
import re
import sys
import time
from collections import Counter
from contextlib import contextmanager

from figures import Figure, Target, tell

from a7sim.instrument import build_autograph
from a7sim.instrument.language import MAX_LINE_LENGTH, SharedInstrument
from a7sim.instrument.language.commands import COMMANDS
from a7sim.instrument.language.status import QUEUE_LENGTH, Status
from a7sim.instrument.language.table import Choice, Quantity, short_form
from a7sim.link.client.replies import parse_reply
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene

ASKED_OF = 1_000_000
"""Number of lines of the target."""

LINES_AN_INSTRUMENT = 500
"""Lines per instrument."""

MOUNTING = b'PHOT1:LOAD "101";:PHOT2:LOAD "102";:PROJ1:PDIS 152.68;:PROJ2:PDIS 152.68;:BASE:BX 194.99;:DRIV:Z -325.71\n'

SALT = [
    *"?;:*,\"' \t#()+-.eE0123456789",
    "\x00",
    "\x7f",
    "\xe9",
    "\xff",
    ";:",
    "?;",
    " MIN",
    " MM",
    '"1011"',
    "999",
    "1e400",
]

_QUOTED = re.compile(r""""[^"]*("|$)|'[^']*('|$)""")


class Broken(AssertionError):
    """Line that broke a rule."""


@contextmanager
def reported():
    """Yield a list of the numbers of all errors reported in any session."""
    numbers = []
    report = Status.report

    def listened(status, number, detail=""):
        numbers.append(int(number))
        report(status, number, detail)

    Status.report = listened
    try:
        yield numbers
    finally:
        Status.report = report


class Fuzzed:
    """Session whose lines are all checked."""

    def __init__(self, instrument, numbers, admitted=True):
        self.engine = instrument.open(cr_ends_line=False)
        self._clock = Clock()
        self._numbers = numbers
        self._admitted = admitted
        self.tally = Counter()

    def hears(self, line):
        """Feed a line without its end. Raises Broken."""
        self._numbers.clear()
        reply = feed_until_idle(self.engine, line + b"\n", self._clock)
        try:
            self._check(line, reply)
        except AssertionError as broken:
            raise Broken(f"{broken}\nline  {line!r}\nreply {reply[:200]!r}\nerrors {self._numbers}") from broken

    def _check(self, line, reply):
        queries, commands = counted(line)
        replies, errors = count_of(reply), len(self._numbers)
        if not self._admitted:
            assert replies <= line.upper().count(b"*IDN?"), "expected *IDN? alone to be answered before the login"
        assert replies <= queries, f"expected at most {queries} replies, got {replies}"
        unanswered = queries - replies
        most = commands + unanswered
        assert unanswered <= errors <= most, f"expected {unanswered} to {most} errors, got {errors}"
        self._check_status(line)
        self.tally.update(lines=1, queries=queries, commands=commands, replies=replies, errors=errors)
        self.tally.update(map(str, self._numbers))

    def _check_status(self, line):
        status = self.engine.status
        byte = status.status_byte()
        assert len(status.errors) <= QUEUE_LENGTH, "expected a queue that ends"
        assert bool(byte & 4) == bool(status.errors), "expected bit 2 to tell of errors"
        assert bool(byte & 32) == bool(status.event & status.event_enable), "expected bit 5 to sum up the events"
        assert bool(byte & 128) == bool(status.operation.event & status.operation.enable), "expected bit 7 to sum up"
        assert bool(byte & 8) == bool(status.questionable.event & status.questionable.enable), (
            "expected bit 3 to sum up"
        )
        assert bool(byte & 64) == bool(byte & status.service_enable), "expected bit 6 to sum up the status byte"
        assert not status.service_enable & 64, "expected bit 6 to ask for no service of its own"
        for register in (status.operation, status.questionable):
            assert not (register.enable | register.event | register.condition) & ~0x7FFF, "expected 15 bits"
        if b"*" not in line:
            for number in self._numbers:
                bit = {1: 32, 2: 16, 3: 8, 4: 4}[-number // 100]
                assert status.event & bit, f"expected bit value {bit} to tell of {number}"
        for entry in status.errors:
            assert re.fullmatch(r'-\d{3},"[ -!#-~]{1,255}"', entry), f"expected an entry of the queue, got {entry}"


def counted(line):
    """Return the numbers of queries and commands of a line, by its quotes and semicolons only."""
    if len(line) > MAX_LINE_LENGTH:
        return 0, 1
    bare = _QUOTED.sub(lambda found: "x" * len(found[0]), line.removesuffix(b"\r").decode("latin-1"))
    units = [unit.strip(" \t") for unit in bare.split(";")]
    headers = [re.split("[ \t]", unit)[0] for unit in units if unit]
    queries = sum(header.endswith("?") for header in headers)
    return queries, len(headers) - queries


def count_of(reply):
    """Return the number of queries that a reply answers."""
    if not reply:
        return 0
    taken = parse_reply(reply)
    assert taken is not None, "expected a whole reply"
    assert taken.length == len(reply), "expected one reply"
    for part in taken.parts:
        assert isinstance(part, bytes) or re.fullmatch("[\t -~]*", part), "expected printable ASCII and tabs"
    return len(taken.parts)


class Author:
    """Author of lines: good ones, mutated ones, and noise."""

    def __init__(self, seed):
        self._dice = random.Random(seed)
        self._headers = list(COMMANDS.commands)

    def line(self):
        """Return a line without its end."""
        dice = self._dice
        kind = dice.random()
        if kind < 0.05:
            return dice.randbytes(dice.randrange(60)).replace(b"\n", b" ")
        if kind < 0.06:
            return b"*OPC?" + b" " * dice.choice((4090, 4091, 4092, 5000))
        text = ";".join(self._unit() for _ in range(dice.choice((1, 1, 1, 2, 3, 6))))
        for _ in range(dice.choice((0, 0, 1, 1, 2, 4))):
            text = self._spoilt(text)
        return text.encode("latin-1").replace(b"\n", b" ")

    def _unit(self):
        command = self._dice.choice(self._headers)
        header = re.sub(r"\[[^\]]*\]", "", command.header).replace("<n>", self._dice.choice(("", "1", "2", "2", "3")))
        written = self._dice.choice((short_form, str.lower, str))(header)
        root = "" if header.startswith("*") or self._dice.random() < 0.3 else ":"
        return f"{root}{written} {','.join(map(self._parameter, command.parameters))}".rstrip()

    def _parameter(self, kind):
        dice = self._dice
        if isinstance(kind, Choice):
            return dice.choice(kind.words)
        if isinstance(kind, Quantity):
            return dice.choice(("MIN", "MAX", "DEF", "8", "1.5 MM", "-2", "100", f"{dice.uniform(-400, 400):.3f}"))
        return dice.choice(('"101"', "'102'", '"a;b,""c"""', "''", '"1011"', "BX", "12"))

    def _spoilt(self, text):
        dice = self._dice
        at = dice.randrange(len(text) + 1)
        return (
            text[:at] + dice.choice(("", dice.choice(SALT), chr(dice.randrange(256)))) + text[at + dice.randrange(3) :]
        )


def instruments(seed):
    """Yield new instruments, each with a model mounted; every fourth requires a token."""
    scenario = load_scenario("akwanga")
    drawer = build_scene(scenario, seed).mountable
    number = 0
    while True:
        number += 1
        instrument = SharedInstrument(build_autograph(scenario.instrument, drawer, seed))
        instrument.open().feed(MOUNTING, 0.0)
        if number % 4 == 0:
            instrument.token = "not to be guessed"
        yield instrument


def fuzz(lines, seed):
    """Test a number of lines and return the tally. Raises Broken, or any exception of the engine."""
    author, tally = Author(seed), Counter()
    with reported() as numbers:
        supply = instruments(seed)
        while tally["lines"] < lines:
            instrument = next(supply)
            fuzzed = Fuzzed(instrument, numbers, instrument.token is None)
            for _ in range(min(LINES_AN_INSTRUMENT, lines - tally["lines"])):
                fuzzed.hears(author.line())
            tally += fuzzed.tally
    return tally


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--lines", type=int, default=ASKED_OF)
    parser.add_argument("--seed", type=int, default=1)
    chosen = parser.parse_args()
    began = time.perf_counter()
    try:
        tally = fuzz(chosen.lines, chosen.seed)
    except Broken as broken:
        sys.exit(f"broken, seed {chosen.seed}: {broken}")
    took = time.perf_counter() - began
    for name in ("lines", "queries", "commands", "replies", "errors"):
        print(f"{name:9} {tally.pop(name):9}")
    print("errors by number: " + ", ".join(f"{number} {count}" for number, count in sorted(tally.items())))
    print(f"no promise broken; {chosen.lines / took:.0f} lines/s, seed {chosen.seed}")
    target = Target("at most", 0) if chosen.lines >= ASKED_OF else None
    return [
        Figure(f"promises that {chosen.lines} lines broke", 0, target=target),
        Figure("lines tried and checked", chosen.lines / took, "lines/s"),
    ]


if __name__ == "__main__":
    tell(main)
