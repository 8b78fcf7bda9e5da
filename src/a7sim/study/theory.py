"""Theoretical precision of a session: standard deviations of elements and of perspective centres.

Errors are propagated through numerical relative orientation at the plotter with n points at the positions of the plan:
least squares of parallaxes with the errors of readings, film and interior orientation; rounding of each element to its
count; the remaining mean parallax set on by. A centre from two levels has the errors of its pointings, enlarged by T0
(thesis 2.4).
"""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import GON, PARALLAX_ELEMENTS, Array, near_vertical_parallax_coefficients
from a7sim.operator import ModelJob
from a7sim.operator.procedures.relative import unknown_elements
from a7sim.plotters import LEAST_COUNT, VARIANTS
from a7sim.reduction import perspective_centre
from a7sim.reduction.least_squares import solve_least_squares
from a7sim.result_documents import Document
from a7sim.scenario import Scenario
from a7sim.scene import Scene, build_scene
from a7sim.session.lifecycle import make_job
from a7sim.session.truth import RelativePose, true_elements
from a7sim.standard_points import CASES, PLACES

ROUNDING = LEAST_COUNT / math.sqrt(12.0)
"""Standard deviation of the rounding error of a counter, uniform between two counts."""

_COUNTS = np.arange(-8, 9)
"""Number of counts around a true element that are evaluated; larger errors are uniform."""

_ELEMENT = re.compile(r"models\.(\d+)\.truth\.element_differences\.(\w+)")
_CENTRE = re.compile(r"models\.\d+\.truth\.centre_differences\.(?:left|right)\.([XYZ])0|centre_([XYZ])_error")


@dataclass(frozen=True)
class PropagatedErrors:
    """Elements that a procedure sets, and the covariance ``(5, 5)`` of their errors, gon and mm."""

    names: tuple[str, ...]
    covariance: Array

    def sd(self, name: str) -> float | None:
        """Return the standard deviation of an element, None for an element that is not set."""
        if name not in self.names:
            return None
        place = self.names.index(name)
        return math.sqrt(float(self.covariance[place, place]))


def predicted_sd(scenario: Scenario, response: str) -> float | None:
    """Return the theoretical standard deviation of a response, None without a theory.

    Theory covers `models.N.truth.element_differences.NAME`, `models.N.truth.centre_differences.SIDE.X0`, and
    `centre_X_error`, an rms, for its quadratic mean.
    """
    plan = scenario.plotting
    if plan is None or "plotter" not in scenario.work or not VARIANTS[scenario.instrument.variant].elements.get("by1"):
        return None
    if (found := _ELEMENT.fullmatch(response)) and plan.procedure == "numerical":
        number = int(found[1])
        return element_errors(scenario, number).sd(found[2]) if number < len(scenario.models) else None
    if (found := _CENTRE.fullmatch(response)) and plan.centre_method == "two levels":
        return centre_sds(scenario)["XYZ".index(found[1] or found[2])]
    return None


def theory_limits(scenario: Scenario) -> Sequence[str]:
    """Return the parts of a scenario that the theory leaves out, as text; empty if the theory is complete."""
    film, observer = scenario.film, scenario.observer
    left_out = {
        "film that shrinks unevenly": film.shrinkage_sigma_ppm or film.shear_sigma_ppm,
        "faults of the instrument": scenario.instrument.condition != type(scenario.instrument)().condition,
        "slips, and what is read again because of them": observer.blunder_rate or observer.last_digit_slip,
        "tiring": observer.fatigue_per_hour or observer.warm_up,
    }
    return [name for name, present in left_out.items() if present]


def theory_comparison(scenario: Scenario, response: str, mean: float, sd: float) -> Document:
    """Return the theoretical precision of a response and the ratio of the simulated one to it.

    Empty without a theory.
    """
    predicted = predicted_sd(scenario, response)
    if predicted is None:
        return {}
    simulated = math.hypot(mean, sd) if response.endswith("_error") else sd
    return {"theory": predicted, "ratio": simulated / predicted if predicted > 0.0 else math.nan}


def theory_sentence(document: Document, scenarios: Sequence[Scenario]) -> Document:
    """Return the sentence on theory in a study's document; empty without a theory."""
    if not any("theory" in each for cell in document["cells"] for each in cell["responses"].values()):
        return {}
    left_out = dict.fromkeys(name for scenario in scenarios for name in theory_limits(scenario))
    less = f" It leaves out {', '.join(left_out)}, so that more is to be expected." if left_out else ""
    return {"theory": f"Theory: the standard deviation (of an rms: the quadratic mean) that is propagated.{less}"}


