"""Bridging, or aeropolygon: base in, base out, base in ... through a strip, without joining models afterwards.

The photograph that is oriented stays as it is in its projector; the next one is oriented to it by the dependent method,
and bx carries the scale on: it is changed until common points read the heights that they had in the model before.
The counters are preset so that readings go on in the system of the first model.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from a7sim.batch import Indices, exclude
from a7sim.geometry import Array
from a7sim.operator.interior import InteriorOrientationBatch
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.models import (
    begin_form,
    load_prints,
    model_coordinates,
    mount_photographs,
    preset_counters,
    require_active,
    set_base_and_fittings,
)
from a7sim.operator.operator_batch import AllGaveUpError, OperatorBatch
from a7sim.operator.person import Person
from a7sim.operator.relative import (
    OrientationRecordBatch,
    assess_residuals,
    compute_corrections,
    expand_to_batch,
    relative_orientation,
    unknown_elements,
)
from a7sim.operator.scpi_driver import ScpiDriver
from a7sim.operator.workstation import Workstation

MAX_SCALINGS = 4
MAX_REFINEMENTS = 4
STILL_FALLING = 0.95
"""Residual parallaxes, or changes of the base, go on falling while they are below this share of the best so far."""

SHARE_OF_RANGE = 0.5
"""Of the range of by or bz, beyond which the strip is brought back to their zeros and Y or Z preset."""


@dataclass(frozen=True)
class BridgedModels:
    """A model in a crew's strips; arrays have all sessions as their last axis."""

    model: ModelJob
    sessions: Indices
    orientation: OrientationRecordBatch
    points: Mapping[str, Array]
    """Readings X, Y, Z ``(3, sessions)`` that go on from the first model, nan where a point was not measured."""
    common: Mapping[str, Array]
    """Readings at common points, this model's minus those of the one before ``(3, sessions)``."""
    scale: Array
    """Factor ``(sessions,)`` that bx took on to carry the scale."""
    z_units_per_mm: float

    def coordinates_of(self, session: int) -> dict[str, tuple[float, float, float]]:
        """Return one session's points in mm, Z upward."""
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
    """Yield the models of a strip as a person bridges it. Raises DoesNotFit when one cannot be set up."""
    person.book.set_heading("", "preparation")
    yield from bridge_strip_batch(Workstation(OperatorBatch.single(person), ScpiDriver(person), job, tick), begins)


def bridge_strip_batch(bench: Workstation, begins: Callable[[str], None] = lambda _: None) -> Iterator[BridgedModels]:
    """Yield the models of a strip as a crew bridges it, each session at its own instrument.

    Every model must have the photograph of the one before it as its left-hand one and the other base; give up if not.
    """
    try:
        yield from _bridged(bench, begins)
    except AllGaveUpError:
        return


def _bridged(bench: Workstation, begins: Callable[[str], None]) -> Iterator[BridgedModels]:
    crew, seat, job = bench.crew, bench.seat, bench.job
    interior: dict[str, InteriorOrientationBatch] = {}
    seat.prepare(crew.active)
    before: dict[str, Array] = {}
    last: ModelJob | None = None
    for model in job.models:
        begin_form(bench, model, "interior orientation", begins)
        if last is not None:
            _see_that_it_follows(bench, last, model)
            extend_strip(bench, model)
        set_base_and_fittings(bench, model.base, model.polarity)
        mount_photographs(bench, model, interior)
        prints = load_prints(bench, model)
        require_active(bench)
        bench.begin(crew.active, model, prints)
        if last is None:
            preset_counters(bench, model)
        else:
            copy_common_photo_orientation(bench, model)
        begin_form(bench, model, "relative orientation", begins)
        orientation = _oriented(bench, model)
        scale = np.ones(crew.size)
        if last is not None:
            begin_form(bench, model, "scale", begins)
            scale = transfer_scale(bench, crew.active, model, before)
        orientation = _refined(bench, model, orientation)
        if last is not None:
            scale *= transfer_scale(bench, crew.active, model, before)
        begin_form(bench, model, "model coordinates", begins)
        points = model_coordinates(bench, model)
        require_active(bench)
        common = {name: points[name] - before[name] for name in points if name in before}
        yield BridgedModels(model, crew.active, orientation, points, common, scale, seat.units_per_mm)
        before, last = points, model


def _see_that_it_follows(bench: Workstation, last: ModelJob, model: ModelJob) -> None:
    if model.left != last.right or model.left_projector != last.right_projector:
        bench.crew.give_up(
            bench.crew.active,
            f"model {model.name} does not go on from model {last.name}: expected {last.right} on the left and base "
            f"{'outside' if last.base == 'inside' else 'inside'}, got {model.left} and base {model.base}",
        )
        require_active(bench)


# --- from one model to the next ---------------------------------------------------------------------------------------


def extend_strip(bench: Workstation, model: ModelJob) -> None:
    """Preset X for the oriented photograph's new place on the left, and Y and Z where its by and bz run out.

    With the base changed over, its centre comes from X = bx to X = 0: what stands in X = 0 has to read bx more.
    """
    seat, who, n = bench.seat, bench.crew.active, model.left_projector
    seat.shift_counter(who, "X", seat.elements(who, ["bx"])["bx"])
    for name, axis, units in ((f"by{n}", "Y", -1.0), (f"bz{n}", "Z", seat.units_per_mm)):
        element = seat.manual.elements[name]
        counts = seat.elements(who, [name])[name]
        far = np.abs(counts - element.zero) > SHARE_OF_RANGE * (element.high - element.low) / 2.0
        if far.any():
            seat.shift_counter(who[far], axis, units * (counts - element.zero)[far])
            seat.set_elements(who[far], {name: np.full(int(far.sum()), element.zero)})


