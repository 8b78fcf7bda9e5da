"""Numerical relative orientation with by' and by" (thesis 3.4.2)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, Array
from a7sim.manual import A7
from a7sim.operator.bench import Bench, CannotFuse, given_up, wrapped
from a7sim.operator.job import ModelJob
from a7sim.reduction import Stand, Undetermined, element_corrections

MOST_ROUNDS = 12
MOST_ROUGH_ROUNDS = 3
STILL_FALLING = 0.8
"""Residuals go on falling while their rms is below this share of the best so far."""

GROSS_MM = 0.5
"""While the rms is above this the mean stays in: it comes of the swings and omega, which are still to be found."""

ALL_ELEMENTS = (*(f"{name}{n}" for name in ("kappa", "phi", "omega", "by", "bz", "c") for n in (1, 2)), "bx")


@dataclass(frozen=True)
class Round:
    """One round: the parallaxes at the points of the case, their mean, and their rms about it, mm."""

    settings: Mapping[str, float]
    parallaxes: Mapping[str, float]
    mean: float
    rms: float
    sigmas: Mapping[str, float]
    """Standard deviations of the corrections computed from this round, gon and mm; empty where none were."""


@dataclass(frozen=True)
class RelativeOrientation:
    """The orientation as set: method, case, rounds, elements as the counters show them, residuals by position."""

    method: str
    case: str
    rounds: Sequence[Round]
    rough_rounds: int
    elements: Mapping[str, float]
    residuals: Mapping[str, float]
    places: Mapping[str, tuple[float, float, float]]

    @property
    def rms(self) -> float:
        """Rms in mm of the residual parallaxes at all standard points."""
        return float(np.sqrt(np.mean(np.square(list(self.residuals.values())))))


def unknowns_of(method: str, model: ModelJob) -> tuple[str, ...]:
    """Return the elements that a method turns.

    Independent (swing-swing): kappa', kappa", phi', phi", omega'. Dependent: kappa, phi, omega, by, bz of the
    projector with the new, right-hand photograph: the right one with base in, the left one with base out.
    """
    if method == "independent":
        return ("kappa1", "kappa2", "phi1", "phi2", "omega1")
    n = model.right_projector
    return tuple(f"{name}{n}" for name in ("kappa", "phi", "omega", "by", "bz"))


def relative_orientation(
    bench: Bench, model: ModelJob, method: str, case: str, readings: int, base: float, tolerated_rms: float
) -> RelativeOrientation:
    """Clear the y-parallaxes of a model in rounds of measuring, computing and setting.

    Once the parallaxes of a round are no longer gross their mean is taken off; in the dependent method, where by is
    itself unknown, only to see whether they fall. When they no longer do, the best settings stand and their
    mean goes on by' (dependent: on the by that was turned). Raises DoesNotFit when the residual parallaxes at all
    standard points then have a larger rms than tolerated, in mm.
    """
    labels = model.points_of_case(case)
    unknowns = unknowns_of(method, model)
    points = [model.standard_points[label] for label in labels]
    rounds: list[Round] = []
    rough_rounds = best = 0
    while len(rounds) < MOST_ROUNDS:
        settings = bench.elements(unknowns)
        bench.begin_round(len(rounds) + 1)
        try:
            seen = bench.parallaxes(points, readings)
        except CannotFuse as apart:
            rough_rounds += 1
            _bring_together(bench, model, points, unknowns, base, str(apart), rough_rounds)
            continue
        gross = float(np.sqrt(np.mean(seen.p**2))) > GROSS_MM
        mean = 0.0 if gross else float(seen.p.mean())
        rms = float(np.sqrt(np.mean((seen.p - mean) ** 2)))
        rounds.append(Round(settings, dict(zip(labels, seen.p.tolist(), strict=True)), mean, rms, {}))
        falling = len(rounds) == 1 or rms < STILL_FALLING * rounds[best].rms
        if len(rounds) == 1 or rms < rounds[best].rms:
            best = len(rounds) - 1
        if not falling:
            break
        to_clear = seen.p - mean if method == "independent" else seen.p
        corrections, sigmas = _corrections(bench, model, seen.places, to_clear, unknowns, base)
        rounds[-1] = Round(settings, rounds[-1].parallaxes, mean, rms, sigmas)
        bench.set_elements({name: settings[name] + corrections[name] for name in unknowns})
    _restore(bench, rounds[best].settings)
    _set_mean_on_by(bench, model, "by1" if method == "independent" else unknowns[3], rounds[best].mean)
    bench.begin_round(len(rounds) + 1)
    everywhere = model.all_positions()
    left = bench.parallaxes([model.standard_points[label] for label in everywhere], readings)
    places = dict(zip(everywhere, zip(*left.places.tolist(), strict=True), strict=True))
    residuals = dict(zip(everywhere, left.p.tolist(), strict=True))
    orientation = RelativeOrientation(
        method, case, rounds, rough_rounds, bench.elements(ALL_ELEMENTS), residuals, places
    )
    if orientation.rms > tolerated_rms:
        worst = max(residuals, key=lambda label: abs(residuals[label]))
        raise given_up(
            bench,
            f"{model.name}: y-parallaxes of {orientation.rms:.3f} mm rms remain, {tolerated_rms:.3f} tolerated; the "
            f"largest is {residuals[worst]:+.3f} at point {model.standard_points[worst]}: a point is mistaken, or the "
            "photographs do not belong together",
        )
    return orientation


def _set_mean_on_by(bench: Bench, model: ModelJob, by: str, mean: float) -> None:
    sense = 1.0 if model.hand_of(int(by[-1])) == 1 else -1.0
    bench.set_elements({by: bench.elements([by])[by] + sense * mean})


def _restore(bench: Bench, settings: Mapping[str, float]) -> None:
    now = bench.elements(list(settings))
    changed = {name: value for name, value in settings.items() if now[name] != value}
    if changed:
        bench.set_elements(changed)


def _bring_together(
    bench: Bench,
    model: ModelJob,
    points: Sequence[str],
    unknowns: Sequence[str],
    base: float,
    apart: str,
    rough_round: int,
) -> None:
    """Orient roughly, where images are too far apart for by, from the Y readings of each eye alone."""
    if rough_round > MOST_ROUGH_ROUNDS:
        raise given_up(bench, f"{model.name}: the images of {apart} stay too far apart to be fused")
    bench.remark(f"{model.name}: the images of {apart} are too far apart for by: rough orientation, each eye alone")
    level = bench.level_now
    left, right = (bench.in_frame(bench.point_with(hand, points, level), level) for hand in (1, 2))
    where_they_meet = base / (left[0] - right[0] + base)
    parallaxes = (left[1] - right[1]) * where_they_meet
    settings = bench.elements(unknowns)
    corrections, _ = _corrections(bench, model, left * where_they_meet, parallaxes, unknowns, base)
    bench.set_elements({name: settings[name] + corrections[name] for name in unknowns})


def _corrections(
    bench: Bench, model: ModelJob, places: Array, parallaxes: Array, unknowns: Sequence[str], base: float
) -> tuple[dict[str, float], dict[str, float]]:
    """Return corrections and their standard deviations by element, gon and mm."""
    hands = [f"{name[:-1]}{model.hand_of(int(name[-1]))}" for name in unknowns]
    left, right = (_stand(bench, n, x) for n, x in ((model.left_projector, 0.0), (model.right_projector, base)))
    bench.compute()
    try:
        solution = element_corrections(parallaxes, places * [[1.0], [1.0], [-1.0]], left, right, hands)
    except Undetermined as undetermined:
        raise given_up(bench, f"{model.name}: {undetermined}") from undetermined
    factor = [1.0 if name[:2] in ("by", "bz") else 1.0 / GON for name in unknowns]
    values = {n: float(v) * f for n, v, f in zip(unknowns, solution.unknowns, factor, strict=True)}
    sigmas = {n: float(s) * f for n, s, f in zip(unknowns, solution.sigmas, factor, strict=True)}
    return values, sigmas


def _stand(bench: Bench, projector: int, x: float) -> Stand:
    """Return how a projector stands by its counters, its centre at x of the instrument frame."""
    names = [f"{name}{projector}" for name in ("omega", "phi", "kappa", "by", "bz")]
    seen = bench.elements(names)
    omega, phi, kappa, by, bz = (seen[name] - A7.elements[name].zero for name in names)
    return Stand(np.array([x, -by, bz]), GON * np.array([omega, phi, wrapped(kappa)]))
