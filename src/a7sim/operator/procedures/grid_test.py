"""Grid test: a plate in each projector in turn, pointings at its crosses, and the errors of the projector."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, fields

import numpy as np

from a7sim.batch import Indices
from a7sim.geometry import GON, Array
from a7sim.operator.driving.controls import side_name, wrap_gon
from a7sim.operator.driving.job import Job, ModelJob
from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.people.person import Person
from a7sim.operator.procedures.interior import centre_picture
from a7sim.operator.procedures.models import set_base_and_fittings
from a7sim.operator.procedures.plate import Crosses, cross_positions, locate_plate, point_at_crosses, sketch_positions
from a7sim.plotters import Variant
from a7sim.reduction import Elements, PlatePlacement, ProjectorTest, grid_test
from a7sim.scenario import Camera, GridPlate, Plan

TIMES_REGISTERED = 4
"""Number of registrations of each fiducial of the plate before the pointings.

It limits the precision of principal point and swing.
"""

MARGIN_MM = 5.0
"""Margin to the ends of the carriages."""

WHOLE_LEVELS_MM = 5.0

MAX_DEPTH_RATIO = 2.0
"""Maximum ratio of the levels below the centre, within the range of the carriages."""

PREPARED_HEIGHT_MM, PREPARED_BASE_MM = 300.0, 10.0
"""Initial settings; the test is made with bx at zero."""


@dataclass(frozen=True)
class GridTestPlan:
    """Plan of a grid test: plate, number of crosses, levels of Z, and pointings at each."""

    camera: Camera
    """Its collimating marks are in the carriers, and its principal distance is set."""
    plate: GridPlate
    crosses: int = 25
    levels: int = 2
    pointings: int = 2
    polarity: str = "positive"
    """Polarity of the plate."""

    @property
    def job(self) -> Job:
        """Job sheet of the test: counters in mm of the instrument frame."""
        plan = Plan(bx=PREPARED_BASE_MM, projection_height=PREPARED_HEIGHT_MM, height_gear=1.0, plan_gear="1-1-1")
        return Job(self.plate.certificate(self.camera), plan, (), self.plate)

    @property
    def chosen(self) -> Crosses:
        """Crosses to be measured. Raises A7SimError for a number that is not evenly spaced on the plate."""
        return self.plate.some_crosses(self.crosses)

    def heights(self, manual: Variant) -> list[float]:
        """Return the levels in mm of the frame, from the highest to the lowest, as far apart as the carriages allow."""
        return level_heights(manual, self.camera.c, float(np.abs(cross_positions(self.chosen)).max()), self.levels)


def level_heights(manual: Variant, c: float, outermost: float, levels: int) -> list[float]:
    """Return levels of Z, mm of the frame, at which the mark reaches all crosses.

    `outermost` is the largest coordinate of a cross from the middle of the plate, mm. A single level is the mean of the
    nearest and the farthest.
    """
    reach = min(abs(end) for axis in "XY" for end in manual.carriages[axis]) - MARGIN_MM
    lowest, highest = manual.carriages["Z"]
    farthest = min(reach * c / outermost, -lowest - MARGIN_MM)
    nearest = max(farthest / MAX_DEPTH_RATIO, -highest + MARGIN_MM)
    far = math.floor(farthest / WHOLE_LEVELS_MM) * WHOLE_LEVELS_MM
    near = min(math.ceil(nearest / WHOLE_LEVELS_MM) * WHOLE_LEVELS_MM, far)
    wanted = np.linspace(near, far, levels) if levels > 1 else np.array([(near + far) / 2.0])
    return [-float(each) for each in np.round(wanted, 2)]


@dataclass(frozen=True)
class ProjectorReadings:
    """Grid test of a projector; the last axis of arrays ``(..., m)`` contains the sessions that finished it."""

    projector: int
    sessions: Indices
    counters: Mapping[str, Array]
    """Counter readings of its elements and of bx, gon and mm."""
    heights: tuple[float, ...]
    crosses: Crosses
    test: ProjectorTest
    pointing: Array
    """Standard deviation of one pointing, from its repetitions, mm at photo scale; nan for one pointing."""
    finished_at: Array
    """Simulated seconds."""


def measure_grid(
    person: Person,
    order: GridTestPlan,
    tick: Callable[[], None] = lambda: None,
    begins: Callable[[str], None] = lambda _: None,
) -> Iterator[ProjectorReadings]:
    """Yield both projectors as tested over a link. Raises OperatorGaveUp if one cannot be tested."""
    yield from measure_grid_batch(
        Workstation(OperatorBatch.single(person), ScpiDriver(person), order.job, tick), order, begins
    )


def measure_grid_batch(
    workstation: Workstation, order: GridTestPlan, begins: Callable[[str], None] = lambda _: None
) -> Iterator[ProjectorReadings]:
    """Yield the left and the right projector as tested by a batch of operators."""
    operators = workstation.operators
    operators.begin(operators.active, "", "preparation")
    workstation.controls.prepare(operators.active)
    set_base_and_fittings(workstation, "inside", order.polarity)
    for side in (1, 2):
        form = f"grid test, {side_name(side)} projector"
        begins(form)
        operators.begin(operators.active, order.plate.name, form)
        workstation.driver.note(operators.active, form)
        yield _test_projector(workstation, order, side)
        workstation.driver.unload(operators.active, side)


def _test_projector(workstation: Workstation, order: GridTestPlan, side: int) -> ProjectorReadings:
    operators, controls, plate = workstation.operators, workstation.controls, order.plate
    model = ModelJob(f"{plate.name} in projector {side}", plate.name, plate.name, "inside", order.polarity, {})
    certificate = workstation.job.certificate
    _set_to_zeros(workstation, side)
    centre_picture(workstation, operators.active, side, plate.name, certificate)
    placements = locate_plate(workstation, operators.active, side, certificate, TIMES_REGISTERED)
    workstation.begin(operators.active, model, {side: sketch_positions(workstation, operators.active, side)})
    heights = order.heights(controls.manual)
    sets = np.stack([_pointings(workstation, order, side, height) for height in heights], axis=2)
    active = operators.active
    workstation.compute(active)
    counters = _counters(workstation, active, side)
    means = sets.mean(axis=0)[..., active]
    placement = PlatePlacement(*(getattr(placements, field.name)[active] for field in fields(placements)))
    test = grid_test(
        cross_positions(order.chosen), means, heights, _elements(controls.manual, counters, side), placement
    )
    enlarged = -np.array(heights)[:, None, None] / controls.c
    pointing = _repeatability(sets[..., active], enlarged)
    return ProjectorReadings(
        side, active, counters, tuple(heights), order.chosen, test, pointing, operators.seconds[active].copy()
    )


def _set_to_zeros(workstation: Workstation, projector: int) -> None:
    """Set a projector's elements and bx to their counter zeros, and the camera's principal distance."""
    controls, active = workstation.controls, workstation.operators.active
    elements = controls.manual.elements
    zeros = {
        name: np.full(active.size, element.zero)
        for name, element in elements.items()
        if name == "bx" or (name[-1] == str(projector) and name != f"c{projector}")
    }
    controls.set_elements(active, zeros | {f"c{projector}": np.full(active.size, workstation.job.certificate.c)})


def _pointings(workstation: Workstation, order: GridTestPlan, side: int, height: float) -> Array:
    """Return positions of the mark ``(p, 2, n, sessions)`` in mm of the frame for p pointings at all crosses."""
    operators, controls = workstation.operators, workstation.controls
    places = np.zeros((order.pointings, 2, len(order.chosen), operators.size))
    level = controls.units_per_mm * height
    for i in range(order.pointings):
        readings = point_at_crosses(workstation, operators.active, side, order.chosen, level)
        active = operators.active
        places[i][:, :, active] = controls.frame_positions(active, readings[:, :, active], np.full(active.size, level))[
            :2
        ]
    return places


def _counters(workstation: Workstation, active: Indices, projector: int) -> Mapping[str, Array]:
    names = [name for name in workstation.controls.manual.elements if name == "bx" or name[-1] == str(projector)]
    return workstation.controls.elements(active, names)


def _elements(manual: Variant, counters: Mapping[str, Array], projector: int) -> Elements:
    """Return the elements of a projector by its counters, in mm and radians from the zeros; base in."""
    omega, phi, kappa = manual.tilts(counters, projector)
    nothing = np.zeros_like(counters["bx"])
    return Elements(
        c=counters[f"c{projector}"],
        omega=omega * GON,
        phi=phi * GON,
        kappa=wrap_gon(kappa) * GON,
        bx=nothing if projector == 1 else counters["bx"],
        by=counters.get(f"by{projector}", nothing),
        bz=counters.get(f"bz{projector}", nothing),
    )


def _repeatability(sets: Array, enlarged: Array) -> Array:
    """Return the standard deviation ``(m,)`` of a pointing at photo scale from p sets ``(p, 2, k, n, m)``."""
    p = sets.shape[0]
    if p == 1:
        return np.full(sets.shape[-1], np.nan)
    off = (sets - sets.mean(axis=0)) / enlarged
    return np.asarray(np.sqrt((off**2).sum(axis=(0, 1, 2, 3)) / ((p - 1) * off[0, ..., 0].size)))
