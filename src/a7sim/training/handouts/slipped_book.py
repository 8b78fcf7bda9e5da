"""Observation book of a relative orientation with one of seven slips, which the student has to find."""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import get_args

import numpy as np

from a7sim.errors import A7SimError
from a7sim.operator.driving.fittings import required_fittings
from a7sim.operator.people.observation_book import BookEntry
from a7sim.operator.people.slips import neighbours, transpositions
from a7sim.operator.procedures.relative import GROSS_MM, compute_corrections, unknown_elements
from a7sim.plotters import POSITIONS_OF
from a7sim.scenario import Scenario
from a7sim.scenario.schema import SlipKind
from a7sim.session.lifecycle import open_session
from a7sim.training.handouts.base import Handout, handout
from a7sim.training.procedures import ProcedureContext
from a7sim.training.variation import TRAINING_STREAM

BOOK = "book.csv"

COLUMNS = ("entry", "form", "round", "point", "item", "reading")

ROUNDS = 2

MEASURING = ("by1", "by2")

PLAINLY_MM = 0.05
"""Minimum size of readings for slips of sign and digits: smaller ones reveal little."""

_SLIPS = 1
"""Spawn key of the slip, beside those of the scenario's variation."""


@dataclass(frozen=True)
class BookLine:
    """Line of the fair copy."""

    entry: int
    form: str
    round: int
    point: str
    item: str
    reading: str

    @property
    def is_reading(self) -> bool:
        """Return whether it is a drum reading of a cleared parallax."""
        return self.item in MEASURING


@dataclass(frozen=True)
class Slipped:
    """Copy of a line with a slip, and the right value."""

    line: BookLine
    right: Sequence[str]


@handout("book with a slip")
def book_with_slip(scenario: Scenario, seed: int, kind: str = "") -> Handout:
    """Return the fair copy of an operator's book with one slip of a kind that the seed draws."""
    kinds: tuple[str, ...] = get_args(SlipKind)
    if kind and kind not in kinds:
        raise A7SimError(f"handout_options.kind: expected one of {', '.join(kinds)}, got {kind!r}")
    seated, rounds = _worked(scenario, seed)
    lines = _copied(seated, rounds)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(TRAINING_STREAM, _SLIPS)))
    drawn = str(rng.choice(kinds))
    kind = kind or drawn
    ways = [way for line in lines for way in _WAYS[kind](line, lines, seated)]
    way = ways[int(rng.integers(len(ways)))]
    slipped = [way.line if each.entry == way.line.entry else each for each in lines]
    hidden = {"kind": kind, "entry": way.line.entry, "right": list(way.right)}
    return Handout({BOOK: _as_csv(slipped)}, hidden)


@dataclass(frozen=True)
class _Round:
    """Round of the session: elements before and after, and the book's entries at its points."""

    before: Mapping[str, float]
    after: Mapping[str, float]
    entries: Sequence[BookEntry]


def _worked(scenario: Scenario, seed: int) -> tuple[ProcedureContext, list[_Round]]:
    session = open_session(scenario, seed)
    seated = ProcedureContext.for_model(session.person, session.job, session.job.models[0].name)
    seated.set_up()
    workstation, model, plan = seated.workstation, seated.model, session.job.plan
    active, elements = workstation.operators.active, unknown_elements(plan.method, model)
    labels = model.points_of_case(plan.case)
    rounds = []
    for _ in range(ROUNDS):
        begun = len(session.person.book.entries)
        before = workstation.controls.elements(active, elements)
        seen = workstation.parallaxes(
            active, [model.standard_points[label] for label in labels], plan.parallax_readings
        )
        entries = [each for each in session.person.book.entries[begun:] if each.item in MEASURING and not each.struck]
        mean = seen.parallax_mm.mean(axis=0) if float(np.sqrt(np.mean(seen.parallax_mm**2))) < GROSS_MM else 0.0
        base = np.full(active.size, plan.bx)
        found, _ = compute_corrections(
            workstation, active, model, seen.places, seen.parallax_mm - mean, elements, base, labels
        )
        workstation.controls.set_elements(active, {name: before[name] + found[name][active] for name in elements})
        after = workstation.controls.elements(active, elements)
        counts = [{name: float(each[name][0]) for name in elements} for each in (before, after)]
        rounds.append(_Round(counts[0], counts[1], entries))
    return seated, rounds


