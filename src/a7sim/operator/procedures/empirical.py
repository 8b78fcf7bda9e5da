"""Empirical relative orientation: the y-parallax is cleared at one point after the other, each with one element.

One-projector (dependent): by, kappa, bz, phi, omega of the projector with the new photograph at 2, 1, 4, 3, 6.
Swing-swing (independent): kappa', kappa", phi', phi", omega. Each of the first four points is cleared with an element
that leaves the earlier points clear. At the last point a turn of omega alone that clears it is too small, because the
other four elements have absorbed part of omega; it is multiplied by n, the over-correction (geometry.md, Observation
errors), and the four points are cleared again.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from a7sim.batch import Indices, exclude
from a7sim.geometry import GON, PARALLAX_ELEMENTS, Array, parallax_coefficients, rotation
from a7sim.operator.driving.job import ModelJob
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.procedures.relative import (
    OrientationRecordBatch,
    RoundBatch,
    assess_residuals,
    expand_to_batch,
    merge_groups,
    projector_pose,
    unknown_elements,
)
from a7sim.reduction import ProjectorPose
from a7sim.standard_points import CASES, FIGURE_4_1, PLACES, POSITIONS

MAX_ROUNDS = 15
MAX_PASSES = 5
"""Passes over the first four points in a round."""

VISIBLE_SIGMAS = 2.5
"""A parallax smaller than this number of standard deviations of one setting is not visible."""

VISIBLE_SIGMAS_AT_LAST = 2.0 * 6.0**0.5
"""At the last point the errors of all five add up: twice those of 1 and 2, or of 2, once the others'."""

MAX_OVER_CORRECTION = 10.0
"""Above it the last point hardly determines omega."""

TRIES = 4
"""Attempts at a point whose images are too far apart, or separate during a long turn."""


@dataclass(frozen=True)
class ClearingStep:
    """Position (thesis fig. 4.1) and the element that clears its parallax."""

    position: str
    element: str


def over_correction(z: Array, d: Array) -> Array:
    """Return the factor n of the turn of omega that clears the last point, by z and d = |y| in mm.

    Over flat ground with points 1 to 4 clear, an error w of omega leaves ``2 w d^2 / z`` at the last point, and omega
    alone changes that by ``w z (1 + d^2 / z^2)`` (T 2.32).
    """
    return np.asarray((1.0 + (z / d) ** 2) / 2.0)


def over_correction_by_coefficients(coefficients: Array) -> Array:
    """Return the same for any five points, from the coefficients ``(5, 5, ...)`` of five elements (rows) at them.

    The last element's own coefficient at the last point, divided by its remainder when the other four elements keep the
    other four points clear. nan where they cannot.
    """
    first = np.moveaxis(coefficients[:4, :4], (0, 1), (-1, -2))
    by_last = np.moveaxis(coefficients[4, :4], 0, -1)[..., None]
    determined = np.linalg.cond(first) < 1e6
    first = np.where(determined[..., None, None], first, np.eye(4))
    following = np.moveaxis(-np.linalg.solve(first, by_last)[..., 0], -1, 0)
    own = coefficients[4, 4]
    left = own + (coefficients[:4, 4] * following).sum(axis=0)
    return np.asarray(np.where(determined & (left != 0.0), own / np.where(left == 0.0, 1.0, left), np.nan))


def clearing_coefficients(points: Array, left: ProjectorPose, right: ProjectorPose) -> Array:
    """Return the coefficients ``(10, n, m)`` of the elements in the y-parallax at points ``(3, n, m)``.

    The elements are in the order of PARALLAX_ELEMENTS. The coefficients, in mm per radian or mm per mm, are valid for
    any tilt. They are those of the parallax that is visible when the mark has followed in height: T 2.32 minus the
    share of the x-parallax where the base is inclined. The parallax is ``b . (r1 x r2) / (x1 z2 - z1 x2)`` with the
    rays r1 and r2 to the point.
    """
    r1, r2 = points - left.centre[:, None], points - right.centre[:, None]
    base = np.broadcast_to((right.centre - left.centre)[:, None], points.shape)
    across = r1[0] * r2[2] - r1[2] * r2[0]
    normal = np.cross(r1, r2, axis=0) / across
    sides = ((left, r1, np.cross(r2, base, axis=0) / across), (right, r2, np.cross(base, r1, axis=0) / across))
    rows: dict[str, Array] = {"by1": normal[1], "by2": -normal[1], "bz1": -normal[2], "bz2": normal[2]}
    for side, (stand, ray, lever) in enumerate(sides, start=1):
        omega, phi, kappa = stand.angles
        axes = {
            "kappa": rotation(omega, phi, kappa)[:, 2],
            "phi": rotation(omega, np.zeros_like(omega), np.zeros_like(omega))[:, 1],
            "omega": np.broadcast_to(np.array([1.0, 0.0, 0.0])[:, None], stand.angles.shape),
        }
        for name, axis in axes.items():
            turned = np.cross(np.broadcast_to(axis[:, None], ray.shape), ray, axis=0)
            rows[f"{name}{side}"] = (turned * lever).sum(axis=0)
    return np.array([rows[name] for name in PARALLAX_ELEMENTS])


