"""Blocks of independent models: one similarity per model and the common ground points, adjusted together.

First the plan with level models, which is linear, then plan and height together by linearised equations ``s R x + T - P
= 0`` for every point of every model; the sparse solution eliminates the unknown points.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

import numpy as np
import numpy.typing as npt

from a7sim.errors import A7SimError
from a7sim.geometry import Array, length_of, rotation
from a7sim.reduction.absolute import Ground, GroundFit
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.similarity import rotation_from_vector, similarity_columns
from a7sim.reduction.strips import Model
from a7sim.text import pluralize

MAX_MODELS = 500
MAX_ITERATIONS = 30
CONVERGED = 1e-10
MIN_PIVOT = 1e-11
"""Smallest pivot of the scaled normal equations, relative to one: below it a model or a point is not determined."""
UNKNOWNS_OF_A_MODEL = 7


@dataclass(frozen=True)
class BlockAdjustment:
    """A block adjusted to its control, in the system of the ground.

    Scales ``(m,)``, rotations ``(3, 3, m)`` and translations ``(3, m)`` in the order of `names`; points and their
    coordinates ``(3, p)``; residuals ``(3, n)`` of the model coordinates, transformed minus adjusted, in the order of
    `observed` (model, point), in the unit of the ground. `s0` is of unit weight, `s0_plan` and `s0_height` the same
    for the equations in plan and in height, with the redundancy shared out by the number of equations.
    """

    names: tuple[str, ...]
    scales: Array
    rotations: Array
    translations: Array
    points: tuple[str, ...]
    coordinates: Array
    observed: tuple[tuple[str, str], ...]
    residuals: Array
    fit: GroundFit
    redundancy: int
    s0: float
    s0_plan: float
    s0_height: float
    iterations: int
    normal: Any
    """Scaled normal equations, sparse, unknowns of the models first; and their scale in `normal_scale`."""
    normal_scale: Array

    @cached_property
    def sigmas(self) -> Array:
        """Standard deviations ``(7, m)`` of scale, turns about X, Y, Z (radians) and translation at the model's middle.

        The dense inverse of the models' own normal equations is formed: a few seconds for 500 models.
        """
        size = UNKNOWNS_OF_A_MODEL * len(self.names)
        inner, border, outer = self.normal[:size, :size], self.normal[:size, size:], self.normal[size:, size:]
        reduced = inner.toarray()
        if outer.shape[0]:
            reduced = reduced - border @ _sparse().linalg.splu(outer.tocsc()).solve(border.T.toarray())
        cofactors = np.diag(np.linalg.inv(reduced)) / self.normal_scale[:size] ** 2
        return np.asarray(self.s0 * np.sqrt(cofactors).reshape((len(self.names), UNKNOWNS_OF_A_MODEL)).T)


@dataclass(frozen=True)
class _Equations:
    """Model, point, and unknown or given ground coordinate of each row of the block."""

    models: tuple[Model, ...]
    points: tuple[str, ...]
    model_of: npt.NDArray[np.intp]
    point_of: npt.NDArray[np.intp]
    local: Array
    given: Array
    column: npt.NDArray[np.intp]
    """Shape ``(3, p)``: index of a point's coordinate among the unknown ones, -1 where it is given."""
    unknown: int


def block_adjustment(models: Sequence[Model], ground: Ground, height_weight: float = 1.0) -> BlockAdjustment:
    """Return independent models, coordinates ``(3, n)``, joined to each other and to the ground control at once.

    Control is held; points in two or more models and control in one join; others are transformed. Height equations have
    `height_weight` times the weight of plan equations. Models should be nearly level in their own systems, with any
    azimuth. Raises A7SimError for more than 500 models, Undetermined for a block that its ties and control do not
    determine.
    """
    if not 1 <= len(models) <= MAX_MODELS:
        raise A7SimError(f"expected 1 to {MAX_MODELS} models, got {len(models)}")
    if len({model.name for model in models}) != len(models):
        raise A7SimError("expected every model once, got one twice")
    e = _equations(tuple(models), ground)
    scales, turns, shifts, free = _level_start(e)
    weights = np.repeat([1.0, 1.0, height_weight], e.model_of.size)
    for iteration in range(1, MAX_ITERATIONS + 1):
        design, missing = _linearised(e, scales, turns, shifts, free)
        normal, scale, solution = _solved(design, missing, weights)
        step = solution[: UNKNOWNS_OF_A_MODEL * len(models)].reshape((len(models), UNKNOWNS_OF_A_MODEL)).T
        turns = np.einsum(
            "ijm,jkm->ikm",
            rotation_from_vector(step[1:4] * np.minimum(1.0, 0.5 / length_of(step[1:4] + 1e-300))),
            turns,
        )
        scales = np.maximum(scales + step[0], scales / 3.0)
        shifts = shifts + step[4:]
        free = free + solution[UNKNOWNS_OF_A_MODEL * len(models) :]
        extent = scales[e.model_of] * length_of(e.local)
        moves = np.abs(step[0] / scales).max(), np.abs(step[1:4]).max(), np.abs(step[4:]).max() / extent.max()
        if max(moves) < CONVERGED:
            return _result(e, ground, (scales, turns, shifts, free), weights, iteration, normal, scale)
    raise Undetermined(
        f"the block of {pluralize(len(models), 'model')} does not converge in {MAX_ITERATIONS} iterations"
    )


