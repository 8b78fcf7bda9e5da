"""Absolute orientation: a model or a strip into the system of the ground (S, equations 7 and 8)."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.similarity import (
    Similarity,
    similarity_by_iteration,
    similarity_by_quaternion,
)
from a7sim.reduction.strips import Model, Strip, is_centre

ROLES = ("control", "plan", "height", "check")
"""Uses of a ground point: all three coordinates, X and Y only, Z only, none."""

MIN_PLAN = 2
MIN_HEIGHTS = 3
NEARLY_IN_A_LINE = 0.05
"""Ratio of breadth to length of the height control, both as standard deviations, below which a warning is given."""
MUCH_WORSE = 3.0
"""Ratio of the misfits with the axes as given and swapped above which swapped axes are suspected."""
NOTHING = 1e-6
"""Misfit, as a share of the extent of the control, below which nothing is concluded about axes."""


@dataclass(frozen=True)
class Ground:
    """Ground points: names, coordinates ``(3, m)`` (X east, Y north, Z up; nan where unknown) and roles of `ROLES`."""

    points: tuple[str, ...]
    coordinates: Array
    roles: tuple[str, ...]

    def __post_init__(self) -> None:
        if not len(self.points) == self.coordinates.shape[1] == len(self.roles):
            raise ValueError(
                f"expected as many names, coordinates and roles, got {len(self.points)}, "
                f"{self.coordinates.shape[1]}, {len(self.roles)}"
            )
        if len(set(self.points)) != len(self.points):
            twice = next(name for name in self.points if self.points.count(name) > 1)
            raise A7SimError(f"ground point {twice}: expected every point once, got it twice")
        for name, role, given in zip(self.points, self.roles, np.isfinite(self.coordinates).T, strict=True):
            if role not in ROLES:
                raise A7SimError(f"ground point {name}: expected a role of {', '.join(ROLES)}, got {role!r}")
            needed = {"control": given.all(), "plan": given[:2].all(), "height": given[2], "check": given.any()}
            if not needed[role]:
                raise A7SimError(f"ground point {name}: expected the coordinates of a {role} point, got a gap")

    @property
    def used(self) -> Array:
        """Ones ``(3, m)`` where a coordinate is control, zeros elsewhere."""
        plan = [role in ("control", "plan") for role in self.roles]
        height = [role in ("control", "height") for role in self.roles]
        return np.array([plan, plan, height], dtype=float)

    def among(self, names: Sequence[str]) -> "Ground":
        """Return the ground points with one of the names, in their own order."""
        known = set(names)
        keep = sorted((i for i, name in enumerate(self.points) if name in known), key=lambda i: self.points[i])
        return Ground(
            tuple(self.points[i] for i in keep), self.coordinates[:, keep], tuple(self.roles[i] for i in keep)
        )


@dataclass(frozen=True)
class GroundFit:
    """Fit of a system of points to the ground.

    `residuals` ``(3, m, ...)`` are computed minus given in the unit of the ground, nan where nothing is given.
    """

    ground: Ground
    computed: Array

    @cached_property
    def residuals(self) -> Array:
        """Computed minus given ``(3, m, ...)``."""
        given = self.ground.coordinates
        return np.asarray(self.computed - given.reshape((*given.shape, *(1,) * (self.computed.ndim - 2))))

    @property
    def at_control(self) -> Array:
        """Residuals ``(3, m, ...)`` of the coordinates that are control, nan elsewhere."""
        return self._where(self.ground.used > 0.0)

    @property
    def at_checks(self) -> Array:
        """Residuals ``(3, m, ...)`` of the check points, nan elsewhere."""
        return self._where(
            np.broadcast_to([role == "check" for role in self.ground.roles], (3, len(self.ground.roles)))
        )

    def _where(self, counted: npt.NDArray[np.bool_]) -> Array:
        return np.asarray(
            np.where(counted.reshape((*counted.shape, *(1,) * (self.computed.ndim - 2))), self.residuals, np.nan)
        )


def root_mean_square(residuals: Array) -> Array:
    """Return the rms ``(3, ...)`` in X, Y and Z of residuals ``(3, m, ...)`` without the nan; nan where all are."""
    known = np.isfinite(residuals)
    squares = np.where(known, residuals, 0.0) ** 2
    count = known.sum(axis=1)
    return np.asarray(np.where(count > 0, np.sqrt(squares.sum(axis=1) / np.maximum(count, 1)), np.nan))


def max_abs_residual(residuals: Array) -> Array:
    """Return the largest absolute residual ``(3, ...)`` in X, Y and Z of ``(3, m, ...)``; nan where all are nan."""
    known = np.isfinite(residuals)
    return np.asarray(np.where(known.any(axis=1), np.where(known, np.abs(residuals), 0.0).max(axis=1), np.nan))


@dataclass(frozen=True)
class AbsoluteOrientation:
    """Model or strip in the system of the ground, with warnings for the surveyor (`warnings`)."""

    similarity: Similarity
    fit: GroundFit
    model: Model
    warnings: tuple[str, ...]


def absolute_orientation(model: Model | Strip, ground: Ground) -> AbsoluteOrientation:
    """Return the similarity of a model or strip to its ground control by least squares, unit weights.

    Coordinates of the model have shape ``(3, n, ...)`` with optional batch axes. Full control gives three equations a
    point, plan control two, height control one; at least seven, of two points in plan and three in height, are required
    (S). Warnings are given for ground axes that look left-handed, for height control nearly in a line and for ground
    points that the model does not contain. Raises Undetermined for too little control or control in a line.
    """
    model = model.as_model if isinstance(model, Strip) else model
    similarity, fit = fitted_to_ground(model, ground)
    oriented = Model(model.name, model.points, similarity.applied_to(model.coordinates))
    points = model.at(fit.ground.points)
    notes = [
        *_missing(ground, fit.ground),
        *_in_a_line(points, fit.ground),
        *_left_handed(model, similarity, points, fit),
    ]
    return AbsoluteOrientation(similarity, fit, oriented, tuple(notes))


def fitted_to_ground(model: Model, ground: Ground) -> tuple[Similarity, GroundFit]:
    """Return the similarity of a model to its ground control and the fit, as in `absolute_orientation`."""
    known = ground.among(model.points)
    plan, heights = int(known.used[0].sum()), int(known.used[2].sum())
    if plan < MIN_PLAN or heights < MIN_HEIGHTS:
        raise Undetermined(
            f"expected at least {MIN_PLAN} control points in plan and {MIN_HEIGHTS} in height in the model, "
            f"got {plan} and {heights}"
        )
    points = model.at(known.points)
    similarity = _fitted(points, known.coordinates, known.used)
    return similarity, GroundFit(known, similarity.applied_to(points))


def _fitted(points: Array, given: Array, used: Array) -> Similarity:
    """Return the similarity from the coordinates that are used.

    Points of full control, if three are not in a line, start the iteration from any attitude; otherwise the model is
    assumed nearly level (S).
    """
    full = used.all(axis=0)
    control = given[:, full].reshape((3, -1, *(1,) * (points.ndim - 2)))
    start = None
    try:
        found = similarity_by_quaternion(points[:, full], control)
        if full.sum() == used.any(axis=0).sum():
            return found
        start = found.rotation
    except Undetermined:
        if full.sum() == used.any(axis=0).sum():
            raise
    targets = np.where(used > 0.0, given, np.nan).reshape((*given.shape, *(1,) * (points.ndim - 2)))
    return similarity_by_iteration(points, targets, used, start)


def _missing(ground: Ground, known: Ground) -> list[str]:
    present = set(known.points)
    missing = [name for name in ground.points if name not in present]
    return [f"ground points that the model has not: {', '.join(missing)}"] if missing else []


def _in_a_line(points: Array, known: Ground) -> list[str]:
    """Return warnings about height control that hardly determines the tilt about its own line."""
    used = points[:, known.used[2] > 0.0]
    x, y = used[0] - used[0].mean(axis=0), used[1] - used[1].mean(axis=0)
    xx, yy, xy = (x * x).mean(axis=0), (y * y).mean(axis=0), (x * y).mean(axis=0)
    half, spread = (xx + yy) / 2.0, np.hypot((xx - yy) / 2.0, xy)
    ratio = np.sqrt(np.maximum(half - spread, 0.0) / (half + spread))
    worst = float(np.min(ratio))
    if worst >= NEARLY_IN_A_LINE:
        return []
    return [
        f"height control lies nearly in a line (breadth {worst:.3f} of its length): "
        "the tilt about it is weakly determined"
    ]


def _left_handed(model: Model, similarity: Similarity, points: Array, fit: GroundFit) -> list[str]:
    """Return warnings about axes X north, Y east: with Z up a left-handed system, which no rotation can reach."""
    advice = "X east, Y north and Z up are expected: swap the columns X and Y if X is north"
    known = fit.ground
    notes = []
    upside_down = _upside_down(model, similarity)
    swapped = Ground(known.points, known.coordinates[[1, 0, 2]], known.roles)
    try:
        other = _fitted(points, swapped.coordinates, swapped.used)
    except Undetermined:
        other = None
    if other is not None:
        other_fit = GroundFit(swapped, other.applied_to(points))
        upside_down = upside_down & ~_upside_down(model, other)
        extent = np.nanstd(known.coordinates, axis=1).max()
        here, present = _misfit(fit), _misfit(other_fit)
        worse = (here > MUCH_WORSE * present) & (here > NOTHING * extent)
        if worse.any():
            ratio = float(np.max(here / np.maximum(present, NOTHING * extent)))
            notes.append(
                f"the ground axes look left-handed: the control fits {ratio:.0f} times better with X and Y swapped; "
                f"{advice}"
            )
    if not notes and upside_down.any():
        notes.append(
            f"the ground axes look left-handed: the model comes out upside down, its heights inverted; {advice}"
        )
    return notes


def _upside_down(model: Model, similarity: Similarity) -> npt.NDArray[np.bool_]:
    """Return where the projection centres, or without them the model's own Z, point downwards."""
    centres = [name for name in model.points if is_centre(name)]
    others = [name for name in model.points if not is_centre(name)]
    if centres and others:
        upward = model.at(centres).mean(axis=1) - model.at(others).mean(axis=1)
        return np.asarray((similarity.rotation[2] * upward).sum(axis=0) < 0.0)
    return np.asarray(similarity.rotation[2, 2] < 0.0)


def _misfit(fit: GroundFit) -> Array:
    """Return the rms of all residuals, at control and checks, ``(...)``."""
    return np.asarray(np.sqrt(np.nanmean(fit.residuals**2, axis=(0, 1))))