def clearing_steps(method: str, model: ModelJob, usable: Sequence[str]) -> tuple[ClearingStep, ...] | None:
    """Return the clearing steps for the usable positions; None if they do not suffice.

    Two points on the base line, two in one outer row and one in the other, as near the corners as possible: with 6
    missing omega is turned at 5, with 3 or 4 missing the rows are exchanged.
    """
    top, base, bottom = (_ends(row, usable) for row in FIGURE_4_1)
    pair, last = (top, bottom) if _has_half_a_base(top) else (bottom, top)
    if base is None or pair is None or last is None or not (_has_half_a_base(base) and _has_half_a_base(pair)):
        return None
    left, right, n = model.left_projector, model.right_projector, model.right_projector
    if method == "dependent":
        return (
            ClearingStep(base[1], f"by{n}"),
            ClearingStep(base[0], f"kappa{n}"),
            ClearingStep(pair[1], f"bz{n}"),
            ClearingStep(pair[0], f"phi{n}"),
            ClearingStep(last[1], f"omega{n}"),
        )
    first = sorted(
        [ClearingStep(base[1], f"kappa{left}"), ClearingStep(base[0], f"kappa{right}")], key=lambda step: step.element
    )
    second = sorted(
        [ClearingStep(pair[1], f"phi{left}"), ClearingStep(pair[0], f"phi{right}")], key=lambda step: step.element
    )
    return (*first, *second, ClearingStep(last[1], "omega1"))


def _ends(row: str, usable: Sequence[str]) -> tuple[str, str] | None:
    present = [label for label in row if label in usable]
    return (present[0], present[-1]) if present else None


def _has_half_a_base(ends: tuple[str, str] | None) -> bool:
    """Return whether two points are half a base apart or more."""
    return ends is not None and PLACES[ends[1]][0] - PLACES[ends[0]][0] >= 0.5


def perturb_elements(workstation: Workstation, active: Indices, model: ModelJob, method: str, most: float) -> None:
    """Perturb the elements that a method turns by up to a limit in gon, equally on both sides.

    A component of the base is perturbed by the length that tilts the base by that angle.
    """
    unknowns = unknown_elements(method, model)
    shares = np.vectorize(math.erf)(workstation.operators.draw_setting_errors(active, 0.5**0.5, (len(unknowns),)))
    now = workstation.controls.elements(active, unknowns)
    base = np.abs(workstation.controls.bx(active)) * GON
    workstation.operators.remark(active, f"{model.name}: elements set off by up to {most:g} gon, for practice")
    workstation.controls.set_elements(
        active,
        {
            name: now[name] + most * share[active] * (base if name.startswith("b") else 1.0)
            for name, share in zip(unknowns, shares, strict=True)
        },
    )


