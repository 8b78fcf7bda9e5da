"""Perspective centres: by two or more levels of Z (thesis 3.6), by a grid plate, or read from scales."""

from collections.abc import Callable, Sequence
from dataclasses import fields
from operator import attrgetter
from typing import Any

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices
from a7sim.geometry import Array
from a7sim.operator.driving.controls import side_name
from a7sim.operator.driving.job import ModelJob
from a7sim.operator.driving.workstation import Workstation
from a7sim.operator.procedures.interior import centre_picture
from a7sim.operator.procedures.plate import Crosses, cross_positions, locate_plate, point_at_crosses, sketch_positions
from a7sim.plotters import LEAST_COUNT
from a7sim.reduction import (
    PerspectiveCentre,
    PlatePlacement,
    Resection,
    grid_plate_centre,
    perspective_centre,
    perspective_centre_of_levels,
)

SUSPICIOUS_RMS = 0.19
"""Counter units; none of the thesis's twenty centres except the misprinted one has a larger rms."""

SLIPPED = 1.5
"""A point whose removal reduces a suspicious rms by this factor is measured again."""

MAX_REPETITIONS = 3

MIN_CROSSES = 9
"""Within the model, in two columns or more; the coarsest grid lines of the plate with that number are used."""

BESIDE_THE_MODEL = 0.1
"""Limit of crosses beyond the base, as a share of it: carriages and rods may not reach further."""

MIN_POINTS = 3
"""For a centre by levels: an outlier can be detected, but not identified."""

Levels = npt.NDArray[np.float64]

_PARTS = attrgetter(*(field.name for field in fields(PerspectiveCentre)))


def observe_centre(workstation: Workstation, active: Indices, model: ModelJob, side: int) -> PerspectiveCentre:
    """Return the centres ``(sessions,)`` of one photograph in counter units, by the method of the plan.

    `side` is 1 for the left-hand photograph, 2 for the right-hand one. Sessions whose rms exceeds the tolerance give
    up.
    """
    plan, operators = workstation.job.plan, workstation.operators
    shown = workstation.controls.displayed_levels(active, plan.centre_levels)
    active = operators.remaining(active)
    levels = shown[:, 0]
    if plan.centre_method == "scales":
        return _by_scales(workstation, active, side, plan.centre_levels)
    if plan.centre_method == "grid plate":
        centres = _by_grid_plate(workstation, active, model, side, levels)
    else:
        centres = _by_levels(workstation, active, model, side, levels)
    active = operators.remaining(active)
    rms = centres.rms[active]
    for session, bad in zip(active[rms > plan.tolerated_centre_rms], rms[rms > plan.tolerated_centre_rms], strict=True):
        operators.give_up(
            np.array([session]),
            f"{model.name}: the pointings of a perspective centre do not meet: rms {bad:.2f}, "
            f"tolerated {plan.tolerated_centre_rms:.2f}",
        )
    return centres


def centre_of(centres: PerspectiveCentre, session: int) -> PerspectiveCentre:
    """Return the centre of one session."""
    parts: list[Any] = [None if each is None else each[..., session] for each in _PARTS(centres)]
    return PerspectiveCentre(*parts)


def _expand_to_batch(centres: PerspectiveCentre, active: Indices, sessions: int) -> PerspectiveCentre:
    def spread(values: Array) -> Array:
        every = np.full((*values.shape[:-1], sessions), np.nan)
        every[..., active] = values
        return every

    return PerspectiveCentre(*_change_values(centres, spread))


def _unknown_centres(sessions: int) -> PerspectiveCentre:
    nothing = np.full(sessions, np.nan)
    values = {field.name: nothing for field in fields(PerspectiveCentre)}
    return PerspectiveCentre(**values | {"residuals": np.full((3, 0, sessions), np.nan)})


def _change_values(found: PerspectiveCentre | PlatePlacement, change: Callable[[Array], Array]) -> list[Any]:
    values = (getattr(found, field.name) for field in fields(found))
    return [None if each is None else change(each) for each in values]


def _by_scales(workstation: Workstation, active: Indices, side: int, levels: Sequence[float]) -> PerspectiveCentre:
    """Return the centres ``(sessions,)`` given by base, by, bz and the scales (P 3.1 and 3.2).

    Their standard deviations are those of the rounding to the last digit.
    """
    sessions = workstation.operators.size
    X0, Y0, Z0 = np.full((3, sessions), np.nan)
    X0[active], Y0[active], Z0[active] = workstation.controls.centre(active, side)
    rounding = np.full(sessions, LEAST_COUNT / np.sqrt(12.0))
    depth = levels[1] - levels[0]
    return PerspectiveCentre(
        X0,
        Y0,
        Z0,
        (Z0 - levels[0]) / depth,
        rounding,
        rounding,
        rounding,
        rounding / abs(depth),
        np.zeros(sessions),
        np.zeros((3, 0, sessions)),
    )


# --- levels of Z --------------------------------------------------------------------------------------