def _equations(models: tuple[Model, ...], ground: Ground) -> _Equations:
    count: dict[str, int] = {}
    for model in models:
        for name in model.points:
            count[name] = count.get(name, 0) + 1
    known = ground.among(tuple(count))
    held = {name for name, role in zip(known.points, known.roles, strict=True) if role != "check"}
    points = tuple(sorted(name for name in count if count[name] > 1 or name in held))
    place = {name: i for i, name in enumerate(points)}
    given = np.full((3, len(points)), np.nan)
    for name, coordinates, used in zip(known.points, known.coordinates.T, known.used.T, strict=True):
        if name in place:
            given[:, place[name]] = np.where(used > 0.0, coordinates, np.nan)
    rows = [
        (m, place[name], i) for m, model in enumerate(models) for i, name in enumerate(model.points) if name in place
    ]
    if not rows:
        raise Undetermined("expected models with points in common, got none")
    middles = _middles(models)
    local = np.array([models[m].coordinates[:, i] - middles[:, m] for m, _, i in rows]).T
    column = np.full((3, len(points)), -1)
    unknown = ~np.isfinite(given)
    column.T[unknown.T] = np.arange(unknown.sum())
    model_of, point_of = (np.array([row[k] for row in rows], dtype=np.intp) for k in (0, 1))
    return _Equations(models, points, model_of, point_of, local, given, column, int(unknown.sum()))


def _sparse() -> Any:
    """Return scipy.sparse; it is slow to import and not needed elsewhere."""
    import_module("scipy.sparse.linalg")
    return import_module("scipy.sparse")


def _middles(models: Sequence[Model]) -> Array:
    return np.array([model.coordinates.mean(axis=1) for model in models]).T


def _level_start(e: _Equations) -> tuple[Array, Array, Array, Array]:
    """Return scales, rotations, shifts and free coordinates of level models:

    two unknowns for scale and azimuth, linear.
    """
    m, rows = len(e.models), e.model_of.size
    if np.isfinite(e.given[0]).sum() < 2:
        raise Undetermined(f"expected two control points in plan, got {int(np.isfinite(e.given[0]).sum())}")
    plan_free = np.full((2, len(e.points)), -1)
    open_plan = ~np.isfinite(e.given[:2])
    plan_free.T[open_plan.T] = np.arange(open_plan.sum())
    x, y = e.local[0], e.local[1]
    one, k, r = np.ones(rows), 4 * e.model_of, np.arange(rows)
    parts = [
        (r, k, x), (r, k + 1, -y), (r, k + 2, one),
        (r + rows, k, y), (r + rows, k + 1, x), (r + rows, k + 3, one),
    ]  # fmt: skip
    right = np.zeros(2 * rows)
    datum = np.nanmean(e.given[:2], axis=1)
    for c in range(2):
        place = plan_free[c, e.point_of]
        free = place >= 0
        parts.append((r[free] + c * rows, 4 * m + place[free], -one[free]))
        right[c * rows : (c + 1) * rows] = np.where(free, 0.0, e.given[c, e.point_of] - datum[c])
    i, j, v = (np.concatenate([part[q] for part in parts]) for q in range(3))
    design = _sparse().coo_array((v, (i, j)), shape=(2 * rows, 4 * m + int(open_plan.sum()))).tocsr()
    solution = _solved(design, right, np.ones(2 * rows))[2]
    a, b, tx, ty = solution[: 4 * m].reshape((m, 4)).T
    scales = np.hypot(a, b)
    if not (scales > 0.0).all():
        raise Undetermined("expected models with extent in plan, got one without")
    zero = np.zeros(m)
    turns = rotation(zero, zero, np.arctan2(b, a))
    moved = np.einsum("ijn,jn->in", turns[:, :, e.model_of], e.local) * scales[e.model_of]
    heights = _level_heights(e, moved[2])
    shifts = np.array([tx + datum[0], ty + datum[1], heights])
    placed = moved + shifts[:, e.model_of]
    total, number = np.zeros((3, len(e.points))), np.bincount(e.point_of, minlength=len(e.points))
    for c in range(3):
        total[c] = np.bincount(e.point_of, weights=placed[c], minlength=len(e.points)) / number
    free_coordinates = np.zeros(e.unknown)
    free_coordinates[e.column[e.column >= 0]] = total[e.column >= 0]
    return scales, turns, shifts, free_coordinates


def _level_heights(e: _Equations, z: Array) -> Array:
    """Return the shifts ``(m,)`` in height that move level models to the mean height of the control."""
    known = np.isfinite(e.given[2])
    if known.sum() < 3:
        raise Undetermined(f"expected three control points in height, got {int(known.sum())}")
    level = e.given[2][known].mean()
    number = np.bincount(e.model_of, minlength=len(e.models))
    return np.asarray(level - np.bincount(e.model_of, weights=z, minlength=len(e.models)) / number)