def empirical_orientation(
    workstation: Workstation,
    active: Indices,
    model: ModelJob,
    method: str,
    case: str,
    over_corrected: str | float,
    readings: int,
    tolerated_rms: float,
) -> OrientationRecordBatch:
    """Clear the y-parallaxes of a model point by point, in rounds, until the last point stays clear.

    In a round the first four points are cleared until they appear clear; then omega is turned at the last one by n
    times the clearing turn, n 'computed' from the positions of the points or given. Points that are not pricked on both
    prints, or whose images cannot be fused, are left out if others of the case suffice. Sessions whose residual
    parallaxes at all standard points finally have a larger rms than tolerated, in mm, give up.
    """
    operators = workstation.operators
    labels = model.points_of_case(case)
    waiting = _group_by_missing(workstation, active, model, labels)
    done: list[tuple[Indices, OrientationRecordBatch]] = []
    while waiting:
        missing, group = waiting.popitem()
        usable = [label for label in labels if label not in missing]
        steps = clearing_steps(method, model, usable)
        if steps is None:
            operators.give_up(group, _too_few(model, missing))
            continue
        clearing = _Clearing(workstation, model, steps, _checks(usable, steps), over_corrected)
        ended = clearing.run(group)
        for lost, label in clearing.lost:
            waiting[missing | {label}] = np.union1d(waiting.get(missing | {label}, lost), lost)
        found = OrientationRecordBatch(method, case, clearing.rounds, clearing.rough, {}, {}, {}, "empirical")
        done.append((ended, _assess_group(workstation, ended, model, found, missing, readings, tolerated_rms)))
    return merge_groups(done, method, case, operators.size, "empirical")


def _checks(usable: Sequence[str], steps: Sequence[ClearingStep]) -> list[str]:
    """Return the positions of case A that are not needed."""
    return [label for label in usable if label in CASES["A"] and label not in {step.position for step in steps}]


def _assess_group(
    workstation: Workstation,
    active: Indices,
    model: ModelJob,
    found: OrientationRecordBatch,
    missing: frozenset[str],
    readings: int,
    tolerated_rms: float,
) -> OrientationRecordBatch:
    if not active.size:
        return found
    workstation.begin_round(active, len(found.rounds) + 1)
    present = [label for label in model.all_positions() if label not in missing]
    present = [label for label in present if workstation.has_point(active, model.standard_points[label]).all()]
    return assess_residuals(workstation, active, model, found, present, readings, tolerated_rms)


def _group_by_missing(
    workstation: Workstation, active: Indices, model: ModelJob, labels: Sequence[str]
) -> dict[frozenset[str], Indices]:
    """Return the sessions by the positions that are not in their model, or not pricked on both prints."""
    absent = frozenset(CASES["A"]) - frozenset(labels)
    pricked = {label: workstation.has_point(active, model.standard_points[label]) for label in labels}
    groups: dict[frozenset[str], list[int]] = {}
    for i, session in enumerate(active):
        missing = absent | {label for label, present in pricked.items() if not present[i]}
        groups.setdefault(missing, []).append(int(session))
    return {missing: np.array(sessions, dtype=np.intp) for missing, sessions in groups.items()}


def _too_few(model: ModelJob, missing: frozenset[str]) -> str:
    return (
        f"{model.name}: {', '.join(sorted(missing))} of the standard points cannot be used: there must be two points "
        "on the base line, two in one of the outer rows and one in the other to clear a model"
    )


@dataclass(frozen=True)
class _ClearingTurn:
    """Turn of an element that cleared a point."""

    sessions: Indices
    """Sessions in which the point was cleared."""
    element_change: Array
    """Change of the element ``(sessions,)``, gon or mm; zero where the point was clear or was not cleared."""


