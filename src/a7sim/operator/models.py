"""A day's work: the models of a job, one after the other."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.operator.absolute import GroundOrientation, absolute_orientation_at
from a7sim.operator.centres import centre_of, observe_centre
from a7sim.operator.empirical import empirical_orientation, perturb_elements
from a7sim.operator.fittings import required_fittings
from a7sim.operator.interior import InteriorOrientation, InteriorOrientationBatch, interior_orientation
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.operator_batch import AllGaveUpError, OperatorBatch
from a7sim.operator.person import Person
from a7sim.operator.plate import sketch_positions
from a7sim.operator.relative import OrientationRecord, OrientationRecordBatch, relative_orientation
from a7sim.operator.scpi_driver import ScpiDriver
from a7sim.operator.workstation import Workstation
from a7sim.reduction import PerspectiveCentre
from a7sim.standard_points import CASES


@dataclass(frozen=True)
class ModelRecord:
    """What an operator found of a model, in counter readings."""

    model: ModelJob
    interior: Mapping[str, InteriorOrientation]
    orientation: OrientationRecord
    points: Mapping[str, tuple[float, float, float]]
    centres: Mapping[int, PerspectiveCentre]
    """By hand: 1 left, 2 right."""
    xy_units_per_mm: float
    z_units_per_mm: float
    finished_at: float
    """Simulated seconds."""
    on_ground: GroundOrientation | None = None
    """The model in the system of the ground, where it was oriented absolutely at the instrument."""


@dataclass(frozen=True)
class ModelRecordBatch:
    """What a crew found of a model; arrays have all sessions as their last axis."""

    model: ModelJob
    sessions: Indices
    """Those who came to the end of it."""
    interior: Mapping[str, InteriorOrientationBatch]
    orientation: OrientationRecordBatch
    points: Mapping[str, Array]
    """X, Y, Z ``(3, sessions)``, nan where a point was not measured."""
    centres: Mapping[int, PerspectiveCentre]
    xy_units_per_mm: float
    z_units_per_mm: float
    finished_at: Array
    on_ground: Mapping[int, GroundOrientation] | None = None
    """By session, where models are levelled and scaled at the instrument; those without enough control have none."""

    @cached_property
    def _points_listed(self) -> dict[str, list[list[float]]]:
        return {point: each.T.tolist() for point, each in self.points.items()}

    def of(self, session: int) -> ModelRecord:
        """Return one session's record."""
        places = {point: each[session] for point, each in self._points_listed.items()}
        return ModelRecord(
            self.model,
            {name: each.of(session) for name, each in self.interior.items()},
            self.orientation.of(session),
            {point: (x, y, z) for point, (x, y, z) in places.items() if not math.isnan(x)},
            {hand: centre_of(each, session) for hand, each in self.centres.items()},
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
    """Yield the models of a job as a person does them. Raises DoesNotFit when one cannot be set up.

    `begins` is told of every activity, `tick` comes after every point.
    """
    person.book.set_heading("", "preparation")
    for records in measure_models_batch(
        Workstation(OperatorBatch.single(person), ScpiDriver(person), job, tick), begins
    ):
        yield records.of(0)


def measure_models_batch(
    bench: Workstation, begins: Callable[[str], None] = lambda _: None
) -> Iterator[ModelRecordBatch]:
    """Yield the models of a job as a crew does them, each session at its own instrument."""
    try:
        yield from _worked(bench, begins)
    except AllGaveUpError:
        return


def _worked(bench: Workstation, begins: Callable[[str], None]) -> Iterator[ModelRecordBatch]:
    job, crew = bench.job, bench.crew
    interior: dict[str, InteriorOrientationBatch] = {}
    bench.seat.prepare(crew.active)
    for model in job.models:
        begin_form(bench, model, "interior orientation", begins)
        set_base_and_fittings(bench, model.base, model.polarity)
        mount_photographs(bench, model, interior)
        prints = load_prints(bench, model)
        require_active(bench)
        bench.begin(crew.active, model, prints)
        note_missing_points(bench, model)
        preset_counters(bench, model)
        begin_form(bench, model, "relative orientation", begins)
        orientation = orient_model(bench, model)
        begin_form(bench, model, "model coordinates", begins)
        points = model_coordinates(bench, model)
        centres = {}
        for hand, side in ((1, "left"), (2, "right")):
            begin_form(bench, model, f"{side} perspective centre", begins)
            centres[hand] = observe_centre(bench, crew.active, model, hand)
        on_ground = None
        if job.control:
            begin_form(bench, model, "absolute orientation", begins)
            on_ground = absolute_orientation_at(bench, model, job.control)
        require_active(bench)
        yield ModelRecordBatch(
            model,
            crew.active,
            {name: interior[name] for name in (model.left, model.right)},
            orientation,
            points,
            centres,
            float(bench.seat.counter_units_per_mm[0]),
            bench.seat.units_per_mm,
            crew.seconds.copy(),
            on_ground,
        )


def require_active(bench: Workstation) -> None:
    """Raise NobodyGoesOn when all have given up."""
    if not bench.crew.active.size:
        raise AllGaveUpError


def note_missing_points(bench: Workstation, model: ModelJob) -> None:
    """Write into the book which points of the case lie in water, or are not pricked on both prints."""
    crew = bench.crew
    listed = {label: model.standard_points.get(label, "") for label in CASES[bench.job.plan.case]}
    for who, there in bench.group_by_points(crew.active, list(listed.values())):
        absent = [f"{label} ({name})" if name else label for label, name in listed.items() if name not in there]
        if absent:
            crew.remark(who, f"{model.name}: not pricked on both prints, done without: {', '.join(absent)}")


def preset_counters(bench: Workstation, model: ModelJob) -> None:
    """Preset the counters at point 1, as the thesis does, or where that is not there at the first point that is.

    Those who find no standard point at all on both their prints give up.
    """
    crew = bench.crew
    waiting = crew.active
    for label in model.all_positions():
        point = model.standard_points[label]
        there = bench.has_point(waiting, point)
        presetting, waiting = waiting[there], waiting[~there]
        if presetting.size:
            if label != "1":
                crew.remark(presetting, f"{model.name}: there is no point 1: counters preset at {point}, point {label}")
            bench.preset(presetting, point)
    crew.give_up(waiting, f"{model.name}: no standard point is pricked on both prints")


def model_coordinates(bench: Workstation, model: ModelJob) -> dict[str, Array]:
    """Measure all points that both prints show; sessions whose prints show the same do it together."""
    crew = bench.crew
    wanted = list(dict.fromkeys([*model.standard_points.values(), *model.other_points]))
    points: dict[str, Array] = {}
    for alike, names in bench.group_by_points(crew.active, wanted):
        for name, measured in zip(names, np.moveaxis(bench.measure_points(alike, names), 1, 0), strict=True):
            points.setdefault(name, np.full((3, crew.size), np.nan))[:, alike] = measured[:, alike]
    return {name: points[name] for name in wanted if name in points}


def begin_form(bench: Workstation, model: ModelJob, form: str, begins: Callable[[str], None]) -> None:
    """Begin a form of a model in book and journal."""
    require_active(bench)
    begins(f"model {model.name}: {form}")
    bench.crew.begin(bench.crew.active, model.name, form)
    bench.hands.note(bench.crew.active, f"{model.name}: {form}")


def orient_model(bench: Workstation, model: ModelJob) -> OrientationRecordBatch:
    """Orient a model by the procedure on the job sheet."""
    plan, who, tolerated = bench.job.plan, bench.crew.active, bench.job.tolerated_parallax_mm
    if plan.start_off_gon:
        perturb_elements(bench, who, model, plan.method, plan.start_off_gon)
    if plan.procedure == "empirical":
        return empirical_orientation(
            bench, who, model, plan.method, plan.case, plan.over_correction, plan.parallax_readings, tolerated
        )
    return relative_orientation(bench, who, model, plan.method, plan.case, plan.parallax_readings, plan.bx, tolerated)


def set_base_and_fittings(bench: Workstation, base: str, polarity: str) -> None:
    """Set base in or out, and the fittings that belong to it and to the pictures."""
    who, hands = bench.crew.active, bench.hands
    right = required_fittings(bench.seat.manual, polarity, base)
    bench.seat.spend_setting(who, 1 + len(right))
    hands.set_base_mode(who, base)
    for name, position in right.items():
        for them, put in bench.crew.fitting_positions(who, name, position):
            hands.set_fitting(them, name, put)
    bench.seat.give_up_on_errors(who, f"setting base {base} and its fittings")


def mount_photographs(bench: Workstation, model: ModelJob, interior: dict[str, InteriorOrientationBatch]) -> None:
    """Mount what is not yet in its projector; a projector with a new picture starts from its counter zeros."""
    seat, hands = bench.seat, bench.hands
    for projector, photograph in ((model.left_projector, model.left), (model.right_projector, model.right)):
        who = bench.crew.active
        if hands.loaded(who, projector) == photograph:
            continue
        if hands.loaded(who, 3 - projector) == photograph:
            seat.spend_setting(who)
            hands.unload(who, 3 - projector)
        seat.spend_setting(who)
        for name, element in seat.manual.elements.items():
            if name.endswith(str(projector)) and not name.startswith("c"):
                seat.run_element(who, name, np.full(who.size, element.zero))
        seat.give_up_on_errors(who, f"setting projector {projector} to its zeros")
        interior[photograph] = interior_orientation(
            bench, bench.crew.active, projector, photograph, bench.job.certificate
        )


def load_prints(bench: Workstation, model: ModelJob) -> dict[int, dict[str, Array]]:
    """Take up the paper prints of both photographs and see that they overlap the right way round."""
    crew = bench.crew
    who = crew.active
    prints = {}
    for hand, projector in ((1, model.left_projector), (2, model.right_projector)):
        prints[hand] = sketch_positions(bench, who, projector)
    common = [name for name in prints[1] if name in prints[2]]
    shifts = np.array([prints[1][name][0] - prints[2][name][0] for name in common]).reshape(-1, crew.size)[:, who]
    nowhere = np.isnan(shifts).all(axis=0)
    crew.give_up(
        who[nowhere], f"{model.name}: no point is pricked on both the prints of {model.left} and {model.right}"
    )
    who, shifts = who[~nowhere], shifts[:, ~nowhere]
    crew.give_up(
        who[np.nanmean(shifts, axis=0) <= 0.0] if who.size else who,
        f"{model.name}: the prints of {model.left} and {model.right} do not overlap towards each other: the "
        "photographs have changed places, or one lies upside down",
    )
    return prints
