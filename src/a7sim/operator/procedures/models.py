"""Measurement of the models of a job, one after the other."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.operator.driving.controls import side_name
from a7sim.operator.driving.fittings import required_fittings
from a7sim.operator.driving.job import Job, ModelJob
from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.operator_batch import AllGaveUpError, OperatorBatch
from a7sim.operator.people.person import Person
from a7sim.operator.procedures.absolute import GroundOrientation, absolute_orientation_at
from a7sim.operator.procedures.centres import centre_of, observe_centre
from a7sim.operator.procedures.empirical import empirical_orientation, perturb_elements
from a7sim.operator.procedures.interior import InteriorOrientation, InteriorOrientationBatch, interior_orientation
from a7sim.operator.procedures.plate import sketch_positions
from a7sim.operator.procedures.relative import OrientationRecord, OrientationRecordBatch, relative_orientation
from a7sim.reduction import PerspectiveCentre
from a7sim.standard_points import CASES


@dataclass(frozen=True)
class ModelRecord:
    """Results of an operator for a model, in counter readings."""

    model: ModelJob
    interior: Mapping[str, InteriorOrientation]
    orientation: OrientationRecord
    points: Mapping[str, tuple[float, float, float]]
    centres: Mapping[int, PerspectiveCentre]
    """By side: 1 left, 2 right."""
    xy_units_per_mm: float
    z_units_per_mm: float
    finished_at: float
    """Simulated seconds."""
    on_ground: GroundOrientation | None = None
    """Model in the system of the ground, if it was oriented absolutely at the instrument."""


@dataclass(frozen=True)
class ModelRecordBatch:
    """Results of a batch of operators for a model; the last axis of arrays contains all sessions."""

    model: ModelJob
    sessions: Indices
    """Sessions that finished it."""
    interior: Mapping[str, InteriorOrientationBatch]
    orientation: OrientationRecordBatch
    points: Mapping[str, Array]
    """X, Y, Z ``(3, sessions)``, nan where a point was not measured."""
    centres: Mapping[int, PerspectiveCentre]
    xy_units_per_mm: float
    z_units_per_mm: float
    finished_at: Array
    on_ground: Mapping[int, GroundOrientation] | None = None
    """By session, if models are levelled and scaled at the instrument; sessions without enough control have none."""

    @cached_property
    def _point_lists(self) -> dict[str, list[list[float]]]:
        return {point: each.T.tolist() for point, each in self.points.items()}

    def for_session(self, session: int) -> ModelRecord:
        """Return the record of one session."""
        places = {point: each[session] for point, each in self._point_lists.items()}
        return ModelRecord(
            self.model,
            {name: each.for_session(session) for name, each in self.interior.items()},
            self.orientation.for_session(session),
            {point: (x, y, z) for point, (x, y, z) in places.items() if not math.isnan(x)},
            {side: centre_of(each, session) for side, each in self.centres.items()},
            self.xy_units_per_mm,
            self.z_units_per_mm,
            float(self.finished_at[session]),
            self.on_ground.get(session) if self.on_ground else None,
        )


def measure_models(
    person: Person,
    job: Job,
    tick: Callable[[], None] = lambda: None,
    begins: Callable[[str], None] = lambda _: None,
) -> Iterator[ModelRecord]:
    """Yield the models of a job measured over a link. Raises OperatorGaveUp if a model cannot be set up.

    `begins` is called with each activity, `tick` after each point.
    """
    person.book.set_heading("", "preparation")
    for records in measure_models_batch(
        Workstation(OperatorBatch.single(person), ScpiDriver(person), job, tick), begins
    ):
        yield records.for_session(0)


def measure_models_batch(
    workstation: Workstation, begins: Callable[[str], None] = lambda _: None
) -> Iterator[ModelRecordBatch]:
    """Yield the models of a job measured by a batch of operators."""
    try:
        yield from _measure_each_model(workstation, begins)
    except AllGaveUpError:
        return


def _measure_each_model(workstation: Workstation, begins: Callable[[str], None]) -> Iterator[ModelRecordBatch]:
    job, operators = workstation.job, workstation.operators
    interior: dict[str, InteriorOrientationBatch] = {}
    workstation.controls.prepare(operators.active)
    for model in job.models:
        begin_form(workstation, model, "interior orientation", begins)
        set_base_and_fittings(workstation, model.base, model.polarity)
        interior |= mount_photographs(workstation, model)
        prints = load_prints(workstation, model)
        require_active(workstation)
        workstation.begin(operators.active, model, prints)
        note_missing_points(workstation, model)
        preset_counters(workstation, model)
        begin_form(workstation, model, "relative orientation", begins)
        orientation = orient_model(workstation, model)
        begin_form(workstation, model, "model coordinates", begins)
        points = model_coordinates(workstation, model)
        centres = {}
        for side in (1, 2):
            begin_form(workstation, model, f"{side_name(side)} perspective centre", begins)
            centres[side] = observe_centre(workstation, operators.active, model, side)
        on_ground = None
        if job.control:
            begin_form(workstation, model, "absolute orientation", begins)
            on_ground = absolute_orientation_at(workstation, model, job.control)
        require_active(workstation)
        yield ModelRecordBatch(
            model,
            operators.active,
            {name: interior[name] for name in (model.left, model.right)},
            orientation,
            points,
            centres,
            float(workstation.controls.counter_units_per_mm[0]),
            workstation.controls.units_per_mm,
            operators.seconds.copy(),
            on_ground,
        )


def require_active(workstation: Workstation) -> None:
    """Raise AllGaveUpError if all have given up."""
    if not workstation.operators.active.size:
        raise AllGaveUpError


def note_missing_points(workstation: Workstation, model: ModelJob) -> None:
    """Write into the book which points of the case are in water, or not pricked on both prints."""
    operators = workstation.operators
    listed = {label: model.standard_points.get(label, "") for label in CASES[workstation.job.plan.case]}
    for active, present in workstation.group_by_points(operators.active, list(listed.values())):
        absent = [f"{label} ({name})" if name else label for label, name in listed.items() if name not in present]
        if absent:
            operators.remark(active, f"{model.name}: not pricked on both prints, done without: {', '.join(absent)}")


def preset_counters(workstation: Workstation, model: ModelJob) -> None:
    """Preset the counters at point 1 (thesis), or at the first existing point.

    Sessions without a standard point on both prints give up.
    """
    operators = workstation.operators
    waiting = operators.active
    for label in model.all_positions():
        point = model.standard_points[label]
        present = workstation.has_point(waiting, point)
        presetting, waiting = waiting[present], waiting[~present]
        if presetting.size:
            if label != "1":
                operators.remark(
                    presetting, f"{model.name}: there is no point 1: counters preset at {point}, point {label}"
                )
            workstation.preset(presetting, point)
    operators.give_up(waiting, f"{model.name}: no standard point is pricked on both prints")


def model_coordinates(workstation: Workstation, model: ModelJob) -> dict[str, Array]:
    """Measure all points on both prints; sessions with the same points measure them together."""
    operators = workstation.operators
    wanted = list(dict.fromkeys([*model.standard_points.values(), *model.other_points]))
    points: dict[str, Array] = {}
    for alike, names in workstation.group_by_points(operators.active, wanted):
        for name, measured in zip(names, np.moveaxis(workstation.measure_points(alike, names), 1, 0), strict=True):
            points.setdefault(name, np.full((3, operators.size), np.nan))[:, alike] = measured[:, alike]
    return {name: points[name] for name in wanted if name in points}


def begin_form(workstation: Workstation, model: ModelJob, form: str, begins: Callable[[str], None]) -> None:
    """Start a form of a model in book and journal."""
    require_active(workstation)
    begins(f"model {model.name}: {form}")
    workstation.operators.begin(workstation.operators.active, model.name, form)
    workstation.driver.note(workstation.operators.active, f"{model.name}: {form}")


def orient_model(workstation: Workstation, model: ModelJob) -> OrientationRecordBatch:
    """Orient a model by the procedure on the job sheet."""
    plan, active, tolerated = workstation.job.plan, workstation.operators.active, workstation.job.tolerated_parallax_mm
    if plan.start_off_gon:
        perturb_elements(workstation, active, model, plan.method, plan.start_off_gon)
    if plan.procedure == "empirical":
        return empirical_orientation(
            workstation, active, model, plan.method, plan.case, plan.over_correction, plan.parallax_readings, tolerated
        )
    return relative_orientation(
        workstation, active, model, plan.method, plan.case, plan.parallax_readings, plan.bx, tolerated
    )


def set_base_and_fittings(workstation: Workstation, base: str, polarity: str) -> None:
    """Set base in or out, and the fittings required by it and by the pictures."""
    active, driver = workstation.operators.active, workstation.driver
    right = required_fittings(workstation.controls.manual, polarity, base)
    workstation.controls.spend_setting(active, 1 + len(right))
    driver.set_base_mode(active, base)
    for name, position in right.items():
        for group, put in workstation.operators.fitting_positions(active, name, position):
            driver.set_fitting(group, name, put)
    workstation.controls.give_up_on_errors(active, f"setting base {base} and its fittings")


def mount_photographs(workstation: Workstation, model: ModelJob) -> dict[str, InteriorOrientationBatch]:
    """Mount the photographs that are not yet mounted; return their interior orientations by photograph.

    A projector with a new picture starts from its counter zeros.
    """
    controls, driver = workstation.controls, workstation.driver
    interior = {}
    for projector, photograph in ((model.left_projector, model.left), (model.right_projector, model.right)):
        active = workstation.operators.active
        if driver.loaded(active, projector) == photograph:
            continue
        if driver.loaded(active, 3 - projector) == photograph:
            controls.spend_setting(active)
            driver.unload(active, 3 - projector)
        controls.spend_setting(active)
        for name, element in controls.manual.elements.items():
            if name.endswith(str(projector)) and not name.startswith("c"):
                controls.run_element(active, name, np.full(active.size, element.zero))
        controls.give_up_on_errors(active, f"setting projector {projector} to its zeros")
        interior[photograph] = interior_orientation(
            workstation, workstation.operators.active, projector, photograph, workstation.job.certificate
        )
    return interior


def load_prints(workstation: Workstation, model: ModelJob) -> dict[int, dict[str, Array]]:
    """Load the paper prints of both photographs and check that they overlap the right way round."""
    operators = workstation.operators
    active = operators.active
    prints = {}
    for side, projector in ((1, model.left_projector), (2, model.right_projector)):
        prints[side] = sketch_positions(workstation, active, projector)
    common = [name for name in prints[1] if name in prints[2]]
    shifts = np.array([prints[1][name][0] - prints[2][name][0] for name in common]).reshape(-1, operators.size)[
        :, active
    ]
    nowhere = np.isnan(shifts).all(axis=0)
    operators.give_up(
        active[nowhere], f"{model.name}: no point is pricked on both the prints of {model.left} and {model.right}"
    )
    active, shifts = active[~nowhere], shifts[:, ~nowhere]
    operators.give_up(
        active[np.nanmean(shifts, axis=0) <= 0.0] if active.size else active,
        f"{model.name}: the prints of {model.left} and {model.right} do not overlap towards each other: the "
        "photographs have changed places, or one lies upside down",
    )
    return prints