# --- elements of relative orientation ---------------------------------------------------------------------------------


def element_errors(scenario: Scenario, number: int) -> PropagatedErrors:
    """Return the precision of the elements of a model after the procedure of the plan, as set.

    In the first model the position of a true element between two counts is known, and so the probability of each
    setting; elsewhere, and for elements that may take up the mean parallax, the position is uniform. Raises
    Undetermined as `element_corrections` does.
    """
    plan = scenario.plan
    scene = build_scene(scenario, scenario.seed)
    model = make_job(scenario, scene).models[number]
    names = unknown_elements(plan.method, model)
    design = _design(scenario, model, names)
    n = len(design)
    anew, lasting = reading_sd(scenario) ** 2, _lasting(scenario)
    solution = solve_least_squares(design, np.zeros(n)).cofactors @ design.T
    errors = solution @ (lasting + anew * np.eye(n)) @ solution.T
    to_mean = solution @ np.ones(n)
    units = np.array([1.0 if name[:2] in ("by", "bz") else GON for name in names])
    of_counts = _set_to_counts(np.sqrt(np.diag(errors)) / units, _fractions(scenario, scene, number, names, to_mean))
    gains, spreads = of_counts[0], of_counts[1] * units**2
    by_mean = np.eye(len(names)) - np.outer(to_mean, design.mean(axis=0))
    covariance = by_mean @ (np.outer(gains, gains) * errors + np.diag(spreads)) @ by_mean.T
    covariance += (lasting.mean() + anew / n + ROUNDING**2) * np.outer(to_mean, to_mean)
    with_mean = np.outer(by_mean @ (gains * (solution @ lasting.mean(axis=0))), to_mean)
    return PropagatedErrors(names, (covariance + with_mean + with_mean.T) / np.outer(units, units))


def _set_to_counts(sds: Array, fractions: Array) -> Array:
    """Return the gains and the variances ``(2, m)`` due to counts; nan marks an unknown fraction."""
    found = [
        (1.0, ROUNDING**2) if math.isnan(f) else quantised_error(f, sd) for f, sd in zip(fractions, sds, strict=True)
    ]
    return np.array([[gain for gain, _ in found], [added for _, added in found]])


def quantised_error(fraction: float, sd: float) -> tuple[float, float]:
    """Return gain and added variance of the error of an element that is set to a count.

    The error is multiplied by the gain, and an error with the added variance, uncorrelated with all others, is added
    (Bussgang). The fraction counts from the count below the true element; `sd` is the standard deviation of the error.
    """
    if sd > LEAST_COUNT:
        return 1.0, ROUNDING**2
    from scipy.stats import norm  # noqa: PLC0415

    spread = max(sd / LEAST_COUNT, 1e-9)
    edges = (np.append(_COUNTS - 0.5, _COUNTS[-1] + 0.5) - fraction) / spread
    shares, slopes = np.diff(norm.cdf(edges)), -np.diff(norm.pdf(edges))
    mean = float(shares @ _COUNTS)
    gain = float(slopes @ _COUNTS) / spread
    return gain, max(0.0, LEAST_COUNT**2 * float(shares @ (_COUNTS - mean) ** 2) - (gain * sd) ** 2)


def reading_sd(scenario: Scenario) -> float:
    """Return the standard deviation in mm of the mean of the readings of one y-parallax, including their counter."""
    plan = scenario.plan
    readings = plan.parallax_readings * (2 if plan.measure_with == "both" else 1)
    enlargement = 1e-3 * plan.projection_height / scenario.camera.c
    return math.hypot(scenario.observer.parallax_um * enlargement, ROUNDING) / math.sqrt(readings)


