"""Measures of how something was done, by what is seen at the link: order, completeness, approach, repetition, time."""

from collections.abc import Sequence
from itertools import groupby, pairwise
from statistics import fmean

from msgspec import field

from a7sim.manual import RIGHT_FITTINGS
from a7sim.scenario import Scenario
from a7sim.training.account import Account
from a7sim.training.measures.base import HALF_A_COUNT, Found, Measure, listed, measure, title, where
from a7sim.training.witness import AXES, PLAIN, Reading


def _with(account: Account, element: str, points: Sequence[str] = ()) -> list[Reading]:
    names = [account.name_of(point) for point in points]
    return [
        each
        for each in account.readings
        if (not element or element in each.named) and (not names or each.point in names)
    ]


@measure("missing-readings")
class MissingReadings(Measure, frozen=True, kw_only=True):
    """How many registrations are missing: of every point, and of each element there, so many."""

    unit = "registrations"
    points: list[str]
    elements: list[str] = field(default_factory=list)
    each: int = 1
    after: list[str] = field(default_factory=list)
    """Only those count that were made after the last movement of these handles."""

    def of(self, account: Account) -> Found:
        """Return their number."""
        short: dict[str, list[str]] = {}
        missing = 0
        moved = [each.place for each in account.deeds if each.name in self.after and each.what in PLAIN]
        last = max(moved, default=-1)
        for point in self.points:
            for element in self.elements or [""]:
                readings = [each for each in _with(account, element, [point]) if each.place > last]
                lacks = self.each - len(readings)
                if lacks > 0:
                    missing += lacks
                    short.setdefault(f"{title(element) + ' at ' if element else ''}{point}", []).append(str(lacks))
        wanted = len(self.points) * max(1, len(self.elements)) * self.each
        if not missing:
            return Found(0.0, f"all {wanted} registrations are there")
        late = f" after the last turn of {listed(map(title, self.after))}" if self.after else ""
        return Found(float(missing), f"{missing} of {wanted} registrations are missing{late}: {listed(short)}")


@measure("wrong-approach")
class WrongApproach(Measure, frozen=True, kw_only=True):
    """How many registrations were made with a handle whose last movement came from the other side."""

    unit = "registrations"
    handles: list[str]
    side: int = 1
    """+1 from smaller readings, -1 from larger ones."""
    points: list[str] = field(default_factory=list)
    besides: list[str] = field(default_factory=list)
    """Points at which it does not matter."""

    def of(self, account: Account) -> Found:
        """Return their number."""
        spared = {account.name_of(point) for point in self.besides}
        readings = [each for each in _with(account, "", self.points) if each.point not in spared]
        if not readings:
            return Found(None, "nothing was registered")
        wrong = {
            handle: [each for each in readings if each.sides.get(handle, self.side) != self.side]
            for handle in self.handles
        }
        bad = {each.number for some in wrong.values() for each in some}
        if not bad:
            return Found(0.0, f"{listed(map(title, self.handles))} always came from the same side")
        from_where = "larger" if self.side > 0 else "smaller"
        told = [f"{title(handle)} at {where(some, account)}" for handle, some in wrong.items() if some]
        return Found(
            float(len(bad)),
            f"{len(bad)} of {len(readings)} registrations came from {from_where} readings: {listed(told)}",
        )


@measure("not-left-between")
class NotLeftBetween(Measure, frozen=True, kw_only=True):
    """How many points have no second registration for which a handle had gone away and come back."""

    unit = "points"
    points: list[str]
    handles: list[str]
    away: float = 0.1
    """By how much it must have gone away, in units of its counter."""

    def of(self, account: Account) -> Found:
        """Return their number."""
        lazy = {
            point: [handle for handle in self.handles if not self._came_back(account, point, handle)]
            for point in self.points
        }
        lazy = {point: handles for point, handles in lazy.items() if handles}
        if not lazy:
            return Found(0.0, f"at {listed(self.points)} the second reading is one of its own")
        handles = [title(each) for each in self.handles if any(each in some for some in lazy.values())]
        return Found(
            float(len(lazy)),
            f"at {listed(lazy)} there are no two readings of {listed(handles)} between which it went away "
            f"by {self.away:g} and came back",
        )

    def _came_back(self, account: Account, point: str, handle: str) -> bool:
        readings = _with(account, "" if handle in AXES else handle, [point])
        return any(self._left(account, handle, *pair) for pair in pairwise(readings))

    def _left(self, account: Account, handle: str, first: Reading, then: Reading) -> bool:
        stood = [each.after for each in account.deeds if each.name == handle and first.place < each.place < then.place]
        return any(abs(at - first.shown[handle]) >= self.away - 1e-9 for at in stood)


