"""Metrics of readings at the link: completeness, approach, agreement."""

from itertools import groupby, pairwise
from statistics import fmean

from msgspec import field

from a7sim.scenario import Scenario
from a7sim.text import pluralize
from a7sim.training.action_log import AXES, PLAIN, Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.metrics.base import (
    HALF_A_COUNT,
    Metric,
    MetricResult,
    describe_points,
    handle_label,
    join_words,
    readings_with,
    register_metric,
)


@register_metric("missing-readings")
class MissingReadings(Metric, frozen=True, kw_only=True):
    """Number of missing registrations: a required number of each point, and of each element there."""

    unit = "registrations"
    points: list[str]
    elements: list[str] = field(default_factory=list)
    each: int = 1
    after: list[str] = field(default_factory=list)
    """Only registrations after the last movement of these controls count."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        short: dict[str, list[str]] = {}
        missing = 0
        moved = [each.index for each in record.actions if each.name in self.after and each.what in PLAIN]
        last = max(moved, default=-1)
        for point in self.points:
            for element in self.elements or [""]:
                readings = [each for each in readings_with(record, element, [point]) if each.place > last]
                lacks = self.each - len(readings)
                if lacks > 0:
                    missing += lacks
                    short.setdefault(f"{handle_label(element) + ' at ' if element else ''}{point}", []).append(
                        str(lacks)
                    )
        wanted = len(self.points) * max(1, len(self.elements)) * self.each
        if not missing:
            return MetricResult(0.0, "no registration is missing")
        late = f" after the last turn of {join_words(map(handle_label, self.after))}" if self.after else ""
        return MetricResult(
            float(missing), f"{missing} of {pluralize(wanted, 'registration')} missing{late}: {join_words(short)}"
        )


@register_metric("wrong-approach")
class WrongApproach(Metric, frozen=True, kw_only=True):
    """Number of registrations with a control whose last movement came from the other side."""

    unit = "registrations"
    handles: list[str]
    side: int = 1
    """+1 from smaller readings, -1 from larger ones."""
    points: list[str] = field(default_factory=list)
    besides: list[str] = field(default_factory=list)
    """Points at which it does not matter."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        spared = {record.name_of(point) for point in self.besides}
        readings = [each for each in readings_with(record, "", self.points) if each.point not in spared]
        if not readings:
            return MetricResult(None, "nothing was registered")
        wrong = {
            handle: [each for each in readings if each.sides.get(handle, self.side) != self.side]
            for handle in self.handles
        }
        bad = {each.number for some in wrong.values() for each in some}
        if not bad:
            return MetricResult(0.0, f"{join_words(map(handle_label, self.handles))} always came from the same side")
        from_where = "larger" if self.side > 0 else "smaller"
        told = [f"{handle_label(handle)} at {describe_points(some, record)}" for handle, some in wrong.items() if some]
        return MetricResult(
            float(len(bad)),
            f"{len(bad)} of {pluralize(len(readings), 'registration')} came from {from_where} readings: "
            f"{join_words(told)}",
        )


@register_metric("one-side-only")
class OneSidedReadings(Metric, frozen=True, kw_only=True):
    """Number of controls not registered at a point with approaches both from smaller and from larger readings."""

    unit = "handles"
    point: str
    handles: list[str]

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        readings = readings_with(record, "", [self.point])
        if not readings:
            return MetricResult(None, f"nothing was registered at {self.point}")
        lacking = {handle: {each.sides.get(handle, 0) for each in readings} for handle in self.handles}
        told = [
            f"{handle_label(handle)} never came from {'smaller' if 1 not in sides else 'larger'} readings"
            for handle, sides in lacking.items()
            if not {1, -1} <= sides
        ]
        return MetricResult(
            float(len(told)), f"at {self.point}: {join_words(told) if told else 'both sides were registered'}"
        )