def copy_common_photo_orientation(bench: Workstation, model: ModelJob) -> None:
    """Start the new photograph from the tilts and the by and bz of the oriented one, and bx from the plan."""
    seat, who = bench.seat, bench.crew.active
    left, right = model.left_projector, model.right_projector
    names = ("phi", "omega", "by", "bz")
    shown = seat.elements(who, [f"{name}{left}" for name in names])
    within = {}
    for name in names:
        element = seat.manual.elements[f"{name}{right}"]
        within[f"{name}{right}"] = np.clip(shown[f"{name}{left}"], element.low, element.high)
    seat.set_elements(who, {"bx": np.full(who.size, bench.job.plan.bx)} | within)


def _oriented(bench: Workstation, model: ModelJob) -> OrientationRecordBatch:
    plan, who, tolerated = bench.job.plan, bench.crew.active, bench.job.tolerated_parallax_mm
    return relative_orientation(bench, who, model, "dependent", plan.case, plan.parallax_readings, plan.bx, tolerated)


# --- scale ------------------------------------------------------------------------------------------------------------


def transfer_scale(bench: Workstation, who: Indices, model: ModelJob, before: Mapping[str, Array]) -> Array:
    """Change the base until common points read the heights that they had; return the factor ``(sessions,)``.

    by and bz of the new photograph follow, so that the base keeps its direction and the parallaxes stay cleared.
    """
    crew, seat = bench.crew, bench.seat
    left, right = model.left_projector, model.right_projector
    factor, least = np.ones(crew.size), np.full(crew.size, np.inf)
    names = [name for name in map(model.standard_points.get, "135") if name is not None and name in before]
    if not names:
        crew.give_up(who, f"{model.name}: none of its points 1, 3 and 5 was measured before, to carry the scale on")
        require_active(bench)
    for number in range(1, MAX_SCALINGS + 1):
        bench.begin_round(who, number)
        readings = bench.measure_points(who, names)[:, :, who]
        wanted = np.stack([before[name][:, who] for name in names], axis=1)
        bench.compute(who)
        settings = seat.exact_values(who, ["bx", *(f"{name}{n}" for name in ("by", "bz") for n in (left, right))])
        depths = [
            settings[f"bz{left}"] + np.stack([seat.model_position(who, each[:, i])[2] for i in range(len(names))])
            for each in (readings, wanted)
        ]
        larger = np.nanmean(depths[1] / depths[0], axis=0)
        change = np.abs(larger - 1.0) * np.abs(settings["bx"])
        turning = (change > bench.eyes.finest_mm) & (change < STILL_FALLING * least[who])
        least[who] = change
        crew.give_up(who[~np.isfinite(larger)], f"{model.name}: no common point carries the scale on")
        turning &= crew.is_active(who)
        if not turning.any():
            break
        new = {"bx": larger * settings["bx"]}
        for name in ("by", "bz"):
            fixed = settings[f"{name}{left}"]
            new[f"{name}{right}"] = fixed + larger * (settings[f"{name}{right}"] - fixed)
        who = who[turning]
        seat.turn_elements(who, {name: values[turning] for name, values in new.items()})
        factor[who] *= larger[turning]
    return factor


# --- refinement -------------------------------------------------------------------------------------------------------


def _refined(bench: Workstation, model: ModelJob, found: OrientationRecordBatch) -> OrientationRecordBatch:
    """Look at what is left at all standard points and correct the new photograph while it falls.

    The eye sees finer than by counts, and a drum turns finer than it shows; the settings with the smallest residual
    parallaxes stand.
    """
    crew, seat = bench.crew, bench.seat
    unknowns = unknown_elements("dependent", model)
    points = [model.standard_points[label] for label in model.all_positions()]
    everybody = who = crew.active
    best = expand_to_batch(seat.exact_values(who, unknowns), who, crew.size)
    least = np.full(crew.size, np.inf)
    for number in range(1, MAX_REFINEMENTS + 1):
        bench.begin_round(who, number)
        seen = bench.look_at_parallaxes(who, points)
        who = crew.remaining(who)
        who = exclude(who, seen.disagrees(who))
        rms = np.sqrt((seen.parallax_mm**2).mean(axis=0))
        now = expand_to_batch(seat.exact_values(who, unknowns), who, crew.size)
        better = who[rms[who] < least[who]]
        falling = who[rms[who] < STILL_FALLING * least[who]]
        least[better] = rms[better]
        for name, kept in best.items():
            kept[better] = now[name][better]
        who = falling
        if not who.size or number == MAX_REFINEMENTS:
            break
        corrections, _ = compute_corrections(bench, who, model, seen.places, seen.parallax_mm, unknowns, seat.bx(who))
        who = crew.remaining(who)
        seat.turn_elements(who, {name: (now[name] + corrections[name])[who] for name in unknowns})
    everybody = crew.remaining(everybody)
    seat.turn_if_changed(everybody, {name: kept[everybody] for name, kept in best.items()})
    bench.begin_round(everybody, MAX_REFINEMENTS + 1)
    job = bench.job
    return assess_residuals(
        bench, everybody, model, found, model.all_positions(), job.plan.parallax_readings, job.tolerated_parallax_mm
    )
