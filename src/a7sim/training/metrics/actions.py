"""Metrics of actions at the link: order, fittings, unchanged elements, time."""

import msgspec
from msgspec import field

from a7sim.operator import ModelJob
from a7sim.plotters import REQUIRED_FITTINGS
from a7sim.scenario import Scenario
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


@register_metric("out-of-order")
class ActionsOutOfOrder(Metric, frozen=True, kw_only=True):
    """Number of actions of a procedure that are missing or too early, in each of some sequences.

    Actions are written 'load 1', 'fiducials 1', 'centre 1', 'set c1', 'turn by1', 'record 3': the action, and its
    object if it matters; 'move X' is any movement of it, 'adjust by1' setting or turning it. The last action of a kind
    counts, or the first if it ends in '!'.
    """

    unit = "actions"
    chains: list[list[str]]

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        missing: list[str] = []
        early: list[str] = []
        for chain in self.chains:
            last, before = -1, ""
            for action in chain:
                index = self._action_index(record, action)
                if index is None:
                    missing.append(_action_label(action))
                elif index < last:
                    early.append(f"{_action_label(action)} (before {_action_label(before)})")
                elif index > last:
                    last, before = index, action
        messages = [f"not done: {join_words(dict.fromkeys(missing))}"] if missing else []
        messages += [f"done too early: {join_words(dict.fromkeys(early))}"] if early else []
        return MetricResult(float(len(missing) + len(early)), "; ".join(messages) or "all actions were done in order")

    def _action_index(self, record: AttemptRecord, action: str) -> int | None:
        kind, _, name = action.removesuffix("!").partition(" ")
        kinds = {"move": MOVEMENTS, "adjust": ("set", "turn")}.get(kind, (kind,))
        indices = [
            each.index
            for each in record.actions
            if each.kind in kinds and (not name or record.name_of(name) == each.name or name in (each.name, each.text))
        ]
        return (indices[0] if action.endswith("!") else indices[-1]) if indices else None


def _action_label(action: str) -> str:
    kind, _, name = action.removesuffix("!").partition(" ")
    return f"{kind} {handle_label(name)}".strip()


@register_metric("run-by-motor")
class MotorDrivenReadings(Metric, frozen=True, kw_only=True):
    """Number of registrations with a carriage that was last driven by motor rather than turned by hand."""

    unit = "registrations"
    handles: list[str]
    points: list[str] = field(default_factory=list)

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        readings = readings_with(record, "", self.points)
        if not readings:
            return MetricResult(None, "nothing was registered")
        motor_driven = [
            each for each in readings if any(self._is_motor_driven(record, each, handle) for handle in self.handles)
        ]
        message = (
            f"driven by motor at {describe_points(motor_driven, record)}" if motor_driven else "always turned by hand"
        )
        return MetricResult(float(len(motor_driven)), f"{join_words(map(handle_label, self.handles))}: {message}")

    def _is_motor_driven(self, record: AttemptRecord, reading: Reading, handle: str) -> bool:
        before = [each for each in record.actions if each.name == handle and each.index < reading.action_index]
        return bool(before) and before[-1].kind in ("drive", "set")


@register_metric("handles-moved")
class MovedElements(Metric, frozen=True, kw_only=True):
    """Number of elements that finally differ from their positions after the opening."""

    unit = "elements"
    handles: list[str]
    within: float = HALF_A_COUNT

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        moved = [handle for handle in self.handles if self._movement(record, handle) > self.within + 1e-9]
        message = f"{join_words(map(handle_label, moved))} moved" if moved else "no element moved"
        return MetricResult(float(len(moved)), message)

    def _movement(self, record: AttemptRecord, handle: str) -> float:
        actions = [each for each in record.actions if each.name == handle and each.kind in MOVEMENTS]
        if not actions:
            return 0.0
        moved = abs(actions[-1].after - actions[0].before)
        return min(moved, abs(400.0 - moved)) if handle.startswith("kappa") else moved


