"""Bridging (aeropolygon): base in, base out, base in ... along a strip, without joining models afterwards.

The oriented photograph stays in its projector; the next one is oriented to it by the dependent method. bx transfers the
scale: it is changed until common points have the same heights as in the previous model. The counters are preset so that
readings continue in the system of the first model.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from a7sim.batch import Indices, exclude
from a7sim.geometry import Array
from a7sim.operator.driving.job import Job, ModelJob
from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.operator_batch import AllGaveUpError, OperatorBatch
from a7sim.operator.people.person import Person
from a7sim.operator.procedures.models import (
    begin_form,
    load_prints,
    model_coordinates,
    mount_photographs,
    preset_counters,
    require_active,
    set_base_and_fittings,
)
from a7sim.operator.procedures.relative import (
    OrientationRecordBatch,
    assess_residuals,
    compute_corrections,
    expand_to_batch,
    relative_orientation,
    unknown_elements,
)

MAX_SCALINGS = 4
MAX_REFINEMENTS = 4
STILL_FALLING = 0.95
"""Residual parallaxes, or changes of the base, count as decreasing while below this share of the best so far."""

SHARE_OF_RANGE = 0.5
"""Share of the range of by or bz beyond which the strip is moved back to their zeros and Y or Z preset."""


@dataclass(frozen=True)
class BridgedModels:
    """Model of a batch of strips; the last axis of arrays contains all sessions."""

    model: ModelJob
    sessions: Indices
    orientation: OrientationRecordBatch
    points: Mapping[str, Array]
    """Readings X, Y, Z ``(3, sessions)`` in the system of the first model, nan where a point was not measured."""
    common: Mapping[str, Array]
    """Readings at common points, this model's minus those of the previous one ``(3, sessions)``."""
    scale: Array
    """Factor ``(sessions,)`` of bx for the transfer of scale."""
    z_units_per_mm: float

    def coordinates_of(self, session: int) -> dict[str, tuple[float, float, float]]:
        """Return the points of one session in mm, Z upward."""
        each = {
            name: (place[:, session] / [1.0, 1.0, self.z_units_per_mm]).tolist() for name, place in self.points.items()
        }
        return {name: (x, y, z) for name, (x, y, z) in each.items() if np.isfinite(x)}


def bridge_strip(
    person: Person,
    job: Job,
    tick: Callable[[], None] = lambda: None,
    begins: Callable[[str], None] = lambda _: None,
) -> Iterator[BridgedModels]:
    """Yield the models of a strip bridged over a link. Raises OperatorGaveUp if a model cannot be set up."""
    person.book.set_heading("", "preparation")
    yield from bridge_strip_batch(Workstation(OperatorBatch.single(person), ScpiDriver(person), job, tick), begins)


def bridge_strip_batch(
    workstation: Workstation, begins: Callable[[str], None] = lambda _: None
) -> Iterator[BridgedModels]:
    """Yield the models of a strip bridged by a batch of operators.

    The left-hand photograph of each model must be the right-hand one of the previous model, with the other base mode;
    otherwise the operator gives up.
    """
    try:
        yield from _bridge_each_model(workstation, begins)
    except AllGaveUpError:
        return


