"""Procedures after relative orientation: absolute orientation and base change."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from a7sim.operator.driving.job import ModelJob
from a7sim.operator.procedures.absolute import absolute_orientation_at
from a7sim.operator.procedures.bridging import copy_common_photo_orientation, extend_strip, transfer_scale
from a7sim.operator.procedures.models import load_prints, mount_photographs, orient_model, set_base_and_fittings
from a7sim.operator.procedures.relative import relative_orientation
from a7sim.training.attempt_record import ANSWER
from a7sim.training.procedures.base import ProcedureContext, misplace_fittings, perturb_elements, procedure


@procedure("prepared model")
def prepared_model(context: ProcedureContext, model: str = "", orient: bool = True) -> None:
    """Set up a model and `orient` it relatively, for the next operator.

    The Z counter then reads from the base line.
    """
    workstation, model_job = context.workstation, find_model(context, model)
    ProcedureContext(context.person, workstation, model_job).set_up()
    if orient:
        orient_model(workstation, model_job)
    active = workstation.operators.active
    heights = workstation.controls.elements_from_zero(active, [f"bz{model_job.left_projector}"])[
        f"bz{model_job.left_projector}"
    ]
    workstation.controls.shift_counter(
        active, "Z", workstation.controls.units_per_mm * heights - workstation.controls.centre(active, 1)[2]
    )


def take_over(context: ProcedureContext, model: ModelJob) -> None:
    """Continue at a prepared instrument with a mounted model and counters not preset."""
    workstation = context.workstation
    active = workstation.operators.active
    workstation.controls.take_over(active)
    workstation.controls.counters(active)
    workstation.begin(active, model, load_prints(workstation, model))


def find_model(context: ProcedureContext, name: str) -> ModelJob:
    """Return a model of the job sheet, that of the exercise if none is named."""
    return next((each for each in context.workstation.job.models if each.name == name), context.model)


@procedure("absolute orientation")
def absolute_orientation(
    context: ProcedureContext,
    misread: Mapping[str, Sequence[float]] | None = None,
    points: Sequence[str] | None = None,
    knocked: Mapping[str, float] | None = None,
) -> None:
    """Level and scale the mounted model on its control, index its heights, and read control and new points.

    Mistakes: control `misread` by amounts in m in X, Y, Z; only `points` read; elements `knocked` at the end.
    """
    workstation = context.workstation
    model = context.model if points is None else replace(context.model, other_points=tuple(points))
    take_over(context, model)
    context.begin("absolute orientation")
    absolute_orientation_at(workstation, model, misread_control(workstation.job.control, misread or {}))
    perturb_elements(context, knocked or {})


@procedure("A8 model")
def a8_model(
    context: ProcedureContext,
    level: bool = True,
    doubled: bool = True,
    place: str = "3",
    misread: Mapping[str, Sequence[float]] | None = None,
    points: Sequence[str] | None = None,
    knocked: Mapping[str, float] | None = None,
) -> None:
    """Orient a model empirically, level it by common Phi and both omegas, read it, and answer the position of a point.

    Mistakes: not made `level`, scale units taken for mm instead of `doubled`, control `misread`, only `points` read,
    elements `knocked` at the end.
    """
    workstation, operators = context.workstation, context.workstation.operators
    name = context.model.standard_points[place]
    others = context.model.other_points if points is None else tuple(points)
    model = replace(context.model, other_points=(*others, name))
    take_over(context, model)
    context.begin("relative orientation")
    orient_model(workstation, model)
    context.begin("absolute orientation")
    if level:
        control = misread_control(workstation.job.control, misread or {})
        on_ground = absolute_orientation_at(workstation, model, control)[0]
        reading, bx = np.array(on_ground.points[name]), on_ground.elements["bx"]
    else:
        wanted = dict.fromkeys([*workstation.job.control, *model.other_points])
        visible = [each for each in wanted if workstation.has_point(operators.active, each).all()]
        reading = workstation.measure_points(operators.active, visible)[:, visible.index(name), 0]
        bx = float(workstation.controls.bx(operators.active)[0])
    scales = [workstation.controls.manual.scales[axis] for axis in "XY"]
    x, y = (each - scale.at_origin for each, scale in zip(reading[:2].tolist(), scales, strict=True))
    mm = 1.0 / scales[0].units_per_mm if doubled else 1.0
    left = workstation.controls.manual.centres_on_base[0] * bx
    context.person.note(f"{ANSWER}x{place}={mm * x - left:.2f} y{place}={mm * y:.2f}")
    perturb_elements(context, knocked or {})


def misread_control(
    control: Mapping[str, tuple[float, float, float]], misread: Mapping[str, Sequence[float]]
) -> dict[str, tuple[float, float, float]]:
    """Return control with some coordinates misread by amounts in m in X, Y, Z."""
    changed = dict(control)
    for name, (dx, dy, dz) in misread.items():
        x, y, z = control[name]
        changed[name] = (x + dx, y + dy, z + dz)
    return changed


@procedure("base change")
def base_change(
    context: ProcedureContext,
    kept: bool = True,
    counters: bool = True,
    scale: bool = True,
    read_again: bool = True,
    wrong_fittings: Mapping[str, str] | None = None,
    knocked: Mapping[str, float] | None = None,
) -> None:
    """Read the common points, change the base, orient the next photograph to the oriented one, transfer the scale.

    Mistakes: the photograph to be `kept` turned as well, the `counters` not preset, the `scale` not transferred, common
    points not `read_again`, fittings left in `wrong_fittings` or elements `knocked`.
    """
    workstation, model = context.workstation, context.model
    operators, plan = workstation.operators, workstation.job.plan
    active = operators.active
    models = workstation.job.models
    first = models[models.index(model) - 1]
    take_over(context, first)
    context.begin("common points")
    common = [name for name in map(model.standard_points.get, "135") if name]
    readings = workstation.measure_points(active, common)
    before = {name: readings[:, i] for i, name in enumerate(common)}
    context.begin("interior orientation")
    if counters:
        extend_strip(workstation, model)
    set_base_and_fittings(workstation, model.base, model.polarity)
    mount_photographs(workstation, model)
    workstation.begin(operators.active, model, load_prints(workstation, model))
    copy_common_photo_orientation(workstation, model)
    context.begin("relative orientation")
    method = "dependent" if kept else "independent"
    tolerated = workstation.job.tolerated_parallax_mm
    relative_orientation(
        workstation, operators.active, model, method, plan.case, plan.parallax_readings, plan.bx, tolerated
    )
    context.begin("scale")
    if scale:
        transfer_scale(workstation, operators.active, model, before)
    context.begin("model coordinates")
    if read_again:
        workstation.measure_points(operators.active, common)
    perturb_elements(context, knocked or {})
    misplace_fittings(context, wrong_fittings or {})
