"""Slips: points, settings, readings and entries that are wrong, and their true record, unknown to the operator."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from a7sim.operator.people.random_draws import OperatorRandom
from a7sim.scenario import Observer
from a7sim.scenario.schema import PlannedSlip, SlipKind
from a7sim.standard_points import PLACES

LAST_DIGIT = 0.01
PLANNED_GROSS = 0.5
"""Error of a planned gross slip, counter units."""

MIN_PLANNED = 0.05
"""A planned slip, except of the last digit, is skipped where it changes the reading by less, counter units."""

MAX_PLAUSIBLE = 10.0
"""A larger error is noticed while it is written, counter units."""

_RECENT_SLIPS = 8
"""Number of the latest slips that may still get an entry in the book."""

NEIGHBOUR_COUNT = 2
"""Number of nearest standard points that may be confused with a point."""


_RATE_FIELDS: Mapping[SlipKind, str] = MappingProxyType(
    {
        "wrong point": "wrong_point_rate",
        "wrong sign": "wrong_sign_rate",
        "transposed digits": "transposed_rate",
        "forgotten lever": "forgotten_lever_rate",
        "element not re-read": "not_reread_rate",
    }
)
"""Rates of an observer by kind of slip; misreadings have their rates in the random draws."""

READING_SLIPS: tuple[SlipKind, ...] = ("last digit", "gross", "wrong sign", "transposed digits")


@dataclass(frozen=True)
class Slip:
    """Slip with the written or chosen value and the right one."""

    time: float
    """Simulated seconds."""
    model: str
    form: str
    round: int
    point: str
    item: str
    kind: SlipKind
    written: str
    right: str
    entry: int = 0
    """Number of the first entry of the book with this slip; 0 if there is none."""

    def affects(self, point: str, item: str) -> bool:
        """Return whether a reading of an item at a point is affected by this slip."""
        if self.kind == "element not re-read":
            return item == f"set {self.point}"
        return point == self.point and (item == self.item or self.kind == "wrong point")


@dataclass(frozen=True)
class SlipContext:
    """Context in which a slip can happen: session, time, heading, point and item."""

    session: int
    time: float
    model: str
    form: str
    round: int
    point: str = ""
    item: str = ""

    def slip(self, kind: SlipKind, written: str, right: str) -> Slip:
        """Return the slip that happened here."""
        return Slip(self.time, self.model, self.form, self.round, self.point, self.item, kind, written, right)

    def matches(self, planned: PlannedSlip) -> bool:
        """Return whether a planned slip applies here."""
        return (
            planned.model in ("", self.model)
            and planned.form in ("", self.form)
            and planned.point in ("", self.point, self.item)
        )


class Slips:
    """Slips of a batch of operators: drawn by their rates or planned, recorded by session."""

    def __init__(self, observer: Observer, generators: Sequence[OperatorRandom], log: list[list[Slip]]) -> None:
        self.log = log
        """By session."""
        self._observer = observer
        self._generators = generators
        self._planned = [list(observer.certain_slips) for _ in generators]
        self._mistaken_points: dict[int, tuple[str, str]] = {}

    def possible(self, *kinds: SlipKind) -> bool:
        """Return whether a slip of these kinds can happen, by its rate or because one is planned."""
        drawn = any(getattr(self._observer, _RATE_FIELDS[kind]) > 0.0 for kind in kinds if kind in _RATE_FIELDS)
        return drawn or any(planned.kind in kinds for planned in self._observer.certain_slips)

    # --- points ---------------------------------------------------------------------------------------

    def select_point(self, context: SlipContext, near: Sequence[str], factor: float) -> None:
        """Select, by a planned or a drawn slip, one of the near points instead of the point of the context.

        The rate is multiplied by `factor`.
        """
        if not near:
            return
        planned, random = self._take_planned(context, ("wrong point",)), self._generators[context.session]
        if planned or random.slip_draws(self._rate("wrong point") * factor):
            other = near[0 if planned else random.choice(len(near))]
            self._mistaken_points[context.session] = (context.point, other)
            self._record(context, "wrong point", context.point, other)

    def recheck_points(self, sessions: Sequence[int]) -> None:
        """Select the right points again."""
        if self._mistaken_points:
            for session in sessions:
                self._mistaken_points.pop(session, None)

    def mistaken_point(self, session: int, point: str) -> str:
        """Return the point that a session actually measures instead of another."""
        intended, other = self._mistaken_points.get(session, (point, point))
        return other if intended == point else point

    @property
    def no_point_mistaken(self) -> bool:
        """Whether all sessions measure the right points."""
        return not self._mistaken_points

    # --- readings -------------------------------------------------------------------------------------

    def transcribe(self, context: SlipContext, shown: float, misread: float, factor: float) -> float:
        """Return the written value of a counter reading; `misread` is the random misreading already included."""
        kind, written = self._transcribe(context, shown, misread, factor)
        if kind is not None:
            self._record(context, kind, f"{written:.2f}", f"{shown:.2f}")
        return written

    def _transcribe(
        self, context: SlipContext, shown: float, misread: float, factor: float
    ) -> tuple[SlipKind | None, float]:
        random = self._generators[context.session]
        if self._planned[context.session]:
            wrong = _wrong_values(shown, context.item)
            planned = self._take_planned(context, _noticeable_kinds(wrong, shown))
            if planned is not None:
                return planned.kind, wrong[planned.kind][-1]
        if abs(misread - shown) > LAST_DIGIT / 2.0:
            return "last digit" if abs(misread - shown) < 1.5 * LAST_DIGIT else "gross", misread
        for kind, values in _wrong_values(shown, context.item).items():
            if kind in _RATE_FIELDS and random.slip_draws(self._rate(kind) * factor):
                return kind, values[random.choice(len(values))]
        return None, misread

    def note_entry(self, session: int, point: str, item: str, number: int) -> None:
        """Record the number of the entry of a slip in the book."""
        log = self.log[session]
        for i in range(len(log) - 1, max(len(log) - 1 - _RECENT_SLIPS, -1), -1):
            if not log[i].entry and log[i].affects(point, item):
                log[i] = replace(log[i], entry=number)

    # --- fittings and elements ------------------------------------------------------------------------

    def forgets_fitting(self, context: SlipContext, right: str, other: str, factor: float) -> bool:
        """Return whether a session leaves the fitting of the context in the other position."""
        return self._draw_slip(context, "forgotten lever", factor, other, right)

    def uses_stale_reading(self, context: SlipContext, old: float, current: float, factor: float) -> bool:
        """Return whether a session continues with an old reading of the element of the context."""
        return old != current and self._draw_slip(
            context, "element not re-read", factor, f"{old:.2f}", f"{current:.2f}"
        )

    def _draw_slip(self, context: SlipContext, kind: SlipKind, factor: float, written: str, right: str) -> bool:
        planned = self._take_planned(context, (kind,)) is not None
        slips = planned or self._generators[context.session].slip_draws(self._rate(kind) * factor)
        if slips:
            self._record(context, kind, written, right)
        return slips

    # --- planned slips, record ------------------------------------------------------------------------

    def _rate(self, kind: SlipKind) -> float:
        return float(getattr(self._observer, _RATE_FIELDS[kind]))

    def _take_planned(self, context: SlipContext, kinds: Collection[str]) -> PlannedSlip | None:
        """Return the first planned slip of these kinds that applies here; it does not happen again."""
        planned_slips = self._planned[context.session]
        for planned in planned_slips:
            if planned.kind in kinds and context.matches(planned):
                planned_slips.remove(planned)
                return planned
        return None

    def _record(self, context: SlipContext, kind: SlipKind, written: str, right: str) -> None:
        self.log[context.session].append(context.slip(kind, written, right))


def _wrong_values(shown: float, item: str) -> dict[SlipKind, list[float]]:
    """Return the possible wrong values of a reading by kind of slip."""
    wrong: dict[SlipKind, list[float]] = {
        "last digit": [round(shown + LAST_DIGIT, 4)],
        "gross": [round(shown + PLANNED_GROSS, 4)],
        "wrong sign": [-shown] if item.startswith("by") and shown else [],
        "transposed digits": transpositions(shown),
    }
    return {kind: values for kind, values in wrong.items() if values}


def _noticeable_kinds(wrong: Mapping[SlipKind, Sequence[float]], shown: float) -> list[SlipKind]:
    return [kind for kind, values in wrong.items() if kind == "last digit" or abs(values[-1] - shown) > MIN_PLANNED]


def transpositions(shown: float) -> list[float]:
    """Return the values after exchange of two neighbouring digits of a reading, such as 49.21 of 49.12.

    Implausibly large errors are left out.
    """
    text = f"{shown:.2f}"
    pairs = [i for i in range(len(text) - 1) if text[i : i + 2].isdigit() and text[i] != text[i + 1]]
    exchanged = [float(text[:i] + text[i + 1] + text[i] + text[i + 2 :]) for i in pairs]
    return [reading for reading in exchanged if abs(reading - shown) < MAX_PLAUSIBLE]


def neighbours(standard_points: Mapping[str, str], point: str) -> list[str]:
    """Return the names of the standard points nearest to a standard point, empty for any other point."""
    positions = {name: position for position, name in standard_points.items()}
    if point not in positions:
        return []
    centre = np.array(PLACES[positions.pop(point)])

    def distance(name: str) -> tuple[float, str]:
        return float(np.hypot(*(np.array(PLACES[positions[name]]) - centre))), positions[name]

    return sorted(positions, key=distance)[:NEIGHBOUR_COUNT]