@measure("one-side-only")
class OneSideOnly(Measure, frozen=True, kw_only=True):
    """How many handles were not registered at a point both coming from smaller readings and from larger ones."""

    unit = "handles"
    point: str
    handles: list[str]

    def of(self, account: Account) -> Found:
        """Return their number."""
        readings = _with(account, "", [self.point])
        if not readings:
            return Found(None, f"nothing was registered at {self.point}")
        lacking = {handle: {each.sides.get(handle, 0) for each in readings} for handle in self.handles}
        told = [
            f"{title(handle)} never came from {'smaller' if 1 not in sides else 'larger'} readings"
            for handle, sides in lacking.items()
            if not {1, -1} <= sides
        ]
        return Found(float(len(told)), f"at {self.point}: {listed(told) if told else 'both sides were registered'}")


@measure("off-target")
class OffTarget(Measure, frozen=True, kw_only=True):
    """The largest difference of a counter from what it should show where a point was registered."""

    unit = "mm"
    targets: dict[str, dict[str, float]]
    """By point, by counter or element."""

    def of(self, account: Account) -> Found:
        """Return it, by the last registration of each point."""
        off: list[tuple[float, str]] = []
        missing = []
        for point, wanted in self.targets.items():
            readings = _with(account, "", [point])
            if not readings:
                missing.append(point)
                continue
            for handle, reading in wanted.items():
                for each in readings:
                    shown = each.shown[handle]
                    off.append((abs(shown - reading), f"{title(handle)} at {point} read {shown:.2f} for {reading:.2f}"))
        if missing:
            return Found(None, f"nothing was registered at {listed(missing)}")
        worst, told = max(off)
        return Found(round(worst, 4), told)

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@measure("element-off")
class ElementOff(Measure, frozen=True, kw_only=True):
    """The largest difference of elements, or counters, from what they should show in the end."""

    unit = "mm or gon"
    wanted: dict[str, float]

    def of(self, account: Account) -> Found:
        """Return it."""
        shown = {
            name: account.autograph.counter(name) if name in AXES else account.autograph.element(name)
            for name in self.wanted
        }
        name = max(self.wanted, key=lambda each: abs(shown[each] - self.wanted[each]))
        return Found(
            round(abs(shown[name] - self.wanted[name]), 4),
            f"{title(name)} stands at {shown[name]:.2f} and belongs at {self.wanted[name]:.2f}",
        )

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@measure("other-not-at-rest")
class OtherNotAtRest(Measure, frozen=True, kw_only=True):
    """How many readings of an element were made while another did not stand where it rests."""

    unit = "readings"
    pairs: dict[str, str]
    """By the element that is read, the one that must rest."""
    at: float = 0.0
    within: float = 0.005

    def of(self, account: Account) -> Found:
        """Return their number."""
        told, count, all_read = [], 0, 0
        for read, other in self.pairs.items():
            readings = [each for each in _with(account, read) if other not in each.named]
            all_read += len(readings)
            wrong = [each for each in readings if abs(each.shown[other] - self.at) > self.within]
            count += len(wrong)
            if wrong:
                told.append(
                    f"{title(other)} was never returned to {self.at:g} before reading {title(read)} "
                    f"at {where(wrong, account)}"
                )
        if not all_read:
            return Found(None, f"no reading of {listed(map(title, self.pairs))} was registered")
        return Found(float(count), listed(told) if told else f"at all {all_read} readings the other one stood at rest")


@measure("spread")
class Spread(Measure, frozen=True, kw_only=True):
    """The largest difference between readings of the same element, or counter, at the same point."""

    unit = "mm"
    handles: list[str]
    points: list[str] = field(default_factory=list)

    def of(self, account: Account) -> Found:
        """Return it."""
        spreads: list[tuple[float, str]] = []
        for handle in self.handles:
            readings = sorted(
                _with(account, "" if handle in AXES else handle, self.points), key=lambda each: each.point
            )
            for _, some in groupby(readings, key=lambda each: each.point):
                group = list(some)
                read = [each.shown[handle] for each in group]
                if len(read) > 1:
                    spread = max(read) - min(read)
                    told = f"{title(handle)} at {where(group, account)} read from {min(read):.2f} to {max(read):.2f}"
                    spreads.append((round(spread, 4), told))
        if not spreads:
            return Found(None, "nothing was read twice")
        return Found(*max(spreads))

    def floor(self, scenario: Scenario) -> float:
        """Return a count: two readings of the same setting may fall on either side of a half."""
        return 2.0 * HALF_A_COUNT


