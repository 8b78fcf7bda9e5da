"""Numerical relative orientation with by' and by" (thesis 3.4.2)."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, exclude
from a7sim.geometry import GON, Array
from a7sim.operator.driving.controls import wrap_gon
from a7sim.operator.driving.driver import BoolArray
from a7sim.operator.driving.job import ModelJob
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.operator_batch import AllGaveUpError
from a7sim.plotters import TILTS
from a7sim.reduction import ProjectorPose, Undetermined, element_corrections
from a7sim.reduction.hallert import REGULAR_POINTS, regular_corrections
from a7sim.standard_points import CASES, POSITIONS, determine_orientation

MAX_ROUNDS = 12
MAX_ROUGH_ROUNDS = 3
STILL_FALLING = 0.8
"""Residuals count as decreasing while their rms is below this share of the best so far."""

GROSS_MM = 0.5
"""While the rms is above this the mean is kept: it is due to the swings and omega, which are still unknown."""

OFF_PATTERN = 0.08
"""Tolerated deviation of points from the regular pattern, as a share of the height.

The next round corrects its effect.
"""

ALL_ELEMENTS = (*(f"{name}{n}" for name in ("kappa", "phi", "omega", "by", "bz", "c") for n in (1, 2)), "bx")


Value = TypeVar("Value")
"""A number of one session, or an array ``(sessions,)`` of a batch."""


@dataclass(frozen=True)
class Round(Generic[Value]):
    """Round of an orientation: the parallaxes at the points of the case, their mean, and their rms about it, mm."""

    settings: Mapping[str, Value]
    parallaxes: Mapping[str, Value]
    mean: Value
    rms: Value
    sigmas: Mapping[str, Value]
    """Standard deviations of the corrections computed from this round, gon and mm; empty without corrections."""
    over_correction: Value
    """Over-correction: multiple of the turn that clears the last point; zero if none was made."""


@dataclass(frozen=True)
class RoundBatch(Round[Array]):
    """Round of the sessions that measured in it; the last axis of arrays contains all sessions."""

    active: Indices
    """Sessions that measured in it."""
    corrected: Indices
    """Sessions whose corrections were computed from it."""

    @cached_property
    def sessions(self) -> frozenset[int]:
        """Sessions that measured in it, as a set."""
        return frozenset(self.active.tolist())

    def for_session(self, session: int) -> Round[float]:
        """Return the round of one session."""
        return Round(
            _values_of(self.settings, session),
            _without_nan(_values_of(self.parallaxes, session)),
            float(self.mean[session]),
            float(self.rms[session]),
            _values_of(self.sigmas, session) if session in self.corrected else {},
            float(self.over_correction[session]),
        )


@dataclass(frozen=True)
class OrientationRecord:
    """Orientation of a session as set: rounds, elements as the counters show them, residuals by position."""

    method: str
    case: str
    rounds: Sequence[Round[float]]
    rough_rounds: int
    elements: Mapping[str, float]
    residuals: Mapping[str, float]
    places: Mapping[str, tuple[float, float, float]]
    procedure: str = "numerical"

    @property
    def rms(self) -> float:
        """Rms in mm of the residual parallaxes at all standard points."""
        residuals = np.array(list(self.residuals.values()))
        return math.sqrt((residuals * residuals).mean())


@dataclass(frozen=True)
class OrientationRecordBatch:
    """Orientations of a batch; the last axis of arrays contains all sessions."""

    method: str
    case: str
    rounds: Sequence[RoundBatch]
    rough_rounds: npt.NDArray[np.intp]
    elements: Mapping[str, Array]
    residuals: Mapping[str, Array]
    """nan where a session has no such point."""
    places: Mapping[str, Array]
    procedure: str = "numerical"

    @property
    def rms(self) -> Array:
        """Rms ``(sessions,)`` in mm of the residual parallaxes at all standard points."""
        squares = np.square(list(self.residuals.values()))
        return np.asarray(np.sqrt(np.nansum(squares, axis=0) / np.maximum(1, (~np.isnan(squares)).sum(axis=0))))

    @cached_property
    def _lists(self) -> "_OrientationLists":
        return _OrientationLists(
            {name: each.tolist() for name, each in self.elements.items()},
            {label: each.tolist() for label, each in self.residuals.items()},
            {label: list(zip(*each.tolist(), strict=True)) for label, each in self.places.items()},
        )

    def for_session(self, session: int) -> OrientationRecord:
        """Return the orientation of one session."""
        listed = self._lists
        residuals = _without_nan(_values_of(listed.residuals, session))
        return OrientationRecord(
            self.method,
            self.case,
            [each.for_session(session) for each in self.rounds if session in each.sessions],
            int(self.rough_rounds[session]),
            _values_of(listed.elements, session),
            residuals,
            {label: places[session] for label, places in listed.places.items() if label in residuals},
            self.procedure,
        )


@dataclass(frozen=True)
class _OrientationLists:
    """Residuals at standard points and counter readings as lists by session, which are faster to index."""

    elements: Mapping[str, Sequence[float]]
    residuals: Mapping[str, Sequence[float]]
    places: Mapping[str, Sequence[tuple[float, float, float]]]


def _values_of(values: Mapping[str, Array | Sequence[float]], session: int) -> dict[str, float]:
    return {name: float(each[session]) for name, each in values.items()}


def _without_nan(values: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if not math.isnan(value)}


def unknown_elements(method: str, model: ModelJob) -> tuple[str, ...]:
    """Return the elements that a method turns.

    Independent (swing-swing): kappa', kappa", phi', phi", omega'. Dependent: kappa, phi, omega, by, bz of the projector
    with the new, right-hand photograph: the right one with base in, the left one with base out.
    """
    if method == "independent":
        return ("kappa1", "kappa2", "phi1", "phi2", "omega1")
    n = model.right_projector
    return tuple(f"{name}{n}" for name in ("kappa", "phi", "omega", "by", "bz"))


def relative_orientation(
    workstation: Workstation,
    active: Indices,
    model: ModelJob,
    method: str,
    case: str,
    readings: int,
    base: float,
    tolerated_rms: float,
) -> OrientationRecordBatch:
    """Clear the y-parallaxes of a model in rounds of measuring, computing and setting.

    Once the parallaxes of a round are no longer gross their mean is subtracted; in the dependent method, where by is an
    unknown, only for the check of convergence. When they no longer decrease, the best settings are restored and their
    mean is set on by' (dependent: on the by that was turned). Sessions whose residual parallaxes at all standard points
    then have a larger rms than tolerated, in mm, give up, and so do sessions whose prints show too few of the points.
    """
    operators, controls = workstation.operators, workstation.controls
    if not controls.has_parallax_elements:
        operators.give_up(
            active,
            f"an {controls.manual.name} has no by' and by\" to measure parallaxes with: it is oriented empirically",
        )
        raise AllGaveUpError
    done = []
    positions = {model.standard_points[label]: label for label in model.all_positions()}
    for group, points in workstation.group_by_points(active, list(positions)):
        present = [positions[point] for point in points]
        labels = [label for label in present if label in CASES[case]]
        if determine_orientation(labels):
            found = _orient_in_rounds(workstation, group, model, method, case, labels, readings, base)
            done.append(
                (
                    group,
                    assess_residuals(
                        workstation, operators.remaining(group), model, found, present, readings, tolerated_rms
                    ),
                )
            )
        else:
            operators.give_up(group, _too_few(model, case, labels))
    return merge_groups(done, method, case, operators.size, "numerical")


def _too_few(model: ModelJob, case: str, labels: Sequence[str]) -> str:
    return (
        f"{model.name}: of the points of case {case} only {', '.join(labels) or 'none'} can be used: there must be one "
        "in each of the three rows, and two or more in two of them, to orient a model"
    )


def _orient_in_rounds(
    workstation: Workstation,
    active: Indices,
    model: ModelJob,
    method: str,
    case: str,
    labels: Sequence[str],
    readings: int,
    base: float,
) -> OrientationRecordBatch:
    """Return the result of the rounds on the points at some positions, with the best settings restored."""
    operators, controls, plan = workstation.operators, workstation.controls, workstation.job.plan
    unknowns = unknown_elements(method, model)
    measured_with = {"both": (1, 2), "by1": (1,), "by2": (2,)}[plan.measure_with]
    points = [model.standard_points[label] for label in labels]
    rounds: list[RoundBatch] = []
    done, rough_rounds = np.zeros((2, operators.size), dtype=np.intp)
    best = _BestSettings(unknowns, operators.size)
    measuring = active
    while measuring.size:
        settings = expand_to_batch(controls.elements(measuring, unknowns), measuring, operators.size)
        workstation.begin_round(measuring, int(done[measuring].max()) + 1)
        seen = workstation.parallaxes(measuring, points, readings, measured_with)
        measuring = operators.remaining(measuring)
        unfused = seen.disagrees(measuring)
        fused = exclude(measuring, unfused)
        rough_rounds[unfused] += 1
        _orient_roughly(workstation, unfused, model, points, unknowns, base, seen.disagreement, rough_rounds)
        done[fused] += 1
        mean, rms = _mean_and_rms(seen.parallax_mm, fused)
        falling = fused[rms[fused] < STILL_FALLING * best.rms[fused]]
        best.keep_better(fused, settings, mean, rms)
        to_clear = seen.parallax_mm - mean if method == "independent" else seen.parallax_mm
        corrections, sigmas = compute_corrections(
            workstation, falling, model, seen.places, to_clear, unknowns, np.full(falling.size, base), labels
        )
        falling = operators.remaining(falling)
        rounds.append(
            RoundBatch(
                settings,
                dict(zip(labels, seen.parallax_mm, strict=True)),
                mean,
                rms,
                sigmas,
                np.zeros(operators.size),
                fused,
                falling,
            )
        )
        if falling.size:
            noted = operators.noted_elements(falling, settings, rounds[-2].settings if len(rounds) > 1 else {})
            controls.set_elements(falling, {n: (noted[n] + corrections[n])[falling] for n in unknowns})
        measuring = operators.remaining(np.sort(np.concatenate([falling, unfused])))
        measuring = measuring[done[measuring] < MAX_ROUNDS]
    active = operators.remaining(active)
    controls.set_if_changed(active, {name: kept[active] for name, kept in best.settings.items()})
    _set_mean_on_by(workstation, active, model, "by1" if method == "independent" else unknowns[3], best.mean)
    workstation.begin_round(active, int(done[active].max(initial=0)) + 1)
    return OrientationRecordBatch(method, case, rounds, rough_rounds, {}, {}, {})


def merge_groups(
    groups: Sequence[tuple[Indices, OrientationRecordBatch]], method: str, case: str, sessions: int, procedure: str
) -> OrientationRecordBatch:
    """Return the orientations of all groups as one batch."""
    labels = [label for label in POSITIONS if any(label in found.residuals for _, found in groups)]
    elements: dict[str, Array] = {}
    residuals = {label: np.full(sessions, np.nan) for label in labels}
    places = {label: np.full((3, sessions), np.nan) for label in labels}
    for active, found in groups:
        for name, counts in found.elements.items():
            elements.setdefault(name, np.zeros(sessions))[active] = counts[active]
        for label in found.residuals:
            residuals[label][active] = found.residuals[label][active]
            places[label][:, active] = found.places[label][:, active]
    rounds = [each for _, found in groups for each in found.rounds]
    rough = np.sum([found.rough_rounds for _, found in groups], axis=0, dtype=np.intp)
    return OrientationRecordBatch(
        method, case, rounds, np.broadcast_to(rough, sessions), elements, residuals, places, procedure
    )


class _BestSettings:
    """Best settings so far of each session."""

    def __init__(self, unknowns: Sequence[str], sessions: int) -> None:
        self.settings = {name: np.zeros(sessions) for name in unknowns}
        self.mean = np.zeros(sessions)
        self.rms = np.full(sessions, np.inf)

    def keep_better(self, active: Indices, settings: Mapping[str, Array], mean: Array, rms: Array) -> None:
        """Keep the settings where the rms is smaller than before."""
        better = active[rms[active] < self.rms[active]]
        self.mean[better], self.rms[better] = mean[better], rms[better]
        for name, kept in self.settings.items():
            kept[better] = settings[name][better]


def _mean_and_rms(p: Array, active: Indices) -> tuple[Array, Array]:
    """Return the mean parallax, zero while they are gross, and the rms about it ``(sessions,)``."""
    gross = np.sqrt(np.mean(p**2, axis=0)) > GROSS_MM
    mean = np.where(gross, 0.0, p.mean(axis=0))
    rms = np.full(p.shape[-1], np.nan)
    rms[active] = np.sqrt(np.mean((p - mean) ** 2, axis=0))[active]
    return mean, rms


def assess_residuals(
    workstation: Workstation,
    active: Indices,
    model: ModelJob,
    found: OrientationRecordBatch,
    labels: Sequence[str],
    readings: int,
    tolerated_rms: float,
) -> OrientationRecordBatch:
    """Return an orientation with the residuals at standard points; sessions beyond the tolerance give up."""
    operators = workstation.operators
    names = [model.standard_points[label] for label in labels]
    measured = workstation.controls.has_parallax_elements
    seen = (
        workstation.parallaxes(active, names, readings) if measured else workstation.look_at_parallaxes(active, names)
    )
    active = operators.remaining(active)
    unfused = seen.disagrees(active)
    operators.give_up(
        unfused, lambda session: f"{model.name}: the images of {seen.disagreement[session]} cannot be fused any more"
    )
    active = operators.remaining(active)
    present = [name for name in ALL_ELEMENTS if name in workstation.controls.manual.elements]
    orientations = replace(
        found,
        elements=expand_to_batch(workstation.controls.elements(active, present), active, operators.size),
        residuals=dict(zip(labels, seen.parallax_mm, strict=True)),
        places=dict(zip(labels, np.moveaxis(seen.places, 1, 0), strict=True)),
    )
    rms, worst = orientations.rms, np.abs(seen.parallax_mm).argmax(axis=0)
    operators.give_up(
        active[rms[active] > tolerated_rms],
        lambda session: (
            f"{model.name}: y-parallaxes of {rms[session]:.3f} mm rms remain, {tolerated_rms:.3f} tolerated; the "
            f"largest is {seen.parallax_mm[worst[session], session]:+.3f} at point {names[worst[session]]}: "
            "a point is mistaken, "
            "or the photographs do not belong together"
        ),
    )
    return orientations


def expand_to_batch(values: Mapping[str, Array], active: Indices, sessions: int) -> dict[str, Array]:
    """Return values ``(m,)`` of the active sessions as arrays of all sessions."""
    spread = {name: np.zeros(sessions) for name in values}
    for name, each in values.items():
        spread[name][active] = each
    return spread


def _set_mean_on_by(workstation: Workstation, active: Indices, model: ModelJob, by: str, mean: Array) -> None:
    if active.size:
        sense = 1.0 if model.side_of(int(by[-1])) == 1 else -1.0
        workstation.controls.set_elements(
            active, {by: workstation.controls.elements(active, [by])[by] + sense * mean[active]}
        )


def _orient_roughly(
    workstation: Workstation,
    active: Indices,
    model: ModelJob,
    points: Sequence[str],
    unknowns: Sequence[str],
    base: float,
    disagreement: npt.NDArray[np.object_],
    rough_rounds: npt.NDArray[np.intp],
) -> None:
    """Orient roughly, where images are too far apart for by, from the Y readings of each eye."""
    operators, controls = workstation.operators, workstation.controls
    operators.give_up(
        active[rough_rounds[active] > MAX_ROUGH_ROUNDS],
        lambda session: f"{model.name}: the images of {disagreement[session]} stay too far apart to be fused",
    )
    for session in operators.remaining(active):
        one = np.array([session])
        operators.remark(
            one,
            f"{model.name}: the images of {disagreement[session]} are too far apart for by: "
            "rough orientation, each eye alone",
        )
        level = float(controls.counters(one)[2, 0])
        readings = [workstation.point_monocularly(one, side, points, level) for side in (1, 2)]
        if not operators.remaining(one).size:
            continue
        left, right = (controls.frame_positions(one, each[:, :, one], np.array([level])) for each in readings)
        where_they_meet = base / (left[0] - right[0] + base)
        places, parallaxes = np.zeros((3, *left.shape[1:-1], operators.size)), np.zeros((len(points), operators.size))
        parallaxes[:, one] = (left[1] - right[1]) * where_they_meet
        places[:, :, one] = left * where_they_meet
        settings = controls.elements(one, unknowns)
        corrections, _ = compute_corrections(workstation, one, model, places, parallaxes, unknowns, np.array([base]))
        if operators.remaining(one).size:
            controls.set_elements(one, {name: settings[name] + corrections[name][one] for name in unknowns})


def compute_corrections(
    workstation: Workstation,
    active: Indices,
    model: ModelJob,
    places: Array,
    parallaxes: Array,
    unknowns: Sequence[str],
    base: Array,
    labels: Sequence[str] = (),
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return corrections and their standard deviations ``(sessions,)`` by element, gon and mm.

    Positions ``(3, n, sessions)`` and parallaxes ``(n, sessions)`` in mm, bases ``(m,)``; labels are the positions for
    the closed form. Sessions whose points do not determine the elements give up.
    """
    nothing = {name: np.zeros(workstation.operators.size) for name in unknowns}
    if not active.size:
        return nothing, nothing
    elements_by_side = [f"{name[:-1]}{model.side_of(int(name[-1]))}" for name in unknowns]
    left = projector_pose(workstation, active, model.left_projector, np.zeros(active.size))
    right = projector_pose(workstation, active, model.right_projector, base)
    workstation.compute(active)
    in_frame = places[:, :, active] * np.array([1.0, 1.0, -1.0])[:, None, None]
    try:
        solution = element_corrections(parallaxes[:, active], in_frame, left, right, elements_by_side)
    except Undetermined as undetermined:
        workstation.operators.give_up(active, f"{model.name}: {undetermined}")
        return nothing, nothing
    factors = np.array([1.0 if name[:2] in ("by", "bz") else 1.0 / GON for name in unknowns])[:, None]
    found = np.array([solution.unknowns, solution.sigmas])
    if workstation.job.plan.solution == "hallert":
        on_pattern = _on_pattern(workstation, active, labels, places[:, :, active], base)
        if on_pattern.any():
            b, d, h = _pattern(places[:, :, active[on_pattern]], base[on_pattern])
            found[:, :, on_pattern] = regular_corrections(parallaxes[:, active[on_pattern]], b, d, h, elements_by_side)
    values, sigmas = (
        expand_to_batch(dict(zip(unknowns, factors * each, strict=True)), active, workstation.operators.size)
        for each in found
    )
    return values, sigmas


