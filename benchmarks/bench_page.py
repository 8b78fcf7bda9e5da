"""Page of all benchmarks in Markdown: results and machine."""

import datetime
import os
import platform
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from importlib.metadata import version

from figures import COLUMNS, NOT_THERE, NUMBERS, Figure

QUIET = 0.5
"""Load in processors above which other work counts as running."""

PROGRAMS = ("numpy", "scipy")


@dataclass(frozen=True)
class Outcome:
    """Result of a benchmark: its figures, or the reason why there are none."""

    program: str
    arguments: str
    figures: tuple[Figure, ...] = ()
    seconds: float = 0.0
    failure: str = ""
    absent: str = ""
    """Required module that is not installed."""

    @property
    def summary(self) -> str:
        """Return a short description."""
        if self.failure:
            return f"failed: {self.failure}"
        if self.absent:
            return f"{NOT_THERE}: {self.absent}"
        return f"{len(self.figures)} figures in {self.seconds:.0f} s{judged(self.figures)}"

    def rows(self) -> list[tuple[str, ...]]:
        """Return the rows of the table."""
        name = f"`{self.program}.py`"
        if self.failure:
            return [(name, f"failed: {in_a_cell(self.failure)}", "", "", "", "", "**failed**")]
        if self.absent:
            return [(name, "", "", self.absent, NOT_THERE, "", "")]
        return [(name, *map(in_a_cell, cells[:-1]), loud(cells[-1])) for cells in map(Figure.cells, self.figures)]


def judged(figures: Sequence[Figure]) -> str:
    """Return the numbers of met and missed targets as text."""
    met = [each.met for each in figures]
    return "".join(f", {met.count(verdict)} {word}" for verdict, word in ((True, "met"), (False, "missed")))


def in_a_cell(text: str) -> str:
    """Return a text escaped for a table cell."""
    return text.replace("|", r"\|").replace("<", "&lt;")


def loud(verdict: str) -> str:
    """Return a verdict with emphasis if it was missed."""
    return f"**{verdict}**" if verdict == "missed" else verdict


@dataclass(frozen=True)
class Surroundings:
    """Date and machine of the benchmarks, without the name of the machine."""

    date: datetime.date
    processors: int
    kind: str
    versions: tuple[tuple[str, str], ...]
    load: float
    """Processors that were busy in the minute before."""

    @classmethod
    def here(cls) -> "Surroundings":
        """Return the surroundings of this machine, now."""
        versions = [(platform.python_implementation(), platform.python_version())]
        versions += [(name, version(name)) for name in ("a7sim", *PROGRAMS)]
        processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
        kind = f"{platform.system()} on {platform.machine()}"
        today = datetime.datetime.now(datetime.UTC).date()
        return cls(today, processors, kind, tuple(versions), os.getloadavg()[0])

    def __str__(self) -> str:
        versions = ", ".join(" ".join(each) for each in self.versions)
        return f"{self.date.isoformat()}, {self.processors} processors, {self.kind}; {versions}."

    @property
    def company(self) -> str:
        """Return whether other work was running, as text."""
        if self.load > QUIET:
            return (
                f"**Taken beside other work**: {self.load:.1f} of {self.processors} processors were busy before it "
                "began. Times are too long, and ratios less certain than they look."
            )
        return "The machine did nothing else when it began."


def page(outcomes: Iterable[Outcome], surroundings: Surroundings, command: str, full: bool) -> str:
    """Return the page of the results of a command's benchmarks."""
    outcomes = list(outcomes)
    settings = (
        "With the settings that the targets ask for."
        if full
        else "With quick settings; a target that asks for more than was worked has no verdict."
    )
    figures = [each for outcome in outcomes for each in outcome.figures]
    lines = [
        "# Benchmarks",
        "",
        f"Written by `{command}`, not by hand. "
        "[Targets and measurements](targets.md) has the targets of the whole project.",
        "",
        str(surroundings),
        "",
        surroundings.company,
        "",
        f"{settings} {sentence(figures, outcomes)}",
        "",
        "A ratio is to the floor or peer beside it, of the same run; a peer that was not installed is not there.",
        "",
        *table(("benchmark", *COLUMNS), outcomes),
        "",
        "## As they were called",
        "",
        *(f"    python benchmarks/{each.program}.py {each.arguments}".rstrip() for each in outcomes),
        "",
    ]
    return "\n".join(lines)


def sentence(figures: Sequence[Figure], outcomes: Sequence[Outcome]) -> str:
    """Return a summary sentence."""
    failed = sum(bool(each.failure) for each in outcomes)
    met = sum(each.met is True for each in figures)
    missed = sum(each.met is False for each in figures)
    return f"Of {len(figures)} figures, {met} meet their target and {missed} miss it; benchmarks that failed: {failed}."


def table(columns: Sequence[str], outcomes: Iterable[Outcome]) -> list[str]:
    """Return the lines of the table."""
    right = {1 + i for i in NUMBERS}
    return [
        "| " + " | ".join(columns) + " |",
        "| " + " | ".join("---:" if i in right else "---" for i in range(len(columns))) + " |",
        *("| " + " | ".join(row) + " |" for each in outcomes for row in each.rows()),
    ]
