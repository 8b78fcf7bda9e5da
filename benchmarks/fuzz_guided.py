"""Search with atheris for lines that reach new code, and check the rules of the language for them.

    pip install atheris
    python benchmarks/fuzz_guided.py -max_total_time=60 -seed=1     # options of libFuzzer

The checks are those of fuzz_language.py. Stops at the first line that breaks a rule.
"""

import os
import sys

import atheris
from figures import Figure, Target, tell

with atheris.instrument_imports(include=["a7sim.instrument.language"]):
    import fuzz_language


def listener(numbers):
    """Return a function that feeds bytes as lines, with a new instrument at intervals."""
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
    """Fuzz in a separate process, because atheris ends its process."""
    process = os.fork()
    if process == 0:
        guided()
    broken = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]) != 0
    return [Figure("promises that lines guided by coverage broke", int(broken), target=Target("at most", 0))]


if __name__ == "__main__":
    tell(main)
