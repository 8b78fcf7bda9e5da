"""Change the source in small ways, one at a time, and check whether a test fails (mutation testing).

    pip install mutmut==3.8.1
    python benchmarks/mutants.py [--seed 1985] [--again NAME...]

Mutmut writes every mutant of geometry, reductions and language engine into `mutants/`, runs a sample of them against
the test files that `[tool.mutmut]` of pyproject.toml names, and stores the results. It loads the source before it
selects the mutant, so that a mutant of the construction of the command table has no effect; and it runs few files.
Therefore each mutant that survives runs a second time, in a separate process that loads the mutated source, against
all test files of its part. The last output are the shares of killed mutants; survivors are listed in docs/mutants.md.
`--again` runs only the second run, for named mutants.
"""

import json
import os
import random
import re
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import click

SEED = 1985
MUTANTS = Path("mutants")
MAX_RUN_S = 600
"""Time limit of the second run in s; a mutant that exceeds it is killed."""

SURVIVED, NO_TEST = 0, 33
"""Mutmut's exit codes of survivors."""

FIRST_MUTANTS = "a7sim.geometry._rotation.x_dots*"
"""A few mutants, run only because mutmut writes all mutants before the first run."""


@dataclass(frozen=True)
class SourcePart:
    """Part of the source, its sample size, and the test files of the second run, quick ones first."""

    name: str
    package: str
    sample_size: int
    tests: tuple[str, ...]


SOURCE_PARTS = (
    SourcePart("geometry", "a7sim.geometry.", 60, ("geometry", "relative_orientation", "instrument")),
    SourcePart(
        "reductions",
        "a7sim.reduction.",
        110,
        ("strips", "relative_orientation", "reduction", "cards", "reduce_strips", "grid_test", "operator", "empirical"),
    ),
    SourcePart(
        "language",
        "a7sim.instrument.language.",
        90,
        ("protocol_page", "language_edges", "language_properties", "language", "state", "movement", "serve"),
    ),
)


def part_of(name: str) -> SourcePart:
    """Return the part of the source of a mutant."""
    return next(part for part in SOURCE_PARTS if name.startswith(part.package))


def draw_sample(names: list[str], seed: int) -> list[str]:
    """Return the sample of a seed, part by part."""
    draw = random.Random(seed)
    in_order = sorted(names)
    return [
        name
        for part in SOURCE_PARTS
        for name in draw.sample([each for each in in_order if each.startswith(part.package)], part.sample_size)
    ]


def exit_codes() -> dict[str, int | None]:
    """Return the results of mutmut's first run by mutant; None if it has not run."""
    found: dict[str, int | None] = {}
    for path in MUTANTS.rglob("*.meta"):
        found |= json.loads(path.read_text(encoding="utf-8"))["exit_code_by_key"]
    return found


def failing_test(name: str) -> str:
    """Return the test that fails with a mutant, '' without one."""
    tests = [f"tests/test_{each}.py" for each in part_of(name).tests]
    environment = os.environ | {"MUTANT_UNDER_TEST": name, "PYTHONPATH": str(MUTANTS.resolve() / "src")}
    options = ["-q", "-x", "--tb=no", "-m", "not slow", "-p", "no:cacheprovider", "-p", "no:xdist"]
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        done = subprocess.run(
            command, cwd=MUTANTS, env=environment, capture_output=True, text=True, timeout=MAX_RUN_S, check=False
        )
    except subprocess.TimeoutExpired:
        return "time out"
    if done.returncode == SURVIVED:
        return ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return failed[1] if failed else "nothing could be loaded"


def run_again(names: list[str]) -> list[str]:
    """Run mutants a second time; return the survivors."""
    survivors = []
    for name in names:
        test = failing_test(name)
        click.echo(f"{name}: {test or 'SURVIVED'}")
        if not test:
            survivors.append(name)
    return survivors


def mutmut(*arguments: str) -> None:
    """Run mutmut's command line."""
    subprocess.run([sys.executable, "-m", "mutmut", "run", "--max-children", "1", *arguments], check=True)


@click.command(help=__doc__.partition("\n")[0])
@click.option("--seed", default=SEED, show_default=True, help="Seed of the sample.")
@click.option("--again", multiple=True, metavar="NAME", help="Run this mutant a second time only.")
def main(seed: int, again: tuple[str, ...]) -> None:
    """Draw and run mutants, and print the shares of killed ones."""
    if again:
        run_again(list(again))
        return
    mutmut(FIRST_MUTANTS)
    names = draw_sample(list(exit_codes()), seed)
    mutmut(*names)
    codes = exit_codes()
    survivors = [name for name in names if codes[name] in (None, SURVIVED, NO_TEST)]
    first, drawn = Counter(part_of(name).name for name in survivors), Counter(part_of(name).name for name in names)
    second = Counter(part_of(name).name for name in run_again(survivors))
    for part in drawn:
        click.echo(
            f"{part}: {drawn[part]} drawn, {drawn[part] - first[part]} killed in the first run, "
            f"{drawn[part] - second[part]} in both ({1 - second[part] / drawn[part]:.1%})"
        )
    click.echo(f"all: {1 - second.total() / drawn.total():.1%} killed, equivalent mutants among the survivors included")


if __name__ == "__main__":
    main()