@measure("not-opposed")
class NotOpposed(Measure, frozen=True, kw_only=True):
    """By how much the mean readings of two elements at a point differ from being opposite: by' reads +p, by\" -p."""

    unit = "mm"
    one: str = "by1"
    other: str = "by2"
    points: list[str] = field(default_factory=list)

    def of(self, account: Account) -> Found:
        """Return the largest sum at a point."""
        sums: list[tuple[float, str]] = []
        for point in dict.fromkeys(each.point for each in _with(account, self.one, self.points)):
            ones, others = _with(account, self.one, [point]), _with(account, self.other, [point])
            if others:
                left = fmean(each.shown[self.one] for each in ones)
                right = fmean(each.shown[self.other] for each in others)
                read = f"{title(self.one)} reads {left:+.3f} and {title(self.other)} {right:+.3f}"
                told = f"at {where(ones, account)} {read}"
                sums.append((round(abs(left + right), 4), told))
        if not sums:
            return Found(None, f"no point was read with both {title(self.one)} and {title(self.other)}")
        return Found(*max(sums))

    def floor(self, scenario: Scenario) -> float:
        """Return a count."""
        return 2.0 * HALF_A_COUNT


@measure("wrong-fittings")
class WrongFittings(Measure, frozen=True, kw_only=True):
    """How many fittings do not belong to the pictures and the base: in the end, or at the registrations of a point.

    Base and picture as they are, unless they are named.
    """

    unit = "fittings"
    point: str = ""
    base: str = ""
    polarity: str = ""
    pictures: list[str] = field(default_factory=list)
    """What must lie in the left and the right projector; what else lies there is counted too."""

    def of(self, account: Account) -> Found:
        """Return their number, the base counted where it is not as it should be."""
        autograph = account.autograph
        fittings, base = autograph.fittings.as_words(), autograph.base_mode
        lying = autograph.loaded(1), autograph.loaded(2)
        if self.point:
            readings = _with(account, "", [self.point])
            if not readings:
                return Found(None, f"nothing was registered as {self.point}")
            fittings, base, lying = dict(readings[-1].fittings), readings[-1].base, readings[-1].pictures
        polarity = self.polarity or account.model.polarity
        right = RIGHT_FITTINGS[polarity, self.base or base].as_words()
        wrong = [f"{name} stands {at} and belongs {right[name]}" for name, at in fittings.items() if at != right[name]]
        if self.base and base != self.base:
            wrong.append(f"the base is {base} and belongs {self.base}")
        wrong += [
            f"{there or 'no picture'} lies in projector {projector} and {wanted} belongs there"
            for projector, (there, wanted) in enumerate(zip(lying, self.pictures, strict=False), start=1)
            if there != wanted
        ]
        picture = f"{'at ' + self.point + ' ' if self.point else ''}for a {polarity} with base {self.base or base}"
        return Found(float(len(wrong)), f"{picture}: {listed(wrong) if wrong else 'all is as it belongs'}")


@measure("out-of-order")
class OutOfOrder(Measure, frozen=True, kw_only=True):
    """How many deeds of a procedure are missing or came too early: in each of some chains, its own order.

    Deeds are written 'load 1', 'fiducials 1', 'centre 1', 'set c1', 'turn by1', 'record 3': what, and of what where it
    matters; 'move X' is any way of moving it, 'adjust by1' setting or turning it. The last deed of a kind counts, or
    the first where it ends in '!'.
    """

    unit = "deeds"
    chains: list[list[str]]

    def of(self, account: Account) -> Found:
        """Return their number."""
        missing: list[str] = []
        early: list[str] = []
        for chain in self.chains:
            last, before = -1, ""
            for deed in chain:
                place = self._place(account, deed)
                if place is None:
                    missing.append(_plainly(deed))
                elif place < last:
                    early.append(f"{_plainly(deed)} (before {_plainly(before)})")
                elif place > last:
                    last, before = place, deed
        told = [f"not done: {listed(dict.fromkeys(missing))}"] if missing else []
        told += [f"done too early: {listed(dict.fromkeys(early))}"] if early else []
        return Found(float(len(missing) + len(early)), "; ".join(told) or "everything was done, in its order")

    def _place(self, account: Account, deed: str) -> int | None:
        what, _, name = deed.removesuffix("!").partition(" ")
        kinds = {"move": PLAIN, "adjust": ("set", "turn")}.get(what, (what,))
        places = [
            each.place
            for each in account.deeds
            if each.what in kinds and (not name or account.name_of(name) == each.name or name in (each.name, each.text))
        ]
        return (places[0] if deed.endswith("!") else places[-1]) if places else None


