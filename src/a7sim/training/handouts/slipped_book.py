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

PARALLAX_ITEMS = ("by1", "by2")

MIN_SLIP_MM = 0.05
"""Minimum size of readings for slips of sign and digits: smaller ones reveal little."""

_SLIP_KEY = 1
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
        return self.item in PARALLAX_ITEMS


@dataclass(frozen=True)
class SlippedLine:
    """Copy of a line with a slip, and the right value."""

    line: BookLine
    right: Sequence[str]


@handout("book with a slip")
def book_with_slip(scenario: Scenario, seed: int, kind: str = "") -> Handout:
    """Return the fair copy of an operator's book with one slip of a kind that the seed draws."""
    kinds: tuple[str, ...] = get_args(SlipKind)
    if kind and kind not in kinds:
        raise A7SimError(f"handout_options.kind: expected one of {', '.join(kinds)}, got {kind!r}")
    context, rounds = _measure_rounds(scenario, seed)
    lines = _fair_copy(context, rounds)
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(TRAINING_STREAM, _SLIP_KEY)))
    drawn_kind = str(rng.choice(kinds))
    kind = kind or drawn_kind
    slips = [slip for line in lines for slip in _SLIP_MAKERS[kind](line, lines, context)]
    slip = slips[int(rng.integers(len(slips)))]
    copied_lines = [slip.line if each.entry == slip.line.entry else each for each in lines]
    hidden = {"kind": kind, "entry": slip.line.entry, "right": list(slip.right)}
    return Handout({BOOK: _to_csv(copied_lines)}, hidden)


@dataclass(frozen=True)
class _BookRound:
    """Round of the session: elements before and after, and the book's entries at its points."""

    before: Mapping[str, float]
    after: Mapping[str, float]
    entries: Sequence[BookEntry]


def _measure_rounds(scenario: Scenario, seed: int) -> tuple[ProcedureContext, list[_BookRound]]:
    session = open_session(scenario, seed)
    context = ProcedureContext.for_model(session.person, session.job, session.job.models[0].name)
    context.set_up()
    workstation, model, plan = context.workstation, context.model, session.job.plan
    active, elements = workstation.operators.active, unknown_elements(plan.method, model)
    labels = model.points_of_case(plan.case)
    rounds = []
    for _ in range(ROUNDS):
        first_entry = len(session.person.book.entries)
        before = workstation.controls.elements(active, elements)
        parallaxes = workstation.parallaxes(
            active, [model.standard_points[label] for label in labels], plan.parallax_readings
        )
        entries = [
            each
            for each in session.person.book.entries[first_entry:]
            if each.item in PARALLAX_ITEMS and not each.struck
        ]
        mean = (
            parallaxes.parallax_mm.mean(axis=0)
            if float(np.sqrt(np.mean(parallaxes.parallax_mm**2))) < GROSS_MM
            else 0.0
        )
        base = np.full(active.size, plan.bx)
        corrections, _ = compute_corrections(
            workstation, active, model, parallaxes.places, parallaxes.parallax_mm - mean, elements, base, labels
        )
        workstation.controls.set_elements(active, {name: before[name] + corrections[name][active] for name in elements})
        after = workstation.controls.elements(active, elements)
        counts = [{name: float(each[name][0]) for name in elements} for each in (before, after)]
        rounds.append(_BookRound(counts[0], counts[1], entries))
    return context, rounds


