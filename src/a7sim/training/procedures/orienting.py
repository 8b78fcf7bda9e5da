"""Procedures of orienting a model: clearing, computing, perspective centres."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from a7sim.geometry import Array
from a7sim.operator.driving.controls import side_name
from a7sim.operator.driving.workstation import Parallaxes
from a7sim.operator.procedures.centres import centre_of, observe_centre
from a7sim.operator.procedures.empirical import empirical_orientation
from a7sim.operator.procedures.models import orient_model
from a7sim.operator.procedures.relative import compute_corrections, unknown_elements
from a7sim.standard_points import CASES
from a7sim.training.attempt_record import ANSWER
from a7sim.training.procedures.base import ProcedureContext, misplace_fittings, perturb_elements, procedure

INDEPENDENT = "independent"


@procedure("clear the model")
def clear_the_model(
    context: ProcedureContext,
    method: str = INDEPENDENT,
    over_correction: float | str = "computed",
    case: str = "A",
    names_missing: bool = False,
    missing: str = "",
) -> None:
    """Clear the y-parallaxes point by point, registering each element at the point that it cleared.

    With `names_missing` the operator answers which of the points 1 to 6 do not exist, or by mistake `missing`.
    """
    context.take_over()
    context.begin("relative orientation")
    workstation = context.workstation
    if names_missing:
        absent = sorted(set(CASES["A"]) - set(context.model.points_of_case("A")))
        context.person.note(f"{ANSWER}missing={missing or ','.join(absent)}")
    empirical_orientation(
        workstation,
        workstation.operators.active,
        context.model,
        method,
        case,
        over_correction,
        1,
        workstation.job.tolerated_parallax_mm,
    )


@procedure("numerical orientation")
def numerical_orientation(
    context: ProcedureContext,
    cases: str = "AE",
    readings: int = 3,
    sense: float = 1.0,
    slip_gon: float = 0.0,
    mean_on_by: Literal["in the end", "at once", "never"] = "in the end",
) -> None:
    """Measure, compute, answer and set in one case after the other; then set the remaining mean on by'.

    `sense` is the sign with which the corrections are set, `slip_gon` the error of the sum for phi'.
    """
    context.take_over()
    workstation, model = context.workstation, context.model
    active, unknowns = workstation.operators.active, unknown_elements(INDEPENDENT, model)
    for number, case in enumerate(cases, start=1):
        context.begin(f"relative orientation, case {case}")
        workstation.begin_round(active, number)
        settings = workstation.controls.elements(active, unknowns)
        labels = model.points_of_case(case)
        parallaxes = _measure_parallaxes(context, case, readings)
        mean = parallaxes.parallax_mm.mean(axis=0)
        base = np.full(active.size, workstation.job.plan.bx)
        corrections, _ = compute_corrections(
            workstation, active, model, parallaxes.places, parallaxes.parallax_mm - mean, unknowns, base, labels
        )
        corrections["phi1"] = corrections["phi1"] + slip_gon
        context.answer({f"{case.lower()}-{name}": float(corrections[name][0]) for name in unknowns})
        noted = workstation.operators.noted_elements(active, settings, {})
        workstation.controls.set_elements(active, {name: noted[name] + sense * corrections[name] for name in unknowns})
        if mean_on_by == "at once":
            _set_by(context, mean)
    if mean_on_by == "in the end":
        workstation.begin_round(active, len(cases) + 1)
        _set_by(context, _measure_parallaxes(context, "A", readings).parallax_mm.mean(axis=0))


def _measure_parallaxes(context: ProcedureContext, case: str, readings: int) -> Parallaxes:
    workstation, model = context.workstation, context.model
    points = [model.standard_points[label] for label in model.points_of_case(case)]
    parallaxes = workstation.parallaxes(workstation.operators.active, points, readings)
    workstation.operators.give_up(
        parallaxes.disagrees(workstation.operators.active), f"{model.name}: images too far apart to be fused"
    )
    return parallaxes


def _set_by(context: ProcedureContext, mean: Array) -> None:
    """Set by of the left-hand photograph's projector by a mean parallax."""
    workstation, by = context.workstation, f"by{context.model.left_projector}"
    active = workstation.operators.active
    workstation.controls.set_elements(active, {by: workstation.controls.elements(active, [by])[by] + mean})


@procedure("perspective centres")
def perspective_centres(
    context: ProcedureContext, hands: Sequence[int] = (1, 2), swapped: bool = False, height_in_mm: bool = False
) -> None:
    """Preset the counters on the ground at point 1, point at two levels with each eye, and answer both centres.

    Mistakes: only some eyes (`hands`, 1 for the left-hand photograph), each centre under the other's name (`swapped`),
    or the height above the lower level in mm instead of counter units.
    """
    context.take_over()
    find_centres(context, hands, swapped, height_in_mm)


@procedure("model with its centres")
def model_with_its_centres(
    context: ProcedureContext,
    hands: Sequence[int] = (1, 2),
    swapped: bool = False,
    height_in_mm: bool = False,
    knocked: Mapping[str, float] | None = None,
    wrong_fittings: Mapping[str, str] | None = None,
) -> None:
    """Set up a model from empty carriers to both answered centres:

    fittings, pictures, relative orientation, pointings, sums.

    Mistakes as in `perspective_centres`, or at the end elements `knocked` or fittings left in `wrong_fittings`.
    """
    context.set_up()
    context.begin("relative orientation")
    orient_model(context.workstation, context.model)
    find_centres(context, hands, swapped, height_in_mm)
    perturb_elements(context, knocked or {})
    misplace_fittings(context, wrong_fittings or {})


def find_centres(context: ProcedureContext, hands: Sequence[int], swapped: bool, height_in_mm: bool) -> None:
    """Preset the counters at point 1, point at both levels and answer the centres."""
    workstation, model, plan = context.workstation, context.model, context.workstation.job.plan
    context.begin("model coordinates")
    workstation.look_at_parallaxes(workstation.operators.active, [model.standard_points["1"]])
    workstation.controls.preset(workstation.operators.active, plan.preset)
    for side in hands:
        context.begin(f"{side_name(side)} perspective centre")
        centre = centre_of(observe_centre(workstation, workstation.operators.active, model, side), 0)
        X, Y, Z = (float(each) for each in (centre.X0, centre.Y0, centre.Z0))
        if height_in_mm:
            Z = plan.centre_levels[0] + (Z - plan.centre_levels[0]) / workstation.controls.units_per_mm
        projector = workstation.controls.projector(3 - side if swapped else side)
        context.answer({f"x{projector}": X, f"y{projector}": Y, f"z{projector}": Z})
