"""Let atheris look for lines that reach what no line has reached, and see that the promises hold for them.

    pip install atheris
    python benchmarks/fuzz_guided.py -max_total_time=60 -seed=1     # options of libFuzzer

The checks are those of fuzz_language.py. Stops at the first line that breaks a promise.
"""

import os
import sys

import atheris
from figures import Figure, Target, tell

with atheris.instrument_imports(include=["a7sim.instrument.language"]):
    import fuzz_language


def listener(numbers):
    """Return a function that hears bytes as lines, on a new instrument now and then."""
    instruments = fuzz_language.instruments(1)
    fuzzed = []

    def hear(data):
        if not fuzzed or fuzzed[0].tally["lines"] >= fuzz_language.LINES_AN_INSTRUMENT:
            instrument = next(instruments)
            fuzzed[:] = [fuzz_language.Fuzzed(instrument, numbers, instrument.token is None)]
        for line in data.split(b"\n"):
            fuzzed[0].hears(line)

    return hear


def guided():
    with fuzz_language.reported() as numbers:
        atheris.Setup(sys.argv, listener(numbers))
        atheris.Fuzz()


def main():
    """Fuzz in a process of its own, since atheris ends the one it is in."""
    process = os.fork()
    if process == 0:
        guided()
    broken = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) != 0
    return [Figure("promises that lines guided by coverage broke", int(broken), target=Target("at most", 0))]


if __name__ == "__main__":
    tell(main)