def _fair_copy(context: ProcedureContext, rounds: Sequence[_BookRound]) -> list[BookLine]:
    """Return the fair copy without a slip: fittings, and the rounds with their sums."""
    model, lines = context.model, list[BookLine]()

    def write(form: str, round_: int, point: str, item: str, reading: str) -> None:
        lines.append(BookLine(len(lines) + 1, form, round_, point, item, reading))

    for name, position in required_fittings(context.workstation.controls.manual, model.polarity, model.base).items():
        write("fittings", 0, "", name, position)
    form = "relative orientation"
    for number, measured_round in enumerate(rounds, start=1):
        for name, value in measured_round.before.items():
            write(form, number, "", f"{name} before", f"{value:.2f}")
        for point in dict.fromkeys(each.point for each in measured_round.entries):
            readings = [each for each in measured_round.entries if each.point == point]
            for each in readings:
                write(form, number, point, each.item, each.reading)
            by1, by2 = (fmean(float(each.reading) for each in readings if each.item == by) for by in PARALLAX_ITEMS)
            write(form, number, point, "mean p", f"{(by1 - by2) / 2.0:+.4f}")
        for name, value in measured_round.after.items():
            correction = (value - measured_round.before[name] + 200.0) % 400.0 - 200.0
            write(form, number, "", f"{name} correction", f"{correction:+.2f}")
        for name, value in measured_round.after.items():
            write(form, number, "", f"{name} after", f"{value:.2f}")
    return lines


SlipMaker = Callable[[BookLine, Sequence[BookLine], ProcedureContext], list[SlippedLine]]


def _misread(line: BookLine, wrong: float) -> list[SlippedLine]:
    return [SlippedLine(replace(line, reading=f"{wrong:.2f}"), [line.reading])]


def _last_digit(line: BookLine, lines: Sequence[BookLine], context: ProcedureContext) -> list[SlippedLine]:
    return _misread(line, float(line.reading) + 0.01) if line.is_reading else []


def _gross(line: BookLine, lines: Sequence[BookLine], context: ProcedureContext) -> list[SlippedLine]:
    return _misread(line, float(line.reading) + 1.0) if line.is_reading else []


def _wrong_sign(line: BookLine, lines: Sequence[BookLine], context: ProcedureContext) -> list[SlippedLine]:
    is_large = line.is_reading and abs(float(line.reading)) > MIN_SLIP_MM
    return _misread(line, -float(line.reading)) if is_large else []


def _transposed(line: BookLine, lines: Sequence[BookLine], context: ProcedureContext) -> list[SlippedLine]:
    if not line.is_reading:
        return []
    reading = float(line.reading)
    return [
        each
        for wrong in transpositions(reading)
        if abs(wrong - reading) > MIN_SLIP_MM and abs(abs(wrong - reading) - 1.0) > MIN_SLIP_MM
        for each in _misread(line, wrong)
    ]


def _wrong_point(line: BookLine, lines: Sequence[BookLine], context: ProcedureContext) -> list[SlippedLine]:
    if not line.is_reading:
        return []
    read_points = {each.point for each in lines if each.is_reading}
    measured = {position: name for position, name in context.model.standard_points.items() if name in read_points}
    position = next(each for each, name in measured.items() if name == line.point)
    return [SlippedLine(replace(line, point=name), [line.point, position]) for name in neighbours(measured, line.point)]


def _forgotten_lever(line: BookLine, lines: Sequence[BookLine], context: ProcedureContext) -> list[SlippedLine]:
    if line.form != "fittings":
        return []
    return [
        SlippedLine(replace(line, reading=other), [line.reading]) for other in _other_positions(line.item, line.reading)
    ]


def _other_positions(fitting: str, position: str) -> list[str]:
    return [each for each in POSITIONS_OF[fitting] if each != position]


def _not_reread(line: BookLine, lines: Sequence[BookLine], context: ProcedureContext) -> list[SlippedLine]:
    if line.round < 2 or not line.item.endswith(" before"):
        return []
    old = next(each.reading for each in lines if each.round == line.round - 1 and each.item == line.item)
    return [SlippedLine(replace(line, reading=old), [line.reading])] if old != line.reading else []


_SLIP_MAKERS: Mapping[str, SlipMaker] = {
    "last digit": _last_digit,
    "gross": _gross,
    "wrong point": _wrong_point,
    "wrong sign": _wrong_sign,
    "transposed digits": _transposed,
    "forgotten lever": _forgotten_lever,
    "element not re-read": _not_reread,
}


def _to_csv(lines: Sequence[BookLine]) -> str:
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(COLUMNS)
    writer.writerows((each.entry, each.form, each.round or "", each.point, each.item, each.reading) for each in lines)
    return out.getvalue()