def _pattern(places: Array, base: Array) -> tuple[Array, Array, Array]:
    """Return b, the mean half width d and the mean depth h ``(m,)`` of points ``(3, n, m)`` in the order of a case."""
    _, y, z = places
    rows = np.array(REGULAR_POINTS[1][: len(y)])
    return base, (rows @ y) / np.abs(rows).sum(), z.mean(axis=0)


def _on_pattern(
    workstation: Workstation, active: Indices, labels: Sequence[str], places: Array, base: Array
) -> BoolArray:
    """Return which sessions have points ``(3, n, m)`` near enough to the pattern of six or nine for the closed form."""
    if not labels:
        return np.zeros(active.size, dtype=bool)
    if "".join(labels) not in (CASES["A"], CASES["D"]):
        workstation.operators.remark(
            active,
            f"{workstation.controls.model.name}: no closed form for the points {' '.join(labels)}, so by least squares",
        )
        return np.zeros(active.size, dtype=bool)
    pattern = np.array(_pattern(places, base))
    x, y = np.array(REGULAR_POINTS)[:, : len(labels), None]
    off = np.abs(places - [x * pattern[0], y * pattern[1], np.broadcast_to(pattern[2], places[2].shape)])
    near = np.asarray((off <= OFF_PATTERN * pattern[2]).all(axis=(0, 1)))
    workstation.operators.remark(
        active[~near], f"{workstation.controls.model.name}: the points lie off the pattern, so by least squares"
    )
    return near


def projector_pose(workstation: Workstation, active: Indices, projector: int, x: Array) -> ProjectorPose:
    """Return the poses of projectors by their counters, the centres at x ``(m,)`` of the instrument frame."""
    counts = workstation.controls.elements(active, [f"{name}{projector}" for name in (*TILTS, "by", "bz")])
    omega, phi, kappa = workstation.controls.manual.tilts(counts, projector)
    by, bz = counts[f"by{projector}"], counts[f"bz{projector}"]
    return ProjectorPose(np.array([x, -by, bz]), GON * np.array([omega, phi, wrap_gon(kappa)]))