def _bridge_each_model(workstation: Workstation, begins: Callable[[str], None]) -> Iterator[BridgedModels]:
    operators, controls, job = workstation.operators, workstation.controls, workstation.job
    controls.prepare(operators.active)
    before: dict[str, Array] = {}
    last: ModelJob | None = None
    for model in job.models:
        begin_form(workstation, model, "interior orientation", begins)
        if last is not None:
            _require_continuation(workstation, last, model)
            extend_strip(workstation, model)
        set_base_and_fittings(workstation, model.base, model.polarity)
        mount_photographs(workstation, model)
        prints = load_prints(workstation, model)
        require_active(workstation)
        workstation.begin(operators.active, model, prints)
        if last is None:
            preset_counters(workstation, model)
        else:
            copy_common_photo_orientation(workstation, model)
        begin_form(workstation, model, "relative orientation", begins)
        orientation = _orient_new_photograph(workstation, model)
        scale = np.ones(operators.size)
        if last is not None:
            begin_form(workstation, model, "scale", begins)
            scale = transfer_scale(workstation, operators.active, model, before)
        orientation = _refine_orientation(workstation, model, orientation)
        if last is not None:
            scale *= transfer_scale(workstation, operators.active, model, before)
        begin_form(workstation, model, "model coordinates", begins)
        points = model_coordinates(workstation, model)
        require_active(workstation)
        common = {name: points[name] - before[name] for name in points if name in before}
        yield BridgedModels(model, operators.active, orientation, points, common, scale, controls.units_per_mm)
        before, last = points, model


def _require_continuation(workstation: Workstation, last: ModelJob, model: ModelJob) -> None:
    if model.left != last.right or model.left_projector != last.right_projector:
        workstation.operators.give_up(
            workstation.operators.active,
            f"model {model.name} does not go on from model {last.name}: expected {last.right} on the left and base "
            f"{'outside' if last.base == 'inside' else 'inside'}, got {model.left} and base {model.base}",
        )
        require_active(workstation)


# --- from one model to the next ---------------------------------------------------------------------------------------


def extend_strip(workstation: Workstation, model: ModelJob) -> None:
    """Preset the counters for the new position of the oriented photograph on the left.

    With the base changed over, its centre moves from X = bx to X = 0: the reading at X = 0 must increase by bx. Y and Z
    are preset where its by or bz is farther than `SHARE_OF_RANGE` from zero.
    """
    controls, active, n = workstation.controls, workstation.operators.active, model.left_projector
    controls.shift_counter(active, "X", controls.elements(active, ["bx"])["bx"])
    for name, axis, units in ((f"by{n}", "Y", -1.0), (f"bz{n}", "Z", controls.units_per_mm)):
        element = controls.manual.elements[name]
        counts = controls.elements(active, [name])[name]
        far = np.abs(counts - element.zero) > SHARE_OF_RANGE * (element.high - element.low) / 2.0
        if far.any():
            controls.shift_counter(active[far], axis, units * (counts - element.zero)[far])
            controls.set_elements(active[far], {name: np.full(int(far.sum()), element.zero)})


def copy_common_photo_orientation(workstation: Workstation, model: ModelJob) -> None:
    """Start the new photograph with the tilts, by and bz of the oriented one, and bx from the plan."""
    controls, active = workstation.controls, workstation.operators.active
    left, right = model.left_projector, model.right_projector
    names = ("phi", "omega", "by", "bz")
    shown = controls.elements(active, [f"{name}{left}" for name in names])
    within = {}
    for name in names:
        element = controls.manual.elements[f"{name}{right}"]
        within[f"{name}{right}"] = np.clip(shown[f"{name}{left}"], element.low, element.high)
    controls.set_elements(active, {"bx": np.full(active.size, workstation.job.plan.bx)} | within)


def _orient_new_photograph(workstation: Workstation, model: ModelJob) -> OrientationRecordBatch:
    plan, active, tolerated = workstation.job.plan, workstation.operators.active, workstation.job.tolerated_parallax_mm
    return relative_orientation(
        workstation, active, model, "dependent", plan.case, plan.parallax_readings, plan.bx, tolerated
    )


# --- scale ------------------------------------------------------------------------------------------------------------


