"""Run every benchmark, each as a process of its own, and write one table of what they measured.

    python benchmarks/bench.py                      # quick settings, which end in minutes
    python benchmarks/bench.py --full --peers DIR   # as the targets ask, beside the peers in DIR
    python benchmarks/bench.py --only run study

A benchmark that fails or exceeds its time limit is marked in the table and the others run; then exit code 1.
"""

import argparse
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import figures
from bench_page import Outcome, Surroundings, page

HERE = Path(__file__).parent
PAGE = HERE.parent / "docs" / "benchmarks.md"
SCRATCH = "SCRATCH"
"""Placeholder of a temporary folder."""

SECONDS_TO_END = 10.0
"""Time to clean up for a benchmark that exceeds its limit."""


@dataclass(frozen=True)
class Settings:
    """Arguments of a benchmark, and its approximate duration in s."""

    arguments: str
    seconds: float

    @property
    def longest(self) -> float:
        """Time limit in seconds."""
        return 60.0 + 4.0 * self.seconds


@dataclass(frozen=True)
class Benchmark:
    """Program of this folder, with quick settings and those of the targets."""

    program: str
    quick: Settings
    full: Settings
    needs: str = ""
    """Required module."""
    peers: Literal["", "option", "python"] = ""
    """How it gets the location of its peers: by `--peers`, or by the interpreter of an environment of its own name."""

    def command(self, settings: Settings, peers: Path | None) -> list[str]:
        """Return its command."""
        command = [sys.executable, str(HERE / f"{self.program}.py"), "--json", *settings.arguments.split()]
        if peers and self.peers == "option":
            return [*command, "--peers", str(peers)]
        python = peers / self.program / "bin" / "python" if peers else None
        return [str(python), *command[1:]] if python and self.peers == "python" and python.exists() else command


SKILLS = f"5 6 7 8 9 10 11 --out {SCRATCH}"

BENCHMARKS = (
    Benchmark("run", Settings("", 20), Settings("", 20)),
    Benchmark("session_batch", Settings("1 50 200", 30), Settings("", 60)),
    Benchmark("study", Settings("--replicates 200 --growth 20", 170), Settings("--replicates 10000", 900)),
    Benchmark("a8_strip", Settings("200 0", 25), Settings("", 300)),
    Benchmark("reductions", Settings("", 60), Settings("", 60), peers="python"),
    Benchmark("links", Settings("--rounds 20", 20), Settings("", 60), peers="option"),
    Benchmark("clients", Settings("--seconds 10", 15), Settings("", 35)),
    Benchmark("journal", Settings("--repeats 2 --events 20000", 90), Settings("", 180)),
    Benchmark("killed", Settings("20", 40), Settings("", 400)),
    Benchmark("console", Settings("", 45), Settings("", 45)),
    Benchmark("training", Settings("", 40), Settings("", 40)),
    Benchmark("skills", Settings(f"{SKILLS} --seeds 2", 60), Settings(SKILLS, 1500)),
    Benchmark("fuzz_language", Settings("--lines 50000", 30), Settings("", 600)),
    Benchmark("fuzz_guided", Settings("-max_total_time=20", 25), Settings("-max_total_time=600", 605), needs="atheris"),
)


def outcome(benchmark: Benchmark, settings: Settings, peers: Path | None) -> Outcome:
    """Run a benchmark to its end or its limit."""
    program, arguments = benchmark.program, settings.arguments
    if benchmark.needs and not is_installed(benchmark.needs):
        return Outcome(program, arguments, absent=benchmark.needs)
    with tempfile.TemporaryDirectory() as scratch:
        began = time.perf_counter()
        process = subprocess.Popen(
            [each.replace(SCRATCH, scratch) for each in benchmark.command(settings, peers)],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        try:
            lines, output = process.communicate(timeout=settings.longest)
        except subprocess.TimeoutExpired:
            return Outcome(program, arguments, failure=f"not done after {settings.longest:.0f} s")
        finally:
            ended(process)
    took = time.perf_counter() - began
    if lines:
        return Outcome(program, arguments, tuple(figures.read(lines)), took)
    last = (output.strip().splitlines() or [f"exit code {process.returncode}, and nothing said"])[-1]
    return Outcome(program, arguments, failure=last, seconds=took)


def ended(process: subprocess.Popen[str]) -> None:
    """Kill a running benchmark and all its processes."""
    if process.poll() is None:
        process.send_signal(signal.SIGINT)
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=SECONDS_TO_END)
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.communicate()


def is_installed(module: str) -> bool:
    """Return whether a module can be imported, tested in a subprocess."""
    return subprocess.run([sys.executable, "-c", f"import {module}"], capture_output=True, check=False).returncode == 0


def told_time(seconds: float) -> str:
    """Return a duration as text."""
    return f"{max(1, round(seconds / 60))} min"


def run_all(chosen: Sequence[tuple[Benchmark, Settings]], peers: Path | None) -> list[Outcome]:
    """Run benchmarks one after the other and print their progress."""
    outcomes = []
    for number, (each, settings) in enumerate(chosen, start=1):
        output = f"{number} of {len(chosen)}  {each.program} {settings.arguments}".rstrip()
        print(f"{output}  (about {settings.seconds:.0f} s)", flush=True)
        come = outcome(each, settings, peers)
        print(f"    {come.summary}", flush=True)
        outcomes.append(come)
    return outcomes


def options(arguments: Sequence[str] | None = None) -> argparse.Namespace:
    """Parse the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    how_long = parser.add_mutually_exclusive_group()
    how_long.add_argument("--quick", action="store_true", help="settings that end in minutes (the default)")
    how_long.add_argument("--full", action="store_true", help="the settings that the targets ask for")
    names = [each.program for each in BENCHMARKS]
    parser.add_argument("--only", nargs="+", choices=names, metavar="BENCHMARK", help=f"some of {', '.join(names)}")
    parser.add_argument(
        "--peers",
        type=Path,
        metavar="DIR",
        help="folder of the environments with the peers of links.py and reductions.py",
    )
    parser.add_argument("--out", type=Path, default=PAGE, metavar="PAGE", help="where to write the table")
    return parser.parse_args(arguments)


def chosen_by(given: argparse.Namespace) -> list[tuple[Benchmark, Settings]]:
    """Return the selected benchmarks, each with its settings."""
    return [
        (each, each.full if given.full else each.quick)
        for each in BENCHMARKS
        if given.only is None or each.program in given.only
    ]


def command_of(given: argparse.Namespace) -> str:
    """Return the command that makes the page, without a path of this machine."""
    words = ["--full"] if given.full else []
    words += ["--peers DIR"] if given.peers else []
    words += ["--only", *given.only] if given.only else []
    return f"make bench BENCH='{' '.join(words)}'" if words else "make bench"


def main() -> int:
    given = options()
    chosen = chosen_by(given)
    about = told_time(sum(settings.seconds for _, settings in chosen))
    print(f"benchmarks: {len(chosen)}, about {about}; the table goes to {given.out.name}", flush=True)
    surroundings = Surroundings.here()
    outcomes = run_all(chosen, given.peers)
    given.out.write_text(page(outcomes, surroundings, command_of(given), given.full), encoding="utf-8")
    failed = [each.program for each in outcomes if each.failure]
    if failed:
        print(f"failed: {', '.join(failed)}")
    return int(bool(failed))


if __name__ == "__main__":
    sys.exit(main())
