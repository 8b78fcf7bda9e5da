"""Strips of independent models: each joined to the previous one on common points and the common projection centre."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array, length_of, mxv
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.similarity import Similarity, similarity_by_quaternion

CENTRE = ":centre"
"""Ending of the name of a projection centre: ``<photo>:centre``."""

MIN_COMMON = 3
"""Common points, including the centre, required to join two models."""

JoinMethod = Literal["points", "centre", "heights"]
"""Method of joining a model to the strip: see `formed_strip`."""


@dataclass(frozen=True)
class Model:
    """An independent model or a strip: names of points and their coordinates ``(3, n, ...)``.

    Projection centres are points named ``<photo>:centre``.
    """

    name: str
    points: tuple[str, ...]
    coordinates: Array

    def __post_init__(self) -> None:
        if len(self.points) != self.coordinates.shape[1]:
            raise ValueError(f"expected coordinates of {len(self.points)} points, got {self.coordinates.shape[1]}")
        if len(set(self.points)) != len(self.points):
            twice = next(name for name in self.points if self.points.count(name) > 1)
            raise A7SimError(f"model {self.name}: expected every point once, got {twice} twice")

    @property
    def centres(self) -> tuple[str, ...]:
        """Names of the projection centres among the points."""
        return tuple(name for name in self.points if is_centre(name))

    def at(self, names: Sequence[str]) -> Array:
        """Return the coordinates ``(3, len(names), ...)`` of named points."""
        place = {name: i for i, name in enumerate(self.points)}
        return self.coordinates[:, [place[name] for name in names]]

    def without(self, point: str) -> "Model":
        """Return the model without a point."""
        keep = [i for i, name in enumerate(self.points) if name != point]
        return Model(self.name, tuple(self.points[i] for i in keep), self.coordinates[:, keep])


@dataclass(frozen=True)
class Join:
    """Connection of a model to the previous one.

    `differences` ``(3, n, ...)`` are the closing differences at the common points, the new model's coordinates in the
    strip minus those of the previous model, in the unit of the strip.
    """

    before: str
    after: str
    points: tuple[str, ...]
    similarity: Similarity
    differences: Array

    @property
    def scale(self) -> Array:
        """Scale ``(...)`` of the new model against the strip."""
        return self.similarity.scale

    @property
    def max_residual(self) -> Array:
        """Largest closing difference ``(...)`` in any coordinate."""
        return np.asarray(np.abs(self.differences).max(axis=(0, 1)))

    @property
    def rms(self) -> Array:
        """Root mean square ``(3, ...)`` of the closing differences in X, Y and Z."""
        return np.asarray(np.sqrt((self.differences**2).mean(axis=1)))


@dataclass(frozen=True)
class Strip:
    """Strip: its models transformed into the system of the first, and their joins."""

    models: tuple[Model, ...]
    joins: tuple[Join, ...]

    @cached_property
    def as_model(self) -> Model:
        """The strip as one model, points of several models averaged."""
        names: dict[str, list[Array]] = {}
        for model in self.models:
            for i, name in enumerate(model.points):
                names.setdefault(name, []).append(model.coordinates[:, i])
        means = [sum(found[1:], found[0]) / len(found) for found in names.values()]
        return Model("strip", tuple(names), np.stack(means, axis=1))

    @property
    def points(self) -> tuple[str, ...]:
        """Names of the points in order of first occurrence."""
        return self.as_model.points

    @property
    def coordinates(self) -> Array:
        """Strip coordinates ``(3, n, ...)``, averaged at tie points."""
        return self.as_model.coordinates

    def deviations(self, model: Model) -> Array:
        """Return the differences of a model's points ``(3, n, ...)`` from the means."""
        return np.asarray(model.coordinates - self.as_model.at(model.points))

    def transformed(self, similarity: Similarity) -> "Strip":
        """Return the strip in another system; joins stay as computed."""
        moved = (Model(m.name, m.points, similarity.applied_to(m.coordinates)) for m in self.models)
        return Strip(tuple(moved), self.joins)


def is_centre(name: str) -> bool:
    """Return whether a point's name is that of a projection centre."""
    return name.endswith(CENTRE)