def transfer_scale(workstation: Workstation, active: Indices, model: ModelJob, before: Mapping[str, Array]) -> Array:
    """Change the base until common points have the previous heights; return the factor ``(sessions,)``.

    by and bz of the new photograph follow, so that the base keeps its direction and the parallaxes stay cleared.
    """
    operators, controls = workstation.operators, workstation.controls
    left, right = model.left_projector, model.right_projector
    factor, least = np.ones(operators.size), np.full(operators.size, np.inf)
    names = [name for name in map(model.standard_points.get, "135") if name is not None and name in before]
    if not names:
        operators.give_up(
            active, f"{model.name}: none of its points 1, 3 and 5 was measured before, to carry the scale on"
        )
        require_active(workstation)
    for number in range(1, MAX_SCALINGS + 1):
        workstation.begin_round(active, number)
        readings = workstation.measure_points(active, names)[:, :, active]
        wanted = np.stack([before[name][:, active] for name in names], axis=1)
        workstation.compute(active)
        settings = controls.exact_values(
            active, ["bx", *(f"{name}{n}" for name in ("by", "bz") for n in (left, right))]
        )
        depths = [
            settings[f"bz{left}"]
            + np.stack([controls.model_position(active, each[:, i])[2] for i in range(len(names))])
            for each in (readings, wanted)
        ]
        larger = np.nanmean(depths[1] / depths[0], axis=0)
        change = np.abs(larger - 1.0) * np.abs(settings["bx"])
        turning = (change > workstation.pointing.finest_mm) & (change < STILL_FALLING * least[active])
        least[active] = change
        operators.give_up(active[~np.isfinite(larger)], f"{model.name}: no common point carries the scale on")
        turning &= operators.is_active(active)
        if not turning.any():
            break
        new = {"bx": larger * settings["bx"]}
        for name in ("by", "bz"):
            fixed = settings[f"{name}{left}"]
            new[f"{name}{right}"] = fixed + larger * (settings[f"{name}{right}"] - fixed)
        active = active[turning]
        controls.turn_elements(active, {name: values[turning] for name, values in new.items()})
        factor[active] *= larger[turning]
    return factor


# --- refinement -------------------------------------------------------------------------------------------------------


def _refine_orientation(
    workstation: Workstation, model: ModelJob, found: OrientationRecordBatch
) -> OrientationRecordBatch:
    """Look at the residuals at all standard points and correct the new photograph while they decrease.

    The eye resolves less than a count, and a drum turns finer than it reads; the settings with the smallest residual
    parallaxes are kept.
    """
    operators, controls = workstation.operators, workstation.controls
    unknowns = unknown_elements("dependent", model)
    points = [model.standard_points[label] for label in model.all_positions()]
    sessions = active = operators.active
    best = expand_to_batch(controls.exact_values(active, unknowns), active, operators.size)
    least = np.full(operators.size, np.inf)
    for number in range(1, MAX_REFINEMENTS + 1):
        workstation.begin_round(active, number)
        seen = workstation.look_at_parallaxes(active, points)
        active = operators.remaining(active)
        active = exclude(active, seen.disagrees(active))
        rms = np.sqrt((seen.parallax_mm**2).mean(axis=0))
        now = expand_to_batch(controls.exact_values(active, unknowns), active, operators.size)
        better = active[rms[active] < least[active]]
        falling = active[rms[active] < STILL_FALLING * least[active]]
        least[better] = rms[better]
        for name, kept in best.items():
            kept[better] = now[name][better]
        active = falling
        if not active.size or number == MAX_REFINEMENTS:
            break
        corrections, _ = compute_corrections(
            workstation, active, model, seen.places, seen.parallax_mm, unknowns, controls.bx(active)
        )
        active = operators.remaining(active)
        controls.turn_elements(active, {name: (now[name] + corrections[name])[active] for name in unknowns})
    sessions = operators.remaining(sessions)
    controls.turn_if_changed(sessions, {name: kept[sessions] for name, kept in best.items()})
    workstation.begin_round(sessions, MAX_REFINEMENTS + 1)
    job = workstation.job
    return assess_residuals(
        workstation,
        sessions,
        model,
        found,
        model.all_positions(),
        job.plan.parallax_readings,
        job.tolerated_parallax_mm,
    )
