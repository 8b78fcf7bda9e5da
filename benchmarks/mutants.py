"""Change the source in small ways, one at a time, and see whether a test notices (mutation testing).

    pip install mutmut==3.8.1
    python benchmarks/mutants.py [--seed 1985] [--again NAME...]

Mutmut writes every mutant of geometry, reductions and language engine into `mutants/`, works a sample of them against
the test files that `[tool.mutmut]` of pyproject.toml names, and keeps what came of each. It loads the source before it
chooses the mutant, so that one in the making of the command table is never met; and it asks few files. So each mutant
that it leaves is given a second look: a process of its own, that loads the source as mutated, and all the files of its
room. What is printed last are the shares; what survives is to be read one by one (docs/mutants.md). `--again` gives
the second look to mutants that are named, with no first one.
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
MAX_LOOK = 600
"""Seconds; a mutant that takes longer has been noticed."""

SURVIVED, NO_TEST = 0, 33
"""Mutmut's exit codes of what it leaves."""

SOME = "a7sim.geometry._rotation.x_dots*"
"""A few mutants that are worked only because mutmut writes all of them before it works any."""


@dataclass(frozen=True)
class Room:
    """A part of the source, how many of its mutants are drawn, and the tests of the second look, quick ones first."""

    name: str
    package: str
    drawn: int
    tests: tuple[str, ...]


ROOMS = (
    Room("geometry", "a7sim.geometry.", 60, ("geometry", "relative_orientation", "instrument")),
    Room(
        "reductions",
        "a7sim.reduction.",
        110,
        ("strips", "relative_orientation", "reduction", "cards", "reduce_strips", "grid_test", "operator", "empirical"),
    ),
    Room(
        "language",
        "a7sim.instrument.language.",
        90,
        ("protocol_page", "language_edges", "language_properties", "language", "state", "movement", "serve"),
    ),
)


def room_of(name: str) -> Room:
    """Return the room of a mutant."""
    return next(room for room in ROOMS if name.startswith(room.package))


def sampled(names: list[str], seed: int) -> list[str]:
    """Return the sample of a seed, room by room."""
    draw = random.Random(seed)
    in_order = sorted(names)
    return [
        name
        for room in ROOMS
        for name in draw.sample([each for each in in_order if each.startswith(room.package)], room.drawn)
    ]


def exit_codes() -> dict[str, int | None]:
    """Return the results of mutmut's first run by mutant; None where it has not run."""
    found: dict[str, int | None] = {}
    for path in MUTANTS.rglob("*.meta"):
        found |= json.loads(path.read_text(encoding="utf-8"))["exit_code_by_key"]
    return found


def noticed_by(name: str) -> str:
    """Return the test that fails under a mutant, '' where none does."""
    tests = [f"tests/test_{each}.py" for each in room_of(name).tests]
    environment = os.environ | {"MUTANT_UNDER_TEST": name, "PYTHONPATH": str(MUTANTS.resolve() / "src")}
    options = ["-q", "-x", "--tb=no", "-m", "not slow", "-p", "no:cacheprovider", "-p", "no:xdist"]
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        done = subprocess.run(
            command, cwd=MUTANTS, env=environment, capture_output=True, text=True, timeout=MAX_LOOK, check=False
        )
    except subprocess.TimeoutExpired:
        return "time out"
    if done.returncode == SURVIVED:
        return ""
    failed = re.search(r"^(?:FAILED|ERROR) (\S+)", done.stdout, re.MULTILINE)
    return failed[1] if failed else "nothing could be loaded"


def looked_at_again(names: list[str]) -> list[str]:
    """Give mutants the second look; return those that nothing notices."""
    survivors = []
    for name in names:
        test = noticed_by(name)
        click.echo(f"{name}: {test or 'SURVIVED'}")
        if not test:
            survivors.append(name)
    return survivors


def mutmut(*arguments: str) -> None:
    """Run mutmut's command line."""
    subprocess.run([sys.executable, "-m", "mutmut", "run", "--max-children", "1", *arguments], check=True)


@click.command(help=__doc__.partition("\n")[0])
@click.option("--seed", default=SEED, show_default=True, help="Which mutants are drawn.")
@click.option("--again", multiple=True, metavar="NAME", help="Give this mutant the second look only.")
def main(seed: int, again: tuple[str, ...]) -> None:
    """Draw, work and judge mutants."""
    if again:
        looked_at_again(list(again))
        return
    mutmut(SOME)
    names = sampled(list(exit_codes()), seed)
    mutmut(*names)
    codes = exit_codes()
    open_ = [name for name in names if codes[name] in (None, SURVIVED, NO_TEST)]
    first, drawn = Counter(room_of(name).name for name in open_), Counter(room_of(name).name for name in names)
    second = Counter(room_of(name).name for name in looked_at_again(open_))
    for room in drawn:
        click.echo(
            f"{room}: {drawn[room]} drawn, {drawn[room] - first[room]} killed at the first look, "
            f"{drawn[room] - second[room]} at both ({1 - second[room] / drawn[room]:.1%})"
        )
    click.echo(f"all: {1 - second.total() / drawn.total():.1%} killed, survivors not yet told from equal ones")


if __name__ == "__main__":
    main()