@register_metric("not-looked")
class UnviewedPoints(Metric, frozen=True, kw_only=True):
    """Number of points registered without a look through an eyepiece since the last change of a fitting."""

    unit = "points"
    points: list[str]

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number."""
        unviewed = []
        for point in self.points:
            readings = readings_with(record, "", [point])
            before = [each for each in record.actions if readings and each.index < readings[-1].action_index]
            looks = [each.index for each in before if each.kind == "look"]
            changes = [each.index for each in before if each.kind in ("fit", "base", "load")]
            if not readings or max(looks, default=-1) < max(changes, default=0):
                unviewed.append(point)
        message = (
            f"no look through an eyepiece after the last change of a fitting at {join_words(unviewed)}"
            if unviewed
            else "a look through an eyepiece precedes every registration"
        )
        return MetricResult(float(len(unviewed)), message)


@register_metric("minutes")
class Minutes(Metric, frozen=True, kw_only=True):
    """Minutes on the simulated clock since the start of the student's work."""

    unit = "min"

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the minutes."""
        minutes = record.seconds / 60.0
        return MetricResult(
            round(minutes, 2), f"{minutes:.1f} of {record.exercise.minutes:g} minutes on the instrument's clock"
        )


@register_metric("element-off")
class ElementDeviation(Metric, frozen=True, kw_only=True):
    """Largest final difference of elements, or counters, from their required readings."""

    unit = "mm or gon"
    wanted: dict[str, float]

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return the difference."""
        readings = {
            name: record.autograph.counter(name) if name in AXES else record.autograph.element(name)
            for name in self.wanted
        }
        name = max(self.wanted, key=lambda each: abs(readings[each] - self.wanted[each]))
        return MetricResult(
            round(abs(readings[name] - self.wanted[name]), 4),
            f"{handle_label(name)} reads {readings[name]:.2f}, required {self.wanted[name]:.2f}",
        )

    def floor(self, scenario: Scenario) -> float:
        """Return half a count."""
        return HALF_A_COUNT


@register_metric("wrong-fittings")
class WrongFittings(Metric, frozen=True, kw_only=True):
    """Number of fittings that do not fit the pictures and the base: at the end, or at the registrations of a point.

    Base and pictures as they are, unless they are named.
    """

    unit = "fittings"
    point: str = ""
    base: str = ""
    polarity: str = ""
    pictures: list[str] = field(default_factory=list)
    """Required pictures in the left and the right projector; a wrong picture counts, too."""
    by_job: bool = False
    """Whether base and pictures must be those of the exercise's model on the job sheet."""

    def evaluate(self, record: AttemptRecord) -> MetricResult:
        """Return their number; a wrong base counts."""
        if self.by_job:
            return self._for_job(record.model).evaluate(record)
        autograph = record.autograph
        fittings, base = autograph.fittings.as_words(), autograph.base_mode
        mounted = autograph.loaded(1), autograph.loaded(2)
        if self.point:
            readings = readings_with(record, "", [self.point])
            if not readings:
                return MetricResult(None, f"nothing was registered as {self.point}")
            fittings, base, mounted = dict(readings[-1].fittings), readings[-1].base, readings[-1].pictures
        polarity = self.polarity or record.model.polarity
        required = REQUIRED_FITTINGS[polarity, self.base or base].as_words()
        wrong = [
            f"{name} is {position} instead of {required[name]}"
            for name, position in fittings.items()
            if position != required[name]
        ]
        if self.base and base != self.base:
            wrong.append(f"the base is {base} instead of {self.base}")
        wrong += [
            f"projector {projector} has {picture or 'no picture'} instead of {wanted}"
            for projector, (picture, wanted) in enumerate(zip(mounted, self.pictures, strict=False), start=1)
            if picture != wanted
        ]
        case = f"{'at ' + self.point + ' ' if self.point else ''}for a {polarity} with base {self.base or base}"
        return MetricResult(float(len(wrong)), f"{case}: {join_words(wrong) if wrong else 'all correct'}")

    def _for_job(self, model: ModelJob) -> "WrongFittings":
        """Return the metric with the job sheet's requirements of a model."""
        pictures = [model.left, model.right] if model.left_projector == 1 else [model.right, model.left]
        return msgspec.structs.replace(self, base=model.base, polarity=model.polarity, pictures=pictures, by_job=False)
