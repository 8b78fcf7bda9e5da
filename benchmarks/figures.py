"""What a benchmark measured, in one shape for all.

A benchmark is a function that prints what people want to see of it and returns its figures. As a program it goes on
with a table of them, or with `--json` has one line of JSON for each and what it printed for people on standard error.
Exit code 1 where a target is missed.
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
"""Columns whose entries stand to the right."""

NOT_THERE = "not there"
SENSES = {
    "at least": operator.ge,
    "above": operator.gt,
    "at most": operator.le,
    "below": operator.lt,
}


@dataclass(frozen=True)
class Target:
    """What is asked of a figure's value or of its ratio: one limit, or two to be between."""

    sense: Literal["at least", "above", "at most", "below", "between"]
    limit: float | tuple[float, float]
    of: Literal["value", "ratio"] = "value"

    def __str__(self) -> str:
        limits = self.limit if isinstance(self.limit, tuple) else (self.limit,)
        numbers = " and ".join(f"{each:.3g}" for each in limits)
        return f"{'ratio ' if self.of == 'ratio' else ''}{self.sense} {numbers}"

    def is_met_by(self, number: float) -> bool:
        """Whether a number is as asked."""
        if isinstance(self.limit, tuple):
            return self.limit[0] <= number <= self.limit[1]
        return bool(SENSES[self.sense](number, self.limit))


@dataclass(frozen=True)
class Figure:
    """A number that was measured, its ratio to a floor's or a peer's of the same run, and what is asked of it."""

    name: str
    value: float
    unit: str = ""
    against: str = ""
    """The floor or peer."""
    ratio: float | None = None
    """None where the floor or peer is not there."""
    target: Target | None = None
    """None where nothing is asked, or not of so few as were worked."""

    @property
    def met(self) -> bool | None:
        """Whether it is as asked, None where nothing is or where there is no number to judge."""
        judged = self.ratio if self.target and self.target.of == "ratio" else self.value
        return None if self.target is None or judged is None else self.target.is_met_by(judged)

    def cells(self) -> tuple[str, ...]:
        """Return what stands in the `COLUMNS` of a table."""
        ratio = NOT_THERE if self.against and self.ratio is None else number(self.ratio)
        verdict = {None: "", True: "met", False: "missed"}[self.met]
        told = str(self.target) if self.target else ""
        return self.name, f"{number(self.value)} {self.unit}".rstrip(), self.against, ratio, told, verdict


def number(value: float | None) -> str:
    """Write a number with three digits, or all before its point."""
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
    """Measure, tell the figures and end the program."""
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