@register_metric("not-left-between")
class ReadingsWithoutReturn(Metric, frozen=True, kw_only=True):
    """Number of points without a second registration after a control was moved away and back."""

    unit = "points"
    points: list[str]
    handles: list[str]
    away: float = 0.1
    """Required movement, in units of its counter."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        lazy = {
            point: [handle for handle in self.handles if not self._came_back(record, point, handle)]
            for point in self.points
        }
        lazy = {point: handles for point, handles in lazy.items() if handles}
        if not lazy:
            return MetricResult(0.0, f"at {join_words(self.points)} the second reading is one of its own")
        handles = [handle_label(each) for each in self.handles if any(each in some for some in lazy.values())]
        return MetricResult(
            float(len(lazy)),
            f"at {join_words(lazy)} there are no two readings of {join_words(handles)} between which it went away "
            f"by {self.away:g} and came back",
        )

    def _came_back(self, record: AttemptRecord, point: str, handle: str) -> bool:
        readings = readings_with(record, "" if handle in AXES else handle, [point])
        return any(self._left(record, handle, *pair) for pair in pairwise(readings))

    def _left(self, record: AttemptRecord, handle: str, first: Reading, then: Reading) -> bool:
        stood = [each.after for each in record.actions if each.name == handle and first.place < each.index < then.place]
        return any(abs(at - first.shown[handle]) >= self.away - 1e-9 for at in stood)


@register_metric("off-target")
class TargetDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference of a counter from its required reading at the registration of a point."""

    unit = "mm"
    targets: dict[str, dict[str, float]]
    """By point, by counter or element."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return it, by the last registration of each point."""
        off: list[tuple[float, str]] = []
        missing = []
        for point, wanted in self.targets.items():
            readings = readings_with(record, "", [point])
            if not readings:
                missing.append(point)
                continue
            for handle, reading in wanted.items():
                for each in readings:
                    shown = each.shown[handle]
                    off.append(
                        (abs(shown - reading), f"{handle_label(handle)} at {point} read {shown:.2f} for {reading:.2f}")
                    )
        if missing:
            return MetricResult(None, f"nothing was registered at {join_words(missing)}")
        worst, told = max(off)
        return MetricResult(round(worst, 4), told)

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@register_metric("other-not-at-rest")
class OtherElementDisplaced(Metric, frozen=True, kw_only=True):
    """Number of readings of an element while another was not at its rest position."""

    unit = "readings"
    pairs: dict[str, str]
    """By the element that is read, the element that must rest."""
    at: float = 0.0
    within: float = 0.005

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        told, count, all_read = [], 0, 0
        for read, other in self.pairs.items():
            readings = [each for each in readings_with(record, read) if other not in each.named]
            all_read += len(readings)
            wrong = [each for each in readings if abs(each.shown[other] - self.at) > self.within]
            count += len(wrong)
            if wrong:
                told.append(
                    f"{handle_label(other)} was never returned to {self.at:g} before reading {handle_label(read)} "
                    f"at {describe_points(wrong, record)}"
                )
        if not all_read:
            return MetricResult(None, f"no reading of {join_words(map(handle_label, self.pairs))} was registered")
        return MetricResult(
            float(count),
            join_words(told) if told else f"the other one stood at rest at {pluralize(all_read, 'reading')}",
        )


@register_metric("spread")
class ReadingSpread(Metric, frozen=True, kw_only=True):
    """Largest difference between readings of the same element, or counter, at the same point."""

    unit = "mm"
    handles: list[str]
    points: list[str] = field(default_factory=list)

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        spreads: list[tuple[float, str]] = []
        for handle in self.handles:
            readings = sorted(
                readings_with(record, "" if handle in AXES else handle, self.points), key=lambda each: each.point
            )
            for _, some in groupby(readings, key=lambda each: each.point):
                group = list(some)
                read = [each.shown[handle] for each in group]
                if len(read) > 1:
                    spread = max(read) - min(read)
                    told = (
                        f"{handle_label(handle)} at {describe_points(group, record)} read from {min(read):.2f} "
                        f"to {max(read):.2f}"
                    )
                    spreads.append((round(spread, 4), told))
        if not spreads:
            return MetricResult(None, "nothing was read twice")
        return MetricResult(*max(spreads))

    def floor(self, scenario: Scenario) -> float:
        """Return a count: two readings of the same setting may be rounded to either side."""
        return 2.0 * HALF_A_COUNT


@register_metric("not-opposed")
class OppositionDeviation(Metric, frozen=True, kw_only=True):
    """Difference of the mean readings of two elements at a point from being opposite: by' reads +p, by" -p."""

    unit = "mm"
    one: str = "by1"
    other: str = "by2"
    points: list[str] = field(default_factory=list)

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the largest sum at a point."""
        sums: list[tuple[float, str]] = []
        for point in dict.fromkeys(each.point for each in readings_with(record, self.one, self.points)):
            ones, others = readings_with(record, self.one, [point]), readings_with(record, self.other, [point])
            if others:
                left = fmean(each.shown[self.one] for each in ones)
                right = fmean(each.shown[self.other] for each in others)
                read = f"{handle_label(self.one)} reads {left:+.3f} and {handle_label(self.other)} {right:+.3f}"
                told = f"at {describe_points(ones, record)} {read}"
                sums.append((round(abs(left + right), 4), told))
        if not sums:
            return MetricResult(
                None, f"no point was read with both {handle_label(self.one)} and {handle_label(self.other)}"
            )
        return MetricResult(*max(sums))

    def floor(self, scenario: Scenario) -> float:
        """Return a count."""
        return 2.0 * HALF_A_COUNT