def _plainly(deed: str) -> str:
    what, _, name = deed.removesuffix("!").partition(" ")
    return f"{what} {title(name)}".strip()


@measure("handles-moved")
class HandlesMoved(Measure, frozen=True, kw_only=True):
    """How many elements do not stand in the end where the opening left them."""

    unit = "elements"
    handles: list[str]
    within: float = HALF_A_COUNT

    def of(self, account: Account) -> Found:
        """Return their number."""
        moved = [handle for handle in self.handles if self._by_how_much(account, handle) > self.within + 1e-9]
        told = f"{listed(map(title, moved))} moved" if moved else "all of it stands where it stood"
        return Found(float(len(moved)), told)

    def _by_how_much(self, account: Account, handle: str) -> float:
        deeds = [each for each in account.deeds if each.name == handle and each.what in PLAIN]
        if not deeds:
            return 0.0
        moved = abs(deeds[-1].after - deeds[0].before)
        return min(moved, abs(400.0 - moved)) if handle.startswith("kappa") else moved


@measure("not-looked")
class NotLooked(Measure, frozen=True, kw_only=True):
    """How many points were registered without a look through an eyepiece since the last lever was put over."""

    unit = "points"
    points: list[str]

    def of(self, account: Account) -> Found:
        """Return their number."""
        blind = []
        for point in self.points:
            readings = _with(account, "", [point])
            before = [each for each in account.deeds if readings and each.place < readings[-1].place]
            looks = [each.place for each in before if each.what == "look"]
            levers = [each.place for each in before if each.what in ("fit", "base", "load")]
            if not readings or max(looks, default=-1) < max(levers, default=0):
                blind.append(point)
        told = f"at {listed(blind)} nobody looked after the last lever" if blind else "looked every time"
        return Found(float(len(blind)), told)


@measure("run-by-motor")
class RunByMotor(Measure, frozen=True, kw_only=True):
    """How many registrations were made with a carriage that was last run there, not turned there by hand."""

    unit = "registrations"
    handles: list[str]
    points: list[str] = field(default_factory=list)

    def of(self, account: Account) -> Found:
        """Return their number."""
        readings = _with(account, "", self.points)
        if not readings:
            return Found(None, "nothing was registered")
        ran = [each for each in readings if any(self._ran(account, each, handle) for handle in self.handles)]
        told = f"run there at {where(ran, account)}" if ran else "turned there by hand every time"
        return Found(float(len(ran)), f"{listed(map(title, self.handles))}: {told}")

    def _ran(self, account: Account, reading: Reading, handle: str) -> bool:
        before = [each for each in account.deeds if each.name == handle and each.place < reading.place]
        return bool(before) and before[-1].what in ("drive", "set")


@measure("minutes")
class Minutes(Measure, frozen=True, kw_only=True):
    """Minutes at the simulated clock since the student sat down."""

    unit = "min"

    def of(self, account: Account) -> Found:
        """Return them."""
        minutes = account.seconds / 60.0
        return Found(
            round(minutes, 2), f"{minutes:.1f} of {account.exercise.minutes:g} minutes at the instrument's clock"
        )


@measure("not-answered")
class NotAnswered(Measure, frozen=True, kw_only=True):
    """How many answers are missing."""

    unit = "answers"
    keys: list[str] = field(default_factory=list)
    """All that the exercise asks for, where none are named."""

    def of(self, account: Account) -> Found:
        """Return their number."""
        missing = [key for key in self.keys or account.exercise.answers if not account.answers.get(key)]
        return Found(float(len(missing)), f"not answered: {listed(missing)}" if missing else "all is answered")