def _by_levels(
    workstation: Workstation, active: Indices, model: ModelJob, side: int, levels: Levels
) -> PerspectiveCentre:
    """Point monocularly at points 1 to 6 at all levels and compute the centres ``(sessions,)``.

    Points that the print does not show are left out; with fewer than three of them all standard points are used, and
    sessions with fewer than three of these give up.
    """
    operators = workstation.operators
    points = [model.standard_points[label] for label in model.all_positions()]
    corners_and_nadirs = {model.standard_points[label] for label in model.points_of_case("A")}
    groups = []
    for group, present in workstation.group_by_points(active, points, (side,)):
        usual = [name for name in present if name in corners_and_nadirs]
        chosen = usual if len(usual) >= MIN_POINTS else present
        if len(chosen) >= MIN_POINTS:
            found = _of_points(workstation, group, model, side, chosen, levels)
            groups.append((operators.remaining(group), chosen, found))
        else:
            operators.give_up(
                group,
                f"{model.name}: {len(chosen)} of the standard points are pricked on the print of the {side_name(side)} "
                f"photograph: there must be {MIN_POINTS} for its perspective centre",
            )
    return _merge_groups(groups, operators.size)


def _merge_groups(
    groups: Sequence[tuple[Indices, Sequence[str], PerspectiveCentre]], sessions: int
) -> PerspectiveCentre:
    """Return the centres of groups with different points as one batch, nan for the other sessions."""
    points = list(dict.fromkeys(name for _, names, _ in groups for name in names))
    every: dict[str, Array] = {}
    for active, names, centres in groups:
        slots = [points.index(name) for name in names]
        for name, values in ((field.name, getattr(centres, field.name)) for field in fields(centres)):
            if name == "residuals":
                residuals = every.setdefault(name, np.full((3, len(points), sessions), np.nan))
                residuals[:, np.array(slots)[:, None], active] = values
            elif values is not None:
                every.setdefault(name, np.full(sessions, np.nan))[active] = values
    return PerspectiveCentre(**every) if every else _unknown_centres(sessions)


def _of_points(
    workstation: Workstation, active: Indices, model: ModelJob, side: int, points: Sequence[str], levels: Levels
) -> PerspectiveCentre:
    """Return the centres ``(m,)`` of the active sessions, from points at all levels.

    A point that contradicts the others is struck out and measured again; if the rms stays suspicious without an
    outlier, a second set is observed and both are averaged.
    """
    operators = workstation.operators
    pointings = _observe_set(workstation, active, side, points, levels)
    active = operators.remaining(active)
    doubtful = active[_rms(pointings[..., active], levels) > SUSPICIOUS_RMS]
    if doubtful.size:
        operators.remark(doubtful, f"{model.name}: the points of the centre fit badly, a second set is observed")
        again = _observe_set(workstation, doubtful, side, points, levels)
        pointings[..., doubtful] = (pointings[..., doubtful] + again[..., doubtful]) / 2.0
        active = operators.remaining(active)
    return _centre(pointings[..., active], levels)


def _centre(pointings: Array, levels: Levels) -> PerspectiveCentre:
    """Return the centre from pointings ``(2, k, n, ...)``; T0 is from the first of two levels to the other."""
    if len(levels) == 2:
        return perspective_centre(pointings[:, 0], pointings[:, 1], *levels.tolist())
    return perspective_centre_of_levels(pointings, levels)


def _rms(pointings: Array, levels: Levels) -> Array:
    return _centre(pointings, levels).rms


def _observe_set(workstation: Workstation, active: Indices, side: int, points: Sequence[str], levels: Levels) -> Array:
    """Return pointings ``(2, k, n, sessions)`` at k levels."""
    operators = workstation.operators
    pointings = np.stack(
        [workstation.point_monocularly(operators.remaining(active), side, points, level) for level in levels.tolist()],
        axis=1,
    )
    looking = operators.remaining(active)
    workstation.compute(looking)
    for _ in range(MAX_REPETITIONS):
        misread = _misread_points(pointings[..., looking], levels)
        looking, misread = looking[misread >= 0], misread[misread >= 0]
        if not looking.size:
            break
        why = f"does not agree with the other points at the {'two ' if len(levels) == 2 else ''}levels"
        for index in np.unique(misread):
            again = looking[misread == index]
            for i, level in enumerate(levels.tolist()):
                pointed = workstation.repeat_pointing(again, side, points[index], level, why)
                pointings[:, i, index, again] = pointed[:, again]
        looking = operators.remaining(looking)
        workstation.compute(looking)
    return pointings


def _misread_points(pointings: Array, levels: Levels) -> npt.NDArray[np.intp]:
    """Return the index ``(m,)`` of the point that contradicts the others, -1 for none."""
    of_all = _rms(pointings, levels)
    without = np.array([_rms(np.delete(pointings, i, axis=2), levels) for i in range(pointings.shape[2])])
    suspicious = (of_all > SUSPICIOUS_RMS) & (of_all > SLIPPED * without.min(axis=0))
    return np.where(suspicious, without.argmin(axis=0), -1)


