"""A day's work: the models of a job, one after the other."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.manual import RIGHT_FITTINGS
from a7sim.operator.centres import observe_centre
from a7sim.operator.interior import InteriorOrientation, interior_orientation
from a7sim.operator.job import Job, ModelJob
from a7sim.operator.linkbench import LinkBench
from a7sim.operator.person import Person
from a7sim.operator.relative import RelativeOrientation, relative_orientation
from a7sim.reduction import PerspectiveCentre


@dataclass(frozen=True)
class ModelRecord:
    """What the operator found of a model, in counter readings."""

    model: ModelJob
    interior: Mapping[str, InteriorOrientation]
    orientation: RelativeOrientation
    points: Mapping[str, tuple[float, float, float]]
    centres: Mapping[int, PerspectiveCentre]
    """By hand: 1 left, 2 right."""
    z_units_per_mm: float
    finished_at: float
    """Simulated seconds."""


def work(
    person: Person,
    job: Job,
    tick: Callable[[], None] = lambda: None,
    begins: Callable[[str], None] = lambda _: None,
) -> Iterator[ModelRecord]:
    """Yield the models of a job as they are done. Raises DoesNotFit when one cannot be set up.

    `begins` is told of every activity, `tick` comes after every point.
    """
    bench = LinkBench(person, job, tick)
    interior: dict[str, InteriorOrientation] = {}
    person.book.head("", "preparation")
    bench.prepare()
    for model in job.models:
        _begin(person, model, "interior orientation", begins)
        _set_base_and_fittings(person, model)
        _mount(person, job, model, interior)
        sketches = _prints(person, model)
        bench.begin(model, sketches)
        bench.preset(model.standard_points["1"])
        _begin(person, model, "relative orientation", begins)
        plan = job.plan
        tolerated = 1e-3 * plan.tolerated_parallax_um * plan.projection_height / job.certificate.c
        orientation = relative_orientation(
            bench, model, plan.method, plan.case, plan.parallax_readings, plan.bx, tolerated
        )
        _begin(person, model, "model coordinates", begins)
        wanted = dict.fromkeys([*model.standard_points.values(), *model.other_points])
        common = [name for name in wanted if name in sketches[1] and name in sketches[2]]
        measured = bench.measure(common)
        centres = {}
        for hand, side in ((1, "left"), (2, "right")):
            _begin(person, model, f"{side} perspective centre", begins)
            centres[hand] = observe_centre(bench, model, hand, plan.centre_levels, plan.tolerated_centre_rms)
        yield ModelRecord(
            model,
            {name: interior[name] for name in (model.left, model.right)},
            orientation,
            {point: (x, y, z) for point, x, y, z in zip(common, *measured.tolist(), strict=True) if not math.isnan(x)},
            centres,
            bench.z_units_per_mm,
            person.clock.now,
        )


def _begin(person: Person, model: ModelJob, form: str, begins: Callable[[str], None]) -> None:
    begins(f"model {model.name}: {form}")
    person.book.head(model.name, form)
    person.note(f"{model.name}: {form}")


def _set_base_and_fittings(person: Person, model: ModelJob) -> None:
    right = RIGHT_FITTINGS[model.polarity, model.base].as_words()
    short = {"inside": "IN", "outside": "OUT", "front": "FRON", "right": "RIGH"}
    nodes = {
        "dove": "DOVE",
        "triangulation": "TRI",
        "diapositive": "DIAP",
        "xcollar": "XCOL",
        "ycollar": "YCOL",
    }
    person.set(
        f"BASE:MODE {short[model.base]}",
        *(f"FITT:{nodes[name]} {short.get(word, word.upper())}" for name, word in right.items()),
    )


def _mount(person: Person, job: Job, model: ModelJob, interior: dict[str, InteriorOrientation]) -> None:
    """Mount what is not yet in its projector; a projector with a new picture starts from its counter zeros."""
    for projector, photograph in ((model.left_projector, model.left), (model.right_projector, model.right)):
        if person.client.fields(f"PHOT{projector}?") == [photograph]:
            continue
        if person.client.fields(f"PHOT{3 - projector}?") == [photograph]:
            person.set(f"PHOT{3 - projector}:UNL")
        person.set(f"PROJ{projector}:KAPP 0;PHI 100;OMEG 100;BY 0;BZ 0")
        interior[photograph] = interior_orientation(person, projector, photograph, job.certificate)


def _prints(person: Person, model: ModelJob) -> dict[int, dict[str, Array]]:
    """Take up the paper prints of both photographs and see that they overlap the right way round."""
    prints = {1: _print(person, model.left_projector), 2: _print(person, model.right_projector)}
    common = [name for name in prints[1] if name in prints[2]]
    shift = np.mean([prints[1][name][0] - prints[2][name][0] for name in common]) if common else 0.0
    if shift <= 0.0:
        raise person.give_up(
            f"{model.name}: the prints of {model.left} and {model.right} do not overlap towards each other: the "
            "photographs have changed places, or one lies upside down"
        )
    return prints


def _print(person: Person, projector: int) -> dict[str, Array]:
    fields = person.client.fields(f"PHOT{projector}:SKET?")
    places = np.array([fields[1::3], fields[2::3]], dtype=float).T
    return dict(zip(fields[0::3], places, strict=False))