class _Clearing:
    """Rounds of the sessions that use the same elements at the same points."""

    def __init__(
        self,
        workstation: Workstation,
        model: ModelJob,
        steps: Sequence[ClearingStep],
        checks: Sequence[str],
        over_corrected: str | float,
    ) -> None:
        self.workstation = workstation
        self.operators = workstation.operators
        self.model = model
        self.steps = steps
        self.checks = checks
        self.rounds: list[RoundBatch] = []
        self.rough = np.zeros(self.operators.size, dtype=np.intp)
        self.lost: list[tuple[Indices, str]] = []
        """Sessions that could not fuse the images, and the position."""
        self._over_corrected = over_corrected
        self._found = {label: np.full(self.operators.size, np.nan) for label in self._labels()}
        self._positions = np.zeros((3, len(steps), self.operators.size))
        acuity = (
            1e-3 * self.operators.observer.parallax_um * workstation.job.plan.projection_height / workstation.controls.c
        )
        self._visible = max(acuity, workstation.pointing.finest_mm)

    def run(self, active: Indices) -> Indices:
        """Run rounds until the last point is clear; return the sessions that finished."""
        ended = active[:0]
        while active.size:
            self.workstation.begin_round(active, len(self.rounds) + 1)
            settings = expand_to_batch(
                self.workstation.controls.elements(active, self._elements()), active, self.operators.size
            )
            active = self._clear_first_four(active)
            if not active.size:
                break
            self._look_at_checks(active)
            active, turning, n = self._over_correct(active)
            self._close_round(active, turning, settings, n)
            if len(self.rounds) == MAX_ROUNDS:
                ended = np.union1d(ended, self._clear_first_four(turning))
                turning = turning[:0]
            ended = np.union1d(ended, exclude(active, np.flatnonzero(n)))
            active = self._remaining(turning)
        return self._remaining(ended)

    def _labels(self) -> list[str]:
        used = {*(step.position for step in self.steps), *self.checks}
        return [label for label in POSITIONS if label in used]

    def _elements(self) -> list[str]:
        return [step.element for step in self.steps]

    def _remaining(self, active: Indices) -> Indices:
        active = self.operators.remaining(np.asarray(active, dtype=np.intp))
        for lost, _ in self.lost:
            active = exclude(active, lost)
        return active

    # --- a round --------------------------------------------------------------------------------------

    def _clear_first_four(self, active: Indices) -> Indices:
        """Clear the points repeatedly until each appears clear on arrival."""
        clearing = active
        for _ in range(MAX_PASSES):
            again = clearing[:0]
            for index, step in enumerate(self.steps[:4]):
                cleared = self._clear(self._remaining(clearing), index, step).sessions
                seen = np.abs(self._found[step.position][cleared])
                again = np.union1d(again, cleared[seen > VISIBLE_SIGMAS * self._visible])
            clearing = self._remaining(again)
            if not clearing.size:
                break
        return self._remaining(active)

    def _over_correct(self, active: Indices) -> tuple[Indices, Indices, Array]:
        """Turn omega by n times the clearing turn; return the sessions at the point, those that turned, and n."""
        controls, step, threshold = self.workstation.controls, self.steps[-1], VISIBLE_SIGMAS_AT_LAST * self._visible
        n = np.zeros(self.operators.size)
        cleared = self._clear(active, len(self.steps) - 1, step, threshold)
        active, turn = cleared.sessions, cleared.element_change
        turning = active[turn[active] != 0.0]
        if turning.size:
            n[turning] = self._over_correction_factor(turning)
            turning = self._remaining(turning)
            stands = controls.exact_values(turning, [step.element])[step.element]
            controls.turn_elements(turning, {step.element: stands + ((n - 1.0) * turn)[turning]})
        return self._remaining(active), self._remaining(turning), n

    def _over_correction_factor(self, active: Indices) -> Array:
        """Return the over-correction ``(m,)``: as given, or from the positions of the five points."""
        if not isinstance(self._over_corrected, str):
            return np.full(active.size, float(self._over_corrected))
        n = over_correction_by_coefficients(self._coefficients(active))
        hopeless = ~((n > 0.0) & (n < MAX_OVER_CORRECTION))
        self.operators.give_up(
            active[hopeless],
            f"{self.model.name}: the heights of the points leave omega open: what {self.steps[-1].element} does at "
            f"{self.steps[-1].position} the other elements take up again (critical surface)",
        )
        return np.where(hopeless, 0.0, n)

    def _look_at_checks(self, active: Indices) -> None:
        for label in self.checks:
            seen = self.workstation.look_at_parallaxes(active, [self.model.standard_points[label]])
            looking = self.operators.remaining(active)
            unfused = seen.disagrees(looking)
            self._found[label][looking] = seen.parallax_mm[0, looking]
            self._found[label][unfused] = np.nan

    def _close_round(self, active: Indices, turning: Indices, settings: Mapping[str, Array], n: Array) -> None:
        parallaxes = {label: p.copy() for label, p in self._found.items()}
        squares = np.square(list(parallaxes.values()))
        rms = np.sqrt(np.nansum(squares, axis=0) / np.maximum(1, (~np.isnan(squares)).sum(axis=0)))
        nothing = np.zeros(self.operators.size)
        self.rounds.append(RoundBatch(settings, parallaxes, nothing, rms, {}, n, active, turning))

    # --- a point --------------------------------------------------------------------------------------

    def _clear(self, active: Indices, index: int, step: ClearingStep, unless_within: float = 0.0) -> "_ClearingTurn":
        """Clear a point, fusing its images first if they are too far apart."""
        point, cleared, parted = self.model.standard_points[step.position], active[:0], active[:0]
        turn = np.zeros(self.operators.size)
        for tries_left in reversed(range(TRIES)):
            if not active.size:
                break
            done = self.workstation.clear_parallax(
                active, point, step.element, partial(self._gain, step.element), unless_within
            )
            self._found[step.position][done.sessions] = done.arrival_parallax_mm[done.sessions]
            self._positions[:, index, done.sessions] = done.model_position_mm[:, done.sessions]
            turn[done.sessions] = done.element_change[done.sessions]
            cleared = np.union1d(cleared, done.sessions)
            active = exclude(self.operators.remaining(active), done.sessions)
            parted = exclude(active, done.disagreement)
            if tries_left:
                for session in np.intersect1d(active, done.disagreement):
                    self._set_by_each_eye(np.array([session]), point, step)
                active = self.operators.remaining(active)
        self.operators.give_up(
            self.operators.remaining(parted),
            f"{self.model.name}: {point} cannot be cleared with {step.element}: that comes to its end, or images part",
        )
        active = self.operators.remaining(active)
        if active.size:
            self.operators.remark(active, f"{self.model.name}: the images of {point} cannot be fused: done without it")
            self.lost.append((active, step.position))
        return _ClearingTurn(self.operators.remaining(np.asarray(cleared, dtype=np.intp)), turn)

    def _set_by_each_eye(self, one: Indices, point: str, step: ClearingStep) -> None:
        """Turn an element by the difference of the Y readings of both eyes."""
        workstation, controls, element = self.workstation, self.workstation.controls, step.element
        self.rough[one] += 1
        self.operators.remark(
            one, f"{self.model.name}: the images of {point} are too far apart: {element} by each eye alone"
        )
        level = float(controls.counters(one)[2, 0])
        readings = [workstation.point_monocularly(one, side, [point], level) for side in (1, 2)]
        if not self.operators.remaining(one).size:
            return
        left, right = (controls.frame_positions(one, each[:, :, one], np.array([level]))[:, 0] for each in readings)
        base = controls.bx(one)
        place = left * base / (left[0] - right[0] + base)
        parallax = (left[1] - right[1]) * base / (left[0] - right[0] + base)
        limits = controls.manual.elements[element]
        wanted = controls.elements(one, [element])[element] - parallax / self._gain(element, one, place)
        controls.set_elements(one, {element: wanted if limits.endless else np.clip(wanted, limits.low, limits.high)})

    # --- coefficients ---------------------------------------------------------------------------------

    def _element_by_side(self, element: str) -> str:
        return f"{element[:-1]}{self.model.side_of(int(element[-1]))}"

    def _gain(self, element: str, active: Indices, place: Array) -> Array:
        """Return the change of the parallax ``(m,)`` by one unit of an element's counter at positions ``(3, m)``, mm.

        Before the mark follows in height.
        """
        left, right = self._poses(active)
        point = _in_frame(place)
        row = PARALLAX_ELEMENTS.index(self._element_by_side(element))
        coefficients = parallax_coefficients(point, point, left.centre, right.centre, left.angles, right.angles)[row]
        return np.asarray(coefficients * (1.0 if element.startswith("b") else GON))

    def _coefficients(self, active: Indices) -> Array:
        """Return the coefficients of the five elements at the five points ``(5, 5, m)``, mm per radian or mm per mm."""
        rows = [PARALLAX_ELEMENTS.index(self._element_by_side(name)) for name in self._elements()]
        return clearing_coefficients(_in_frame(self._positions[:, :, active]), *self._poses(active))[rows]

    def _poses(self, active: Indices) -> tuple[ProjectorPose, ProjectorPose]:
        model = self.model
        return (
            projector_pose(self.workstation, active, model.left_projector, np.zeros(active.size)),
            projector_pose(self.workstation, active, model.right_projector, self.workstation.controls.bx(active)),
        )


def _in_frame(places: Array) -> Array:
    """Return positions ``(3, ...)``, z downward, with Z upward."""
    return np.array([places[0], places[1], -places[2]])
