"""Common form of the results of benchmarks.

A benchmark is a function that prints its details and returns its figures. As a program it then prints a table of them,
or with `--json` one line of JSON for each, and its details on standard error. Exit code 1 if a target is missed.
"""

import operator
import os
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import msgspec
from rich.console import Console
from rich.text import Text

from a7sim.text_tables import text_table

COLUMNS = ("measured", "value", "against", "ratio", "target", "")
NUMBERS = (1, 3)
"""Right-aligned columns."""

NOT_THERE = "not there"
SENSES = {
    "at least": operator.ge,
    "above": operator.gt,
    "at most": operator.le,
    "below": operator.lt,
}


@dataclass(frozen=True)
class Target:
    """Target of a figure's value or of its ratio: one limit, or two."""

    sense: Literal["at least", "above", "at most", "below", "between"]
    limit: float | tuple[float, float]
    of: Literal["value", "ratio"] = "value"

    def __str__(self) -> str:
        limits = self.limit if isinstance(self.limit, tuple) else (self.limit,)
        numbers = " and ".join(f"{each:.3g}" for each in limits)
        return f"{'ratio ' if self.of == 'ratio' else ''}{self.sense} {numbers}"

    def is_met_by(self, number: float) -> bool:
        """Return whether a number meets it."""
        if isinstance(self.limit, tuple):
            return self.limit[0] <= number <= self.limit[1]
        return bool(SENSES[self.sense](number, self.limit))


@dataclass(frozen=True)
class Figure:
    """Measured number, its ratio to a floor or a peer of the same run, and its target."""

    name: str
    value: float
    unit: str = ""
    against: str = ""
    """Floor or peer."""
    ratio: float | None = None
    """None without floor or peer."""
    target: Target | None = None
    """None without a target, or if the run was too short for it."""

    @property
    def met(self) -> bool | None:
        """Return whether it meets its target, None without a target or a number."""
        judged = self.ratio if self.target and self.target.of == "ratio" else self.value
        return None if self.target is None or judged is None else self.target.is_met_by(judged)

    def cells(self) -> tuple[str, ...]:
        """Return the cells of the `COLUMNS` of a table."""
        ratio = NOT_THERE if self.against and self.ratio is None else number(self.ratio)
        verdict = {None: "", True: "met", False: "missed"}[self.met]
        wanted = str(self.target) if self.target else ""
        return self.name, f"{number(self.value)} {self.unit}".rstrip(), self.against, ratio, wanted, verdict


def number(value: float | None) -> str:
    """Return a number with three digits, or all before its point."""
    if value is None:
        return ""
    return f"{value:.0f}" if abs(value) >= 100 or float(value).is_integer() else f"{value:.3g}"


def written(figures: Iterable[Figure]) -> str:
    """Return figures as lines of JSON."""
    return "".join(msgspec.json.encode(each, enc_hook=float).decode() + "\n" for each in figures)


def read(lines: str) -> list[Figure]:
    """Return the figures of lines of JSON."""
    return [msgspec.json.decode(line, type=Figure) for line in lines.splitlines()]


def tell(measured: Callable[[], Iterable[Figure]]) -> None:
    """Measure, print the figures and exit."""
    as_json = "--json" in sys.argv
    if as_json:
        sys.argv.remove("--json")
        lines = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    figures = list(measured())
    if as_json:
        lines.write(written(figures))
        lines.close()
    elif figures:
        print()
        show(figures)
    sys.exit(int(any(each.met is False for each in figures)))


def show(figures: Iterable[Figure]) -> None:
    """Print figures as a table."""
    table = text_table(*COLUMNS, left=[i for i in range(len(COLUMNS)) if i not in NUMBERS])
    for each in figures:
        table.add_row(*map(Text, each.cells()))
    whole = Console(width=1000).measure(table).maximum
    Console(width=max(Console().width, whole)).print(table)