def _linearised(e: _Equations, scales: Array, turns: Array, shifts: Array, free: Array) -> tuple[Any, Array]:
    """Return the sparse design ``(3n, 7m + u)`` and the misclosures ``(3n,)`` at an approximation."""
    rows, m = e.model_of.size, len(e.models)
    turned = np.einsum("ijn,jn->in", turns[:, :, e.model_of], e.local)
    ground = np.where(e.column >= 0, free[e.column] if e.unknown else 0.0, e.given)
    missing = ground[:, e.point_of] - scales[e.model_of] * turned - shifts[:, e.model_of]
    blocks = similarity_columns(turned[:, None], scales[e.model_of], np.eye(3))[:, 0]
    r = np.arange(3 * rows).reshape((3, 1, rows))
    columns = (UNKNOWNS_OF_A_MODEL * e.model_of + np.arange(UNKNOWNS_OF_A_MODEL)[:, None])[None]
    i = np.broadcast_to(r, blocks.shape).reshape(-1)
    j = np.broadcast_to(columns, blocks.shape).reshape(-1)
    place = e.column[:, e.point_of]
    open_rows = r[:, 0][place >= 0]
    design = (
        _sparse()
        .coo_array(
            (
                np.concatenate([blocks.reshape(-1), -np.ones(open_rows.size)]),
                (
                    np.concatenate([i, open_rows]),
                    np.concatenate([j, UNKNOWNS_OF_A_MODEL * m + place[place >= 0]]),
                ),
            ),
            shape=(3 * rows, UNKNOWNS_OF_A_MODEL * m + e.unknown),
        )
        .tocsr()
    )
    return design, missing.reshape(-1)


def _solved(design: Any, right: Array, weights: Array) -> tuple[Any, Array, Array]:
    """Return scaled normal equations, their scale and the solution. Raises Undetermined where they are singular."""
    weighted = _sparse().diags_array(weights) @ design
    normal = (design.T @ weighted).tocsc()
    diagonal = normal.diagonal()
    if design.shape[0] < design.shape[1] or not (diagonal > 0.0).all():
        raise Undetermined(f"{design.shape[0]} equations leave some of {design.shape[1]} unknowns of the block open")
    scale = np.sqrt(diagonal)
    inverse_scale = _sparse().diags_array(1.0 / scale)
    normal = (inverse_scale @ normal @ inverse_scale).tocsc()
    try:
        factors = _sparse().linalg.splu(
            normal, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
        )
    except RuntimeError as error:
        raise Undetermined("the ties and the control leave some of the block's unknowns open") from error
    if np.abs(factors.U.diagonal()).min() < MIN_PIVOT:
        raise Undetermined("the ties and the control leave some of the block's unknowns open")
    return normal, scale, np.asarray(factors.solve((weighted.T @ right) / scale) / scale)


def _result(
    e: _Equations,
    ground: Ground,
    found: tuple[Array, Array, Array, Array],
    weights: Array,
    iterations: int,
    normal: Any,
    normal_scale: Array,
) -> BlockAdjustment:
    scales, turns, shifts, free = found
    _, missing = _linearised(e, scales, turns, shifts, free)
    residuals = -missing.reshape((3, -1))
    redundancy = missing.size - UNKNOWNS_OF_A_MODEL * len(e.models) - e.unknown
    share = redundancy / missing.size

    def s0_of(part: slice) -> float:
        v, w = residuals[part].reshape(-1), weights.reshape((3, -1))[part].reshape(-1)
        return float(np.sqrt((w * v * v).sum() / (share * v.size))) if redundancy > 0 else 0.0

    translations = shifts - scales * np.einsum("ijm,jm->im", turns, _middles(e.models))
    adjusted_points = np.where(e.column >= 0, free[e.column] if e.unknown else 0.0, e.given)
    places: dict[str, list[Array]] = {}
    for k, model in enumerate(e.models):
        moved = scales[k] * turns[:, :, k] @ model.coordinates + translations[:, k : k + 1]
        for i, name in enumerate(model.points):
            places.setdefault(name, []).append(moved[:, i])
    computed = {name: np.mean(each, axis=0) for name, each in places.items()}
    coordinates = dict(computed)
    coordinates.update(zip(e.points, adjusted_points.T, strict=True))
    names = tuple(coordinates)
    known = ground.among(names)
    fit = GroundFit(known, np.array([computed[name] for name in known.points]).reshape((-1, 3)).T)
    observed = tuple((e.models[m].name, e.points[p]) for m, p in zip(e.model_of, e.point_of, strict=True))
    return BlockAdjustment(
        names=tuple(model.name for model in e.models),
        scales=scales,
        rotations=turns,
        translations=translations,
        points=names,
        coordinates=np.array([coordinates[name] for name in names]).T,
        observed=observed,
        residuals=residuals,
        fit=fit,
        redundancy=redundancy,
        s0=s0_of(slice(0, 3)),
        s0_plan=s0_of(slice(0, 2)),
        s0_height=s0_of(slice(2, 3)),
        iterations=iterations,
        normal=normal,
        normal_scale=normal_scale,
    )
