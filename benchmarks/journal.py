"""Time the journal as a share of the same session without it, and time seeking in a long journal.

Session and session with journal take turns, so that both meet the same machine; the quickest of each are compared,
because other work can only make them slower.
Usage: python benchmarks/journal.py [--repeats N] [--events N]
"""

import argparse
import random
import statistics
import tempfile
import time
from pathlib import Path

from figures import Figure, Target, tell

from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.journal.append_file import DURABILITIES
from a7sim.journal.format import read_journal
from a7sim.journal.replay import Replay, replay_lines
from a7sim.journal.writer import Journal, JournalOptions, make_header
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from a7sim.session import RunOptions, run

ASKED_OF = 100_000
"""Events of the session in which seeking must take less than a second."""

SESSION_S = 8 * 3600.0
SEEKS = 20
SEED = 7
TARGETS = {"none": Target("below", 15)}


def seconds(scenario, folder, durability):
    journal_options = JournalOptions(durability) if durability else JournalOptions()
    began = time.perf_counter()
    run(scenario, SEED, RunOptions(folder if durability else None, force=True, journal_options=journal_options))
    return time.perf_counter() - began


def cost(home, repeats):
    scenario = load_scenario("akwanga")
    ways = [None, *reversed(DURABILITIES)]
    took = {way: [] for way in ways}
    for _ in range(repeats):
        for way in ways:
            took[way].append(seconds(scenario, home / "run", way))
    without = min(took[None])
    lines = len(read_journal(home / "run" / "session.jsonl"))
    print(f"akwanga, {lines} lines: {without:.2f} s without a journal")
    figures = []
    for way in ways[1:]:
        more = min(took[way]) - without
        flush = " (flush: each line to the operating system)" if way == "none" else ""
        print(f"  --durability {way:<8} {more / without:+7.1%}  {1e6 * more / lines:6.1f} us a line{flush}")
        name = f"a journal's cost with --durability {way}"
        figures.append(Figure(name, 100.0 * more / without, "% of a session without", target=TARGETS.get(way)))
    return figures


def long_session(folder, events):
    """Write the journal of a session with a number of events: turning, looking, reading, registering."""
    scenario = load_scenario("akwanga")
    instrument = SharedInstrument(build_autograph(scenario.instrument, build_scene(scenario, SEED).mountable, SEED))
    folder.mkdir()
    dice = random.Random(SEED)
    with Journal(JournalOptions("none")).recording(folder, make_header("serve", scenario, SEED), instrument) as journal:
        instrument.listener = journal.on_link_event
        engine = instrument.open()
        engine.feed(b'PHOT1:LOAD "101";:PHOT2:LOAD "102";:BASE:BX 194.99\n', 0.0)
        for step in range(events // 4):
            now = 60.0 + step * SESSION_S / (events // 4)
            engine.feed(f"DRIV:X {dice.uniform(-20, 200):.2f};Y {dice.uniform(-150, 150):.2f}\n".encode(), now)
            line = f'REC "{step}"\n' if step % 25 == 0 else f"PROJ1:BY {dice.uniform(-5, 5):.2f}\n"
            engine.feed(line.encode(), now)
            engine.feed(b'EYEP:STER? "1011";:COUN?\n', now)
    return folder / "session.jsonl"


def seeking(home, events):
    path = long_session(home / "long", events)
    dice = random.Random(SEED)
    took = []
    for _ in range(SEEKS):
        began = time.perf_counter()
        journalled = read_journal(path)
        line = dice.randrange(3, len(journalled))
        replay = Replay(journalled)
        for number, _, difference in replay_lines(replay, replay.seek(line)):
            assert difference is None
            if number == line:
                break
        took.append(time.perf_counter() - began)
    size = path.stat().st_size / 1e6
    bare = floor(path)
    print(f"{len(journalled)} lines, {size:.1f} MB: any of {SEEKS} times sought")
    print(f"  in {statistics.median(took):.2f} s (median), {max(took):.2f} s (longest), reading and checking included")
    print(f"  of that {bare:.2f} s to read the bytes and split them into lines")
    middle, target = statistics.median(took), Target("below", 1) if events >= ASKED_OF else None
    return [
        Figure(f"a time sought in {events} events, median", middle, "s", "reading its bytes", middle / bare),
        Figure(f"the same, longest of {SEEKS}", max(took), "s", target=target),
    ]


def floor(path):
    began = time.perf_counter()
    path.read_bytes().split(b"\n")
    return time.perf_counter() - began


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--events", type=int, default=ASKED_OF)
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        return cost(Path(temporary), chosen.repeats) + seeking(Path(temporary), chosen.events)


if __name__ == "__main__":
    tell(main)