def formed_strip(models: Sequence[Model], method: JoinMethod = "points") -> Strip:
    """Return the strip of independent models, in the system of the model at the end that was given first.

    Models may be in any order: they are chained by their common centres. Methods: ``points``, a similarity on all
    common points and the common centre alike (P 2.1-2.7); ``centre``, the origins moved to the common centre, rotation
    and scale from the vectors to the common points (T 2.35-2.39); ``heights``, the same with the mean ratio of the
    common points' heights below the centre as scale (S). Batch axes of the coordinates are kept. Raises A7SimError for
    models that form no chain, Undetermined for common points that do not determine a join.
    """
    chain = in_order(models)
    placed = [chain[0]]
    joins: list[Join] = []
    for new in chain[1:]:
        join = joined(placed[-1], new, method)
        joins.append(join)
        placed.append(Model(new.name, new.points, join.similarity.applied_to(new.coordinates)))
    return Strip(tuple(placed), tuple(joins))


def joined(before: Model, new: Model, method: JoinMethod = "points") -> Join:
    """Return the join of a model to a model of the strip (see `formed_strip`).

    Raises A7SimError for fewer than three common points, or without a common centre if the method needs it;
    Undetermined for common points in a line.
    """
    present = set(before.points)
    common = tuple(sorted(name for name in new.points if name in present))
    if len(common) < MIN_COMMON:
        raise A7SimError(
            f"models {before.name} and {new.name}: expected at least {MIN_COMMON} common points with the centre, "
            f"got {len(common)} ({', '.join(common) or 'none'})"
        )
    source, target = new.at(common), before.at(common)
    try:
        found = _on_points(source, target) if method == "points" else _on_centre(before, new, common, method)
    except Undetermined as error:
        raise Undetermined(f"models {before.name} and {new.name}: {error}") from error
    return Join(before.name, new.name, common, found, found.residuals)


def _on_points(source: Array, target: Array) -> Similarity:
    return similarity_by_quaternion(source, target)


def _on_centre(before: Model, new: Model, common: tuple[str, ...], method: JoinMethod) -> Similarity:
    centres = [name for name in common if is_centre(name)]
    if len(centres) != 1:
        raise A7SimError(
            f"models {before.name} and {new.name}: expected one common projection centre (<photo>{CENTRE}), "
            f"got {', '.join(centres) or 'none'}"
        )
    others = [name for name in common if not is_centre(name)]
    origin, target_origin = new.at(centres)[:, 0], before.at(centres)[:, 0]
    vectors, targets = new.at(others) - origin[:, None], before.at(others) - target_origin[:, None]
    # A vector and its opposite have their centroid in the centre: the rotation and scale are then about it.
    both = similarity_by_quaternion(
        np.concatenate([vectors, -vectors], axis=1), np.concatenate([targets, -targets], axis=1)
    )
    scale = both.scale
    if method == "heights":
        turned = np.einsum("ij...,jn...->in...", both.rotation, vectors)
        if not (np.abs(turned[2]) > 0.01 * length_of(turned)).all():
            raise Undetermined("expected common points below the centre, got one at its height")
        scale = (targets[2] / turned[2]).mean(axis=0)
    translation = target_origin - scale * mxv(both.rotation, origin)
    return Similarity(np.asarray(scale), both.rotation, translation, new.at(common), before.at(common))


def in_order(models: Sequence[Model]) -> tuple[Model, ...]:
    """Return the models in their order along the strip.

    Neighbours share a projection centre; the strip starts at the end that was given first. Models without any common
    centre keep the order given. Raises A7SimError for repeated names, branches, rings and gaps.
    """
    if not models:
        raise A7SimError("expected the models of a strip, got none")
    names = [model.name for model in models]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise A7SimError(f"expected every model once, got model {twice} twice")
    having: dict[str, list[int]] = {}
    for i, model in enumerate(models):
        for centre in model.centres:
            having.setdefault(centre, []).append(i)
    neighbours: dict[int, set[int]] = {i: set() for i in range(len(models))}
    for centre, members in having.items():
        if len(members) > 2:
            shown = ", ".join(names[i] for i in members)
            raise A7SimError(f"centre {centre}: expected at most two models of a strip to share it, got {shown}")
        if len(members) == 2:
            neighbours[members[0]].add(members[1])
            neighbours[members[1]].add(members[0])
    if not any(neighbours.values()):
        return tuple(models)
    ends = [i for i in range(len(models)) if len(neighbours[i]) <= 1]
    if not ends:
        raise A7SimError("expected a strip with two ends, got models in a ring")
    order, seen = [ends[0]], {ends[0]}
    while following := neighbours[order[-1]] - seen:
        order.append(min(following))
        seen.add(order[-1])
    if len(order) < len(models):
        left = next(names[i] for i in range(len(models)) if i not in seen)
        raise A7SimError(
            f"model {left}: expected a projection centre in common with the strip of model {names[order[0]]}, got none"
        )
    return tuple(models[i] for i in order)
