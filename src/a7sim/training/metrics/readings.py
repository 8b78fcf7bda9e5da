"""Metrics of readings at the link: completeness, approach, agreement."""

from itertools import groupby, pairwise
from statistics import fmean

from msgspec import field

from a7sim.scenario import Scenario
from a7sim.text import pluralize
from a7sim.training.action_log import AXES, MOVEMENTS, Reading
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
        gaps: dict[str, list[str]] = {}
        missing = 0
        moved = [each.index for each in record.actions if each.name in self.after and each.kind in MOVEMENTS]
        last = max(moved, default=-1)
        for point in self.points:
            for element in self.elements or [""]:
                readings = [each for each in readings_with(record, element, [point]) if each.action_index > last]
                shortfall = self.each - len(readings)
                if shortfall > 0:
                    missing += shortfall
                    gaps.setdefault(f"{handle_label(element) + ' at ' if element else ''}{point}", []).append(
                        str(shortfall)
                    )
        wanted = len(self.points) * max(1, len(self.elements)) * self.each
        if not missing:
            return MetricResult(0.0, "no registration is missing")
        condition = f" after the last turn of {join_words(map(handle_label, self.after))}" if self.after else ""
        return MetricResult(
            float(missing), f"{missing} of {pluralize(wanted, 'registration')} missing{condition}: {join_words(gaps)}"
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
        excluded = {record.name_of(point) for point in self.besides}
        readings = [each for each in readings_with(record, "", self.points) if each.point not in excluded]
        if not readings:
            return MetricResult(None, "nothing was registered")
        wrong = {
            handle: [each for each in readings if each.sides.get(handle, self.side) != self.side]
            for handle in self.handles
        }
        bad = {each.number for group in wrong.values() for each in group}
        if not bad:
            return MetricResult(0.0, f"{join_words(map(handle_label, self.handles))} always came from the same side")
        wrong_side = "larger" if self.side > 0 else "smaller"
        places = [
            f"{handle_label(handle)} at {describe_points(group, record)}" for handle, group in wrong.items() if group
        ]
        return MetricResult(
            float(len(bad)),
            f"{len(bad)} of {pluralize(len(readings), 'registration')} came from {wrong_side} readings: "
            f"{join_words(places)}",
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
        sides_of = {handle: {each.sides.get(handle, 0) for each in readings} for handle in self.handles}
        messages = [
            f"{handle_label(handle)} never came from {'smaller' if 1 not in sides else 'larger'} readings"
            for handle, sides in sides_of.items()
            if not {1, -1} <= sides
        ]
        return MetricResult(
            float(len(messages)),
            f"at {self.point}: {join_words(messages) if messages else 'registered from both sides'}",
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
        missing = {
            point: [handle for handle in self.handles if not self._has_returned(record, point, handle)]
            for point in self.points
        }
        missing = {point: handles for point, handles in missing.items() if handles}
        if not missing:
            return MetricResult(0.0, f"independent second readings at {join_words(self.points)}")
        handles = [handle_label(each) for each in self.handles if any(each in group for group in missing.values())]
        return MetricResult(
            float(len(missing)),
            f"no second reading of {join_words(handles)} at {join_words(missing)} after moving by {self.away:g} "
            "away and back",
        )

    def _has_returned(self, record: AttemptRecord, point: str, handle: str) -> bool:
        readings = readings_with(record, "" if handle in AXES else handle, [point])
        return any(self._is_moved_away(record, handle, *pair) for pair in pairwise(readings))

    def _is_moved_away(self, record: AttemptRecord, handle: str, first: Reading, second: Reading) -> bool:
        positions = [
            each.after
            for each in record.actions
            if each.name == handle and first.action_index < each.index < second.action_index
        ]
        return any(abs(position - first.counters[handle]) >= self.away - 1e-9 for position in positions)


@register_metric("off-target")
class TargetDeviation(Metric, frozen=True, kw_only=True):
    """Largest difference of a counter from its required reading at the registration of a point."""

    unit = "mm"
    targets: dict[str, dict[str, float]]
    """By point, by counter or element."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference by the last registration of each point."""
        deviations: list[tuple[float, str]] = []
        missing = []
        for point, wanted in self.targets.items():
            readings = readings_with(record, "", [point])
            if not readings:
                missing.append(point)
                continue
            for handle, reading in wanted.items():
                for each in readings:
                    shown = each.counters[handle]
                    deviations.append(
                        (
                            abs(shown - reading),
                            f"{handle_label(handle)} at {point} reads {shown:.2f}, required {reading:.2f}",
                        )
                    )
        if missing:
            return MetricResult(None, f"nothing was registered at {join_words(missing)}")
        worst, message = max(deviations)
        return MetricResult(round(worst, 4), message)

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
        messages, count, total = [], 0, 0
        for element, other in self.pairs.items():
            readings = [each for each in readings_with(record, element) if other not in each.elements]
            total += len(readings)
            wrong = [each for each in readings if abs(each.counters[other] - self.at) > self.within]
            count += len(wrong)
            if wrong:
                messages.append(
                    f"{handle_label(other)} was never returned to {self.at:g} before reading {handle_label(element)} "
                    f"at {describe_points(wrong, record)}"
                )
        if not total:
            return MetricResult(
                None, f"expected registered readings of {join_words(map(handle_label, self.pairs))}, got none"
            )
        return MetricResult(
            float(count),
            join_words(messages) if messages else f"the other element was at rest at {pluralize(total, 'reading')}",
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
            for _, same_point in groupby(readings, key=lambda each: each.point):
                group = list(same_point)
                values = [each.counters[handle] for each in group]
                if len(values) > 1:
                    spread = max(values) - min(values)
                    message = (
                        f"{handle_label(handle)} at {describe_points(group, record)} read from {min(values):.2f} "
                        f"to {max(values):.2f}"
                    )
                    spreads.append((round(spread, 4), message))
        if not spreads:
            return MetricResult(None, "expected two readings of an element at a point, got none")
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
            first_readings, second_readings = (
                readings_with(record, self.one, [point]),
                readings_with(record, self.other, [point]),
            )
            if second_readings:
                left = fmean(each.counters[self.one] for each in first_readings)
                right = fmean(each.counters[self.other] for each in second_readings)
                pair = f"{handle_label(self.one)} reads {left:+.3f} and {handle_label(self.other)} {right:+.3f}"
                message = f"at {describe_points(first_readings, record)} {pair}"
                sums.append((round(abs(left + right), 4), message))
        if not sums:
            return MetricResult(
                None,
                f"expected a point read with both {handle_label(self.one)} and {handle_label(self.other)}, got none",
            )
        return MetricResult(*max(sums))

    def floor(self, scenario: Scenario) -> float:
        """Return a count."""
        return 2.0 * HALF_A_COUNT
