"""Metric: a pure function of the attempt record, with options, a unit and a floor."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeVar

import msgspec

from a7sim.scenario import Scenario
from a7sim.training.action_log import Reading
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.exercise import MetricSpec

BEST_PARALLAX_UM = 2.2
"""Of one setting on vanishing y-parallax, at photo scale: the best of the organisations of 1960 (geometry.md)."""

BEST_POINTING_UM = 2.8
"""Of one monocular pointing: implied by the thesis's twenty centres (decision 4)."""

BEST_HEIGHT_UM = 2.0
"""Of one setting of the mark on the ground, as x-parallax (decision 8)."""

BEST_FIDUCIAL_UM = 7.0
"""Of a fiducial against its collimating mark (decision 8)."""

MAX_OF_SEVERAL = 2.5
"""Largest of some tens of settings, in standard deviations."""

HALF_A_COUNT = 0.005
"""mm and gon: the resolution of a counter."""


@dataclass(frozen=True)
class MetricResult:
    """Result of a metric: its value, None if there was nothing to measure, and the reason with numbers."""

    value: float | None
    reason: str


class Metric(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Metric with its options. A smaller value is better, unless `more_is_better`."""

    unit: ClassVar[str] = ""
    truth: ClassVar[bool] = False
    """Whether it uses the truth, which is not available at the link."""
    more_is_better: ClassVar[bool] = False

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the value for a record."""
        raise NotImplementedError

    def floor(self, scenario: Scenario) -> float:
        """Return the smallest achievable value, limited by the eye and the least count."""
        return 0.0

    def meets(self, value: float | None, limit: float) -> bool:
        """Return whether a value reaches a limit."""
        if value is None:
            return False
        return value >= limit - 1e-9 if self.more_is_better else value <= limit + 1e-9


MEASURES: dict[str, type[Metric]] = {}
"""All metrics by the names in exercises."""

Kind = TypeVar("Kind", bound=type[Metric])


def register_metric(name: str) -> Callable[[Kind], Kind]:
    """Register a metric under a name."""

    def register(kind: Kind) -> Kind:
        MEASURES[name] = kind
        return kind

    return register


def make_metric(spec: MetricSpec) -> Metric:
    """Return the metric of a checklist item or a criterion. Raises msgspec.ValidationError for invalid options."""
    return msgspec.convert(spec.options, MEASURES[spec.measure])


def join_words(words: Iterable[object], max_words: int = 6) -> str:
    """Return the first few words as an enumeration."""
    all_words = [str(each) for each in words]
    shown = all_words[:max_words]
    if len(all_words) > max_words:
        shown.append(f"{len(all_words) - max_words} more")
    return shown[0] if len(shown) == 1 else f"{', '.join(shown[:-1])} and {shown[-1]}" if shown else "none"


def handle_label(handle: str) -> str:
    """Return a control in the notation of the field: by', kappa", X."""
    if handle[-1:] in "12" and handle[:-1] in ("c", "kappa", "phi", "omega", "by", "bz"):
        return handle[:-1] + ("'" if handle.endswith("1") else '"')
    return handle


def readings_with(record: AttemptRecord, element: str, points: Sequence[str] = ()) -> list[Reading]:
    """Return the registrations of an element, or any, at points given by position or name, or at any point."""
    names = [record.name_of(point) for point in points]
    return [
        each
        for each in record.readings
        if (not element or element in each.elements) and (not names or each.point in names)
    ]


def describe_points(readings: Iterable[Reading], record: AttemptRecord) -> str:
    """Return the points of readings, as positions of the model if they have one."""
    positions = {name: position for position, name in record.model.standard_points.items()}
    names = list(dict.fromkeys(positions.get(each.point, each.point) for each in readings))
    return f"{'points' if len(names) > 1 else 'point'} {join_words(names)}"
