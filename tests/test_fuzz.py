"""benchmarks/fuzz_language.py finds a broken promise; some thousand random lines break none (issue 5)."""

import pytest

from a7sim.instrument.language import ErrorNumber, SharedInstrument
from tests.support.benchmark_programs import benchmark


@pytest.fixture(scope="module")
def fuzzing():
    return benchmark("fuzz_language")


@pytest.fixture
def fuzzed(fuzzing):
    instrument = next(fuzzing.instruments(1))
    with fuzzing.reported() as numbers:
        yield fuzzing.Fuzzed(instrument, numbers)


def test_random_lines_break_no_promise(fuzzing):
    tally = fuzzing.fuzz(3000, seed=7)
    assert tally["lines"] == 3000
    assert min(tally["replies"], tally["-113"], tally["-222"], tally["-203"], tally["-363"]) > 0


def test_the_same_seed_makes_the_same_lines(fuzzing):
    first, again, other = (fuzzing.Author(seed) for seed in (1, 1, 2))
    lines = [first.line() for _ in range(50)]
    assert [again.line() for _ in range(50)] == lines
    assert [other.line() for _ in range(50)] != lines


@pytest.mark.parametrize(
    ("line", "queries", "commands"),
    [
        (b"", 0, 0),
        (b" ; ;", 0, 0),
        (b"*OPC?", 1, 0),
        (b"NOTE 'a;b?';FOO? 'x'", 1, 1),
        (b'NOTE "a;*OPC?', 0, 1),
        (b"*OPC?" + b" " * 5000, 0, 1),
    ],
)
def test_command_units_are_counted_with_quotes_and_semicolons(fuzzing, line, queries, commands):
    assert fuzzing.counted(line) == (queries, commands)


BROKEN_ENGINES = {
    "a command that answers": lambda feed, status: lambda data, time: feed(data, time) or b"1\n",
    "a query without reply or error": lambda feed, status: lambda data, time: feed(data, time) and b"",
    "two replies": lambda feed, status: lambda data, time: feed(data, time) * 2,
    "a reply without its end": lambda feed, status: lambda data, time: feed(data, time)[:-1],
    "a reply that is no ASCII": lambda feed, status: lambda data, time: feed(data, time) and b"\xe9\n",
    "an error for nothing": lambda feed, status: (
        lambda data, time: status.report(ErrorNumber.SYNTAX_ERROR) or status.report(ErrorNumber.SYNTAX_ERROR)
        or feed(data, time)
    ),
    "an error that raises no bit": lambda feed, status: (
        lambda data, time: status.report(ErrorNumber.SYNTAX_ERROR) or setattr(status, "event", 0) or b""
    ),
    "a queue without end": lambda feed, status: (
        lambda data, time: status.errors.extend(["-102,\"Syntax error\""] * 40) or feed(data, time)
    ),
}  # fmt: skip


@pytest.mark.parametrize("defect", BROKEN_ENGINES)
def test_a_broken_promise_is_found(fuzzing, fuzzed, defect):
    fuzzed.hears(b"NOTE 'x'")
    fuzzed.hears(b"BASE:BX?")
    engine = fuzzed.engine
    engine.feed = BROKEN_ENGINES[defect](engine.feed, engine.status)
    with pytest.raises(fuzzing.Broken, match="expected"):
        for line in (b"NOTE 'x'", b"BASE:BX?"):
            fuzzed.hears(line)


def test_a_reply_before_the_login_is_a_broken_promise(fuzzing):
    instrument = next(fuzzing.instruments(1))
    with fuzzing.reported() as numbers:
        fuzzed = fuzzing.Fuzzed(SharedInstrument(instrument.autograph), numbers, admitted=False)
        with pytest.raises(fuzzing.Broken, match="before the login"):
            fuzzed.hears(b"*OPC?")