def _lasting(scenario: Scenario) -> Array:
    """Return the covariance ``(n, n)`` in mm^2 of the parallax errors that repeated readings do not reduce.

    Its sources are the film at the points, and centring, swing and scale of the pictures by their fiducials.
    """
    plan, film, camera = scenario.plan, scenario.film, scenario.camera
    x, y, z = _places(scenario)
    fiducials = np.array([(each.x, each.y) for each in camera.fiducials]) - camera.principal_point
    mark = 1e-3 * scenario.observer.fiducial_um
    centring, swing = mark / math.sqrt(len(fiducials)), mark / float(np.linalg.norm(fiducials))
    c_of_film = camera.c * (1.0 - 5e-7 * sum(film.shrinkage_ppm))
    gain, added = quantised_error(c_of_film / LEAST_COUNT % 1.0, camera.c * swing)
    of_c = math.sqrt((gain * camera.c * swing) ** 2 + added)
    constant, enlarged = np.full_like(x, z / camera.c), y / camera.c
    whole = [(constant, centring), (constant, centring), (x, swing), (x - plan.bx, swing), (enlarged, of_c)]
    parts = np.array([sd * column for column, sd in [*whole, (enlarged, of_c)]])
    of_points = 2.0 * (1e-3 * z / camera.c) ** 2 * (film.irregular_um**2 + film.identification_um**2)
    return np.asarray(parts.T @ parts + of_points * np.eye(x.size))


def _places(scenario: Scenario) -> tuple[Array, Array, float]:
    """Return x and y ``(n,)`` of the points of the plan, and their depth, mm in the model."""
    plan = scenario.plan
    x, y = np.array([PLACES[label] for label in CASES[plan.case]]).T
    return x * plan.bx, y * plan.half_width * plan.projection_height / scenario.camera.c, plan.projection_height


def _design(scenario: Scenario, model: ModelJob, names: Sequence[str]) -> Array:
    """Return the coefficients ``(n, 5)`` of thesis 2.32 at the points of the plan."""
    x, y, z = _places(scenario)
    every = near_vertical_parallax_coefficients(x, y, z, scenario.plan.bx)
    hands = [f"{name[:-1]}{model.side_of(int(name[-1]))}" for name in names]
    return np.asarray(every[[PARALLAX_ELEMENTS.index(hand) for hand in hands]].T)


def _fractions(scenario: Scenario, scene: Scene, number: int, names: Sequence[str], to_mean: Array) -> Array:
    """Return the fraction of a count at each true element, nan if it depends on earlier settings."""
    truth = scene.relative_truth(scenario.models[number])
    if truth is None or number > 0:
        return np.full(len(names), np.nan)
    variant = VARIANTS[scenario.instrument.variant]
    counters = {name: element.zero for name, element in variant.elements.items()} | {"bx": scenario.plan.bx}
    zeros = {name: np.array([shown]) for name, shown in counters.items()}
    model = make_job(scenario, scene).models[number]
    true = true_elements(RelativePose.from_truth(truth).batch(), scenario.plan.method, zeros, model, variant)
    taking_the_mean = np.abs(to_mean) > 1e-6 * np.abs(to_mean).max()
    return np.where(taking_the_mean, np.nan, [true[name][0] / LEAST_COUNT % 1.0 for name in names])


# --- perspective centres ----------------------------------------------------------------------------------------------


def centre_sds(scenario: Scenario) -> tuple[float, float, float]:
    """Return the standard deviations of X0, Y0 and Z0 from two levels, in counter units.

    Each pointing has the error of the observer and of its counter; an equation of thesis 2.4 contains them multiplied
    by T0 and T0 - 1.
    """
    plan = scenario.plan
    variant = VARIANTS[scenario.instrument.variant]
    gear = plan.height_gear
    units = variant.height_gears[gear].units_per_mm if isinstance(gear, str) else gear
    levels = np.array(plan.centre_levels)
    depths = plan.projection_height - (levels - plan.preset[2]) / units
    places = np.array([PLACES[label] for label in CASES["A"]]).T
    rays = np.array([places[0] * plan.bx / plan.projection_height, places[1] * plan.half_width / scenario.camera.c])
    found = perspective_centre(rays * depths[0], rays * depths[1], float(levels[0]), float(levels[1]))
    shift = rays * (depths[1] - depths[0])
    rest = np.zeros_like(shift[0])
    design = np.concatenate(
        [
            np.array([rest + 1.0, rest, rest, -shift[0]]),
            np.array([rest, rest + 1.0, rest, -shift[1]]),
            np.array([rest, rest, rest + 1.0, rest - (levels[1] - levels[0])]),
        ],
        axis=1,
    ).T
    inverse = np.linalg.pinv(design)[:, : 2 * rest.size]
    low, high = np.hypot(1e-3 * scenario.observer.monocular_um * depths / scenario.camera.c, ROUNDING)
    T0 = float(found.T0)
    equation = math.hypot((T0 - 1.0) * low, T0 * high)
    x, y, z = equation * np.sqrt((inverse**2).sum(axis=1))[:3]
    return float(x), float(y), float(z)