# --- a grid plate -------------------------------------------------------------------------------------


def _by_grid_plate(
    workstation: Workstation, active: Indices, model: ModelJob, side: int, levels: Levels
) -> PerspectiveCentre:
    """Mount the grid plate in place of the picture, point at its crosses at all levels, and mount the picture again.

    The elements stay unchanged. Plate and picture are centred anew with the precision of registering fiducials.
    """
    operators, job = workstation.operators, workstation.job
    plate = job.grid_plate
    certificate = plate.certificate(job.certificate)
    projector = workstation.controls.projector(side)
    picture = model.left if side == 1 else model.right
    centre_picture(workstation, active, projector, plate.name, certificate)
    placements = locate_plate(workstation, operators.remaining(active), projector, certificate, times=1)
    workstation.pointing.set_prints({side: sketch_positions(workstation, operators.remaining(active), projector)})
    crosses = _crosses_in_model(workstation, operators.remaining(active), side, levels)
    if len(crosses) < MIN_CROSSES:
        operators.give_up(
            active, f"{model.name}: too few crosses of plate {plate.name} lie within the model for a centre"
        )
        return _unknown_centres(operators.size)
    pointings = np.stack(
        [point_at_crosses(workstation, operators.remaining(active), side, crosses, level) for level in levels.tolist()],
        axis=1,
    )
    active = operators.remaining(active)
    workstation.compute(active)
    c = workstation.controls.elements(active, [f"c{projector}"])[f"c{projector}"]
    placement = PlatePlacement(*_change_values(placements, lambda values: values[active]))
    found = _resect_centres(workstation, crosses, pointings[..., active], levels, c, placement)
    centres = _expand_to_batch(found, active, operators.size)
    centre_picture(workstation, active, projector, picture, job.certificate)
    active = operators.remaining(active)
    workstation.pointing.set_prints(
        {n: sketch_positions(workstation, active, workstation.controls.projector(n)) for n in (1, 2)}
    )
    return centres


def _crosses_in_model(workstation: Workstation, active: Indices, side: int, levels: Levels) -> Crosses:
    """Return crosses that lie within the model in all sessions, empty if they are too few."""
    controls, plate = workstation.controls, workstation.job.grid_plate
    bx = np.abs(controls.bx(active))
    beyond = BESIDE_THE_MODEL * bx

    def in_model(crosses: Crosses) -> Crosses:
        swung = np.array(
            [
                controls.rotate_by_swing(active, side, np.repeat([place], active.size, axis=0).T)
                for place in crosses.values()
            ]
        )
        depth = controls.frame_positions(active, np.zeros((2, levels.size, active.size)), levels[:, None])[2]
        x = swung[:, 0] * depth.max(axis=0) / controls.c + (0.0 if side == 1 else bx)
        inside = ((x >= -beyond) & (x <= bx + beyond)).all(axis=1)
        return {name: place for (name, place), keep in zip(crosses.items(), inside, strict=True) if keep}

    sets = [*(in_model(plate.some_crosses(count)) for count in plate.even_counts), in_model(plate.crosses)]
    enough = (each for each in sets if len(each) >= MIN_CROSSES and len({x for x, _ in each.values()}) > 1)
    return next(enough, {})


def _resect_centres(
    workstation: Workstation, crosses: Crosses, pointings: Array, levels: Levels, c: Array, placement: PlatePlacement
) -> PerspectiveCentre:
    """Return the centres ``(m,)`` from pointings ``(2, k, n, m)`` at crosses, in counter units."""
    k, n = pointings.shape[1:3]
    units = workstation.controls.units_per_mm
    placed = np.tile(placement.placed(cross_positions(crosses)), (1, k, 1))
    heights = np.repeat(levels / units, n)[:, None]
    found = grid_plate_centre(placed, pointings.reshape(2, k * n, -1), heights, c)
    return _in_counter_units(found, levels, units, c, placement)


def _in_counter_units(
    found: Resection, levels: Levels, units: float, c: Array, placement: PlatePlacement
) -> PerspectiveCentre:
    """Return a resected centre in the form of a centre by levels.

    The residuals in X and Y are those at the mean level; T0 is from the first level to the last. The precision of the
    plate's placement enters the standard deviations of X0 and Y0.
    """
    x, y, z = found.centre
    sigma_x, sigma_y, sigma_z = found.sigma_centre
    enlarged = (z - levels.mean() / units) / c
    sigma_placement = enlarged * placement.sigma_shift
    step = float(levels[-1] - levels[0])
    residuals = enlarged * found.residuals
    return PerspectiveCentre(
        x,
        y,
        z * units,
        (z * units - levels[0]) / step,
        np.hypot(sigma_x, sigma_placement),
        np.hypot(sigma_y, sigma_placement),
        sigma_z * units,
        np.abs(sigma_z * units / step),
        enlarged * found.s0,
        np.concatenate([residuals, np.zeros((1, *residuals.shape[1:]))]),
    )
