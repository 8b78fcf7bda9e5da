"""Slips: what a person takes, sets, reads or writes wrongly, and the record of it that the person does not have."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from a7sim.operator.people.random_draws import OperatorRandom
from a7sim.scenario import Observer
from a7sim.scenario.schema import PlannedSlip, SlipKind
from a7sim.standard_points import PLACES

LAST_DIGIT = 0.01
CERTAIN_GROSS = 0.5
"""Counter units by which a planted gross slip is off."""

MIN_CERTAIN = 0.05
"""A slip other than of the last digit is not planted where it changes the reading by less, in counter units."""

PLAUSIBLE = 10.0
"""What is off by more counter units is noticed while it is being written."""

_LATELY = 8
"""So many of the last slips may still wait for their entry in the book."""

NEIGHBOUR_COUNT = 2
"""So many standard points are near enough to be taken for another."""


_RATES: Mapping[SlipKind, str] = MappingProxyType(
    {
        "wrong point": "wrong_point_rate",
        "wrong sign": "wrong_sign_rate",
        "transposed digits": "transposed_rate",
        "forgotten lever": "forgotten_lever_rate",
        "element not re-read": "not_reread_rate",
    }
)
"""Where an observer says how often; what is misread has its rates in the dice."""

OF_READINGS: tuple[SlipKind, ...] = ("last digit", "gross", "wrong sign", "transposed digits")


@dataclass(frozen=True)
class Slip:
    """A slip as it happened: what was written, taken or set, and what was right."""

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
    """Number of the first entry in the book that suffers from it; 0 where there is none."""

    def affects(self, point: str, item: str) -> bool:
        """Return whether a reading of an item at a point suffers from this slip."""
        if self.kind == "element not re-read":
            return item == f"set {self.point}"
        return point == self.point and (item == self.item or self.kind == "wrong point")


@dataclass(frozen=True)
class SlipContext:
    """Where a slip can happen: whose instrument, when, under which heading, at what."""

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

    def matches(self, certain: PlannedSlip) -> bool:
        """Return whether a planted slip belongs here."""
        return (
            certain.model in ("", self.model)
            and certain.form in ("", self.form)
            and certain.point in ("", self.point, self.item)
        )


class Slips:
    """The slips of a crew: drawn by their rates or planted, and written down by session."""

    def __init__(self, observer: Observer, dice: Sequence[OperatorRandom], log: list[list[Slip]]) -> None:
        self.log = log
        """By session."""
        self._observer = observer
        self._dice = dice
        self._planted = [list(observer.certain_slips) for _ in dice]
        self._taken: dict[int, tuple[str, str]] = {}

    def possible(self, *kinds: SlipKind) -> bool:
        """Return whether anybody may make a slip of these kinds, by its rate or since one is planted."""
        drawn = any(getattr(self._observer, _RATES[kind]) > 0.0 for kind in kinds if kind in _RATES)
        return drawn or any(certain.kind in kinds for certain in self._observer.certain_slips)

    # --- points ---------------------------------------------------------------------------------------

    def select_point(self, each: SlipContext, near: Sequence[str], factor: float) -> None:
        """Take one of the points near for the point of the occasion, if that happens; `factor` is that of the rate."""
        if not near:
            return
        planted, random = self._planted_here(each, ("wrong point",)), self._dice[each.session]
        if planted or random.slip_draws(self._rate("wrong point") * factor):
            other = near[0 if planted else random.choice(len(near))]
            self._taken[each.session] = (each.point, other)
            self._happened(each, "wrong point", each.point, other)

    def recheck_points(self, sessions: Sequence[int]) -> None:
        """Take the right points again."""
        if self._taken:
            for session in sessions:
                self._taken.pop(session, None)

    def mistaken_point(self, session: int, point: str) -> str:
        """Return the point that somebody really looks at for another."""
        meant, other = self._taken.get(session, (point, point))
        return other if meant == point else point

    @property
    def no_point_mistaken(self) -> bool:
        """Whether everybody looks at the right points."""
        return not self._taken

    # --- readings -------------------------------------------------------------------------------------

    def transcribe(self, each: SlipContext, shown: float, misread: float, factor: float) -> float:
        """Return what somebody writes of what a counter shows; `misread` is what chance makes of it already."""
        kind, written = self._written(each, shown, misread, factor)
        if kind is not None:
            self._happened(each, kind, f"{written:.2f}", f"{shown:.2f}")
        return written

    def _written(self, each: SlipContext, shown: float, misread: float, factor: float) -> tuple[SlipKind | None, float]:
        random = self._dice[each.session]
        if self._planted[each.session]:
            possible = _written_wrongly(shown, each.item)
            planted = self._planted_here(each, _plain_to_see(possible, shown))
            if planted is not None:
                return planted.kind, possible[planted.kind][-1]
        if abs(misread - shown) > LAST_DIGIT / 2.0:
            return "last digit" if abs(misread - shown) < 1.5 * LAST_DIGIT else "gross", misread
        for kind, ways in _written_wrongly(shown, each.item).items():
            if kind in _RATES and random.slip_draws(self._rate(kind) * factor):
                return kind, ways[random.choice(len(ways))]
        return None, misread

    def note_entry(self, session: int, point: str, item: str, number: int) -> None:
        """Bear in mind under which number a slip stands in the book."""
        log = self.log[session]
        for i in range(len(log) - 1, max(len(log) - 1 - _LATELY, -1), -1):
            if not log[i].entry and log[i].affects(point, item):
                log[i] = replace(log[i], entry=number)

    # --- levers and elements --------------------------------------------------------------------------

    def forgets_fitting(self, each: SlipContext, right: str, other: str, factor: float) -> bool:
        """Return whether somebody leaves the fitting of the occasion in the other position."""
        return self._lapses(each, "forgotten lever", factor, other, right)

    def uses_stale_reading(self, each: SlipContext, old: float, now: float, factor: float) -> bool:
        """Return whether somebody goes on with an old reading of the element of the occasion."""
        return old != now and self._lapses(each, "element not re-read", factor, f"{old:.2f}", f"{now:.2f}")

    def _lapses(self, each: SlipContext, kind: SlipKind, factor: float, written: str, right: str) -> bool:
        planted = self._planted_here(each, (kind,)) is not None
        lapsed = planted or self._dice[each.session].slip_draws(self._rate(kind) * factor)
        if lapsed:
            self._happened(each, kind, written, right)
        return lapsed

    # --- what is to come, what happened ---------------------------------------------------------------

    def _rate(self, kind: SlipKind) -> float:
        return float(getattr(self._observer, _RATES[kind]))

    def _planted_here(self, each: SlipContext, kinds: Collection[str]) -> PlannedSlip | None:
        """Return the first planted slip of these kinds that belongs here; it does not come again."""
        planted = self._planted[each.session]
        for certain in planted:
            if certain.kind in kinds and each.matches(certain):
                planted.remove(certain)
                return certain
        return None

    def _happened(self, each: SlipContext, kind: SlipKind, written: str, right: str) -> None:
        self.log[each.session].append(each.slip(kind, written, right))


def _written_wrongly(shown: float, item: str) -> dict[SlipKind, list[float]]:
    """Return what may become of a reading by every kind of slip that it can suffer."""
    wrong: dict[SlipKind, list[float]] = {
        "last digit": [round(shown + LAST_DIGIT, 4)],
        "gross": [round(shown + CERTAIN_GROSS, 4)],
        "wrong sign": [-shown] if item.startswith("by") and shown else [],
        "transposed digits": transpositions(shown),
    }
    return {kind: ways for kind, ways in wrong.items() if ways}


def _plain_to_see(wrong: Mapping[SlipKind, Sequence[float]], shown: float) -> list[SlipKind]:
    return [kind for kind, ways in wrong.items() if kind == "last digit" or abs(ways[-1] - shown) > MIN_CERTAIN]


def transpositions(shown: float) -> list[float]:
    """Return the readings that come of exchanging two neighbouring digits of one, as 49.21 of 49.12.

    Those that are further off than anybody would write down are left out.
    """
    text = f"{shown:.2f}"
    pairs = [i for i in range(len(text) - 1) if text[i : i + 2].isdigit() and text[i] != text[i + 1]]
    exchanged = [float(text[:i] + text[i + 1] + text[i] + text[i + 2 :]) for i in pairs]
    return [reading for reading in exchanged if abs(reading - shown) < PLAUSIBLE]


def neighbours(standard_points: Mapping[str, str], point: str) -> list[str]:
    """Return the names of the standard points nearest to one, none for any other point."""
    positions = {name: position for position, name in standard_points.items()}
    if point not in positions:
        return []
    here = np.array(PLACES[positions.pop(point)])

    def distance(name: str) -> tuple[float, str]:
        return float(np.hypot(*(np.array(PLACES[positions[name]]) - here))), positions[name]

    return sorted(positions, key=distance)[:NEIGHBOUR_COUNT]
