"""Compilation of a map by one operator at the plotter and its table, from mounting to the last line."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array, length_of
from a7sim.operator.driving.job import Job
from a7sim.operator.driving.scpi_driver import ScpiDriver
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.mapping.compilation import Compilation
from a7sim.operator.mapping.level_model import LevelModel, level_model, orient_to_ground
from a7sim.operator.mapping.map_lines import Area, LineTarget, SpotHeights, TracedLine, Tracing
from a7sim.operator.mapping.preparation import PLAN_GEARS
from a7sim.operator.mapping.stereo_view import StereoView
from a7sim.operator.people.operator_batch import OperatorBatch
from a7sim.operator.people.person import Person
from a7sim.operator.procedures.models import ModelRecord, begin_form, measure_models_batch
from a7sim.reduction import Ground

TABLE_GEARS: Mapping[str, float] = MappingProxyType({"1-1-1": 1.0, **PLAN_GEARS})
"""Enlargements from the model to the plotting table; 1-1-1 is taken for equal gears [assumption]."""

ROUND_SCALE = 500.0
"""The map's scale number is rounded to a multiple of this."""

MAX_CONTOURS = 100


@dataclass(frozen=True)
class MapRequest:
    """Requested map: heights of contours in m, all multiples of an interval, lines, and the scale."""

    contours: tuple[float, ...]
    interval: float | None
    lines: tuple[LineTarget, ...]
    tracing: Tracing
    map_scale: float | None = None
    """Scale number of the map; if absent, the nearest round one."""


@dataclass(frozen=True)
class CompiledMap:
    """Compiled model as known to the operator."""

    record: ModelRecord
    model: LevelModel
    area: Area
    spots: SpotHeights
    lines: tuple[TracedLine, ...]
    heights: tuple[float, ...]
    """Of the contours, m."""
    gear: float
    """Enlargement from the model to the table."""
    height_above_ground: float
    """Of the projection centres, m."""
    sigma_height: float
    sigma_plan: float
    """Expected standard errors in m: of a setting and tremor, with the misfit of the control."""

    @property
    def map_scale(self) -> float:
        """Scale number of the map."""
        return self.model.scale_number / self.gear

    def on_table(self, readings: Array) -> Array:
        """Return the position of the pencil ``(2, ...)`` in mm from the mark's position at readings of zero, north up.

        The map is rotated on the table until the control fits.
        """
        east, north = self.model.absolute.similarity.rotation[:2, 0], self.model.absolute.similarity.rotation[:2, 1]
        turn = np.array([[east[0] + north[1], north[0] - east[1]], [east[1] - north[0], east[0] + north[1]]])
        turn /= length_of(turn[0])
        return np.asarray(self.gear * np.einsum("ij,j...->i...", turn, readings[:2]))


def compile_map(
    person: Person,
    job: Job,
    control: Ground,
    order: MapRequest,
    tick: Callable[[], None] = lambda: None,
    begins: Callable[[str], None] = lambda _: None,
) -> CompiledMap:
    """Set up the one model of a job, level it on the control, and compile the requested lines.

    Raises OperatorGaveUp if it cannot be set up, A7SimError for a contour outside the model.
    """
    person.book.set_heading("", "preparation")
    workstation = Workstation(OperatorBatch.single(person), ScpiDriver(person), job, tick)
    record = next(measure_models_batch(workstation, begins)).for_session(0)
    view = StereoView(workstation, person)
    begin_form(workstation, workstation.controls.model, "absolute orientation", begins)
    gear = TABLE_GEARS[job.plan.plan_gear]
    corners = {label: record.model.standard_points.get(label, "") for label in "3456"}
    first = orient_to_ground(workstation, record.points, control, record.z_units_per_mm)
    number = gear * (order.map_scale or _round_scale(1e3 * float(first.similarity.scale) / gear))
    model = level_model(workstation, view, record.points, control, number, list(corners.values()))
    seen = [label for label, name in corners.items() if name in model.points]
    if not all(any(label in seen for label in border) for border in ("34", "56", "35", "46")):
        workstation.operators.give_up(
            workstation.operators.active,
            f"{record.model.name}: of standard points 3 to 6, the corners of the model, only "
            f"{', '.join(seen) or 'none'} can be seen: they leave a side of it open",
        )
    area = Area.within(record.model.standard_points, model.points)
    work = Compilation(workstation, person, view, model, area, order.tracing)
    begin_form(workstation, workstation.controls.model, "spot heights", begins)
    spots = work.spot_heights()
    heights = _heights(order, spots)
    lines: list[TracedLine] = []
    for height in heights:
        begin_form(workstation, workstation.controls.model, f"contour {height:g}", begins)
        lines += work.contour(height, spots)
        tick()
    for target in order.lines:
        begin_form(workstation, workstation.controls.model, f"line {target.name}", begins)
        lines.append(work.line(target, spots))
        tick()
    above, sigma_height, sigma_plan = _expected_errors(workstation, view, model, spots, order.tracing)
    return CompiledMap(
        replace(record, finished_at=float(workstation.operators.seconds[0])),
        model, area, spots, tuple(lines), heights, gear, above, sigma_height, sigma_plan,
    )  # fmt: skip


def _round_scale(number: float) -> float:
    return max(ROUND_SCALE, ROUND_SCALE * round(number / ROUND_SCALE))


def _heights(order: MapRequest, spots: SpotHeights) -> tuple[float, ...]:
    """Return the requested heights of contours in order. Raises A7SimError for one outside the model."""
    low, high = spots.range
    for height in order.contours:
        if not low < height < high:
            raise A7SimError(f"--contour {height:g}: expected a height within the model, {low:.1f} to {high:.1f} m")
    heights = set(order.contours)
    if order.interval is not None:
        first, last = math.ceil(low / order.interval), math.floor(high / order.interval)
        if last - first >= MAX_CONTOURS:
            raise A7SimError(
                f"--interval {order.interval:g}: expected at most {MAX_CONTOURS} contours from {low:.1f} to "
                f"{high:.1f} m, got {last - first + 1}"
            )
        if last < first and not heights and not order.lines:
            raise A7SimError(f"--interval {order.interval:g}: expected a multiple of it from {low:.1f} to {high:.1f} m")
        heights |= {order.interval * k for k in range(first, last + 1)}
    return tuple(sorted(heights))


def _expected_errors(
    workstation: Workstation, view: StereoView, model: LevelModel, spots: SpotHeights, tracing: Tracing
) -> tuple[float, float, float]:
    """Return the height of the centres above the mean spot in m, and the expected standard errors in m."""
    active, observer = workstation.operators.active, workstation.operators.observer
    look = view.look()
    residuals = model.absolute.fit.at_control
    misfit = np.sqrt(np.nanmean(residuals**2, axis=1))
    setting = 1e-3 * observer.height_um / look.parallax_by_height * model.metres_per_mm
    tremor = 1e-3 * tracing.tremor_um * look.enlargement * model.metres_per_mm
    mean_spot = np.nanmean(spots.readings, axis=(1, 2))[:, None]
    above = float(workstation.controls.model_position(active, mean_spot)[2, 0]) * model.metres_per_mm
    return above, math.hypot(float(misfit[2]), setting), math.hypot(float(np.hypot(*misfit[:2]) / np.sqrt(2.0)), tremor)