def _copied(seated: ProcedureContext, rounds: Sequence[_Round]) -> list[BookLine]:
    """Return the fair copy without a slip: fittings, and the rounds with their sums."""
    model, lines = seated.model, list[BookLine]()

    def write(form: str, round_: int, point: str, item: str, reading: str) -> None:
        lines.append(BookLine(len(lines) + 1, form, round_, point, item, reading))

    for name, position in required_fittings(seated.workstation.controls.manual, model.polarity, model.base).items():
        write("fittings", 0, "", name, position)
    form = "relative orientation"
    for number, worked in enumerate(rounds, start=1):
        for name, value in worked.before.items():
            write(form, number, "", f"{name} before", f"{value:.2f}")
        for point in dict.fromkeys(each.point for each in worked.entries):
            read = [each for each in worked.entries if each.point == point]
            for each in read:
                write(form, number, point, each.item, each.reading)
            by1, by2 = (fmean(float(each.reading) for each in read if each.item == by) for by in MEASURING)
            write(form, number, point, "mean p", f"{(by1 - by2) / 2.0:+.4f}")
        for name, value in worked.after.items():
            correction = (value - worked.before[name] + 200.0) % 400.0 - 200.0
            write(form, number, "", f"{name} correction", f"{correction:+.2f}")
        for name, value in worked.after.items():
            write(form, number, "", f"{name} after", f"{value:.2f}")
    return lines


Way = Callable[[BookLine, Sequence[BookLine], ProcedureContext], list[Slipped]]


def _misread(line: BookLine, wrong: float) -> list[Slipped]:
    return [Slipped(replace(line, reading=f"{wrong:.2f}"), [line.reading])]


def _last_digit(line: BookLine, lines: Sequence[BookLine], seated: ProcedureContext) -> list[Slipped]:
    return _misread(line, float(line.reading) + 0.01) if line.is_reading else []


def _gross(line: BookLine, lines: Sequence[BookLine], seated: ProcedureContext) -> list[Slipped]:
    return _misread(line, float(line.reading) + 1.0) if line.is_reading else []


def _wrong_sign(line: BookLine, lines: Sequence[BookLine], seated: ProcedureContext) -> list[Slipped]:
    plain = line.is_reading and abs(float(line.reading)) > PLAINLY_MM
    return _misread(line, -float(line.reading)) if plain else []


def _transposed(line: BookLine, lines: Sequence[BookLine], seated: ProcedureContext) -> list[Slipped]:
    if not line.is_reading:
        return []
    shown = float(line.reading)
    return [
        each
        for wrong in transpositions(shown)
        if abs(wrong - shown) > PLAINLY_MM and abs(abs(wrong - shown) - 1.0) > PLAINLY_MM
        for each in _misread(line, wrong)
    ]


def _wrong_point(line: BookLine, lines: Sequence[BookLine], seated: ProcedureContext) -> list[Slipped]:
    if not line.is_reading:
        return []
    read = {each.point for each in lines if each.is_reading}
    measured = {position: name for position, name in seated.model.standard_points.items() if name in read}
    position = next(each for each, name in measured.items() if name == line.point)
    return [Slipped(replace(line, point=name), [line.point, position]) for name in neighbours(measured, line.point)]


def _forgotten_lever(line: BookLine, lines: Sequence[BookLine], seated: ProcedureContext) -> list[Slipped]:
    if line.form != "fittings":
        return []
    return [Slipped(replace(line, reading=other), [line.reading]) for other in _others(line.item, line.reading)]


def _others(fitting: str, position: str) -> list[str]:
    return [each for each in POSITIONS_OF[fitting] if each != position]


def _not_reread(line: BookLine, lines: Sequence[BookLine], seated: ProcedureContext) -> list[Slipped]:
    if line.round < 2 or not line.item.endswith(" before"):
        return []
    old = next(each.reading for each in lines if each.round == line.round - 1 and each.item == line.item)
    return [Slipped(replace(line, reading=old), [line.reading])] if old != line.reading else []


_WAYS: Mapping[str, Way] = {
    "last digit": _last_digit,
    "gross": _gross,
    "wrong point": _wrong_point,
    "wrong sign": _wrong_sign,
    "transposed digits": _transposed,
    "forgotten lever": _forgotten_lever,
    "element not re-read": _not_reread,
}


def _as_csv(lines: Sequence[BookLine]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows((each.entry, each.form, each.round or "", each.point, each.item, each.reading) for each in lines)
    return out.getvalue()
