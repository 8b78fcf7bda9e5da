"""Statistics of a study: spreads with their intervals, cells compared in pairs, variance by factor.

Replicates with the same number share their random numbers in every cell, so that cells are compared replicate by
replicate and replicates are the blocks of the analysis of variance.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array

CONFIDENCE = 0.95
QUANTILES = (0.05, 0.5, 0.95)
RESAMPLES = 999
_DRAWN_AT_ONCE = 1_000_000
_STREAM = 10
"""Spawns the resamples of the bootstrap."""

Interval = tuple[float, float]
_UNKNOWN = (math.nan, math.nan)


def mean_interval(mean: float, sd: float, count: int) -> Interval:
    """Return the interval of a mean by Student's t."""
    if count < 2:
        return _UNKNOWN
    from scipy.stats import t  # noqa: PLC0415

    half = float(t.ppf(0.5 + CONFIDENCE / 2.0, count - 1)) * sd / math.sqrt(count)
    return mean - half, mean + half


def sd_interval(values: Array, seed: int, key: Sequence[int]) -> Interval:
    """Return the bootstrap interval of the standard deviation of values ``(n,)``; the same seed and key, the same."""
    if values.size < 2:
        return _UNKNOWN
    rng = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(_STREAM, *key)))
    together = max(1, _DRAWN_AT_ONCE // values.size)
    sds = [
        values[rng.integers(values.size, size=(min(together, RESAMPLES - begun), values.size))].std(axis=1, ddof=1)
        for begun in range(0, RESAMPLES, together)
    ]
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = np.quantile(np.concatenate(sds), (tail, 1.0 - tail))
    return float(low), float(high)


def quantile_with_interval(
    values: Array, share: float, counts: npt.NDArray[np.int64] | None = None
) -> tuple[float, Interval]:
    """Return a quantile of values ``(n,)`` and its bootstrap interval, that of infinitely many resamples.

    Each value stands for as many as `counts` says ``(n,)``, otherwise for itself. The k-th of n in order is in a
    resample the value at place n B, where B is Beta(k, n - k + 1).
    """
    if values.size == 0:
        return math.nan, _UNKNOWN
    from scipy.stats import beta  # noqa: PLC0415

    order = np.argsort(values, kind="stable")
    through = np.cumsum(np.ones(values.size, dtype=np.int64) if counts is None else counts[order])
    n = int(through[-1])

    def at(place: int) -> float:
        return float(values[order[np.searchsorted(through, place)]])

    k = min(n, max(1, math.ceil(share * n)))
    tail = (1.0 - CONFIDENCE) / 2.0
    low, high = (min(n, int(n * float(beta.ppf(each, k, n - k + 1))) + 1) for each in (tail, 1.0 - tail))
    return at(k), (at(low), at(high))


@dataclass(frozen=True)
class Comparison:
    """A cell's replicates minus those of another, pair by pair."""

    pairs: int
    difference: float
    interval: Interval
    sd: float
    """Of the differences."""
    effect: float
    """The difference in standard deviations of one replicate, both cells pooled (Cohen's d)."""
    p: float
    """Of no difference, by the paired t test."""


def compared(values: Array, against: Array) -> Comparison:
    """Compare replicates ``(n,)`` with those of the same numbers in another cell; who gave up in either is left out."""
    n = min(values.size, against.size)
    both = np.isfinite(values[:n]) & np.isfinite(against[:n])
    one, other = values[:n][both], against[:n][both]
    pairs = int(both.sum())
    if pairs < 2:
        return Comparison(pairs, math.nan, _UNKNOWN, math.nan, math.nan, math.nan)
    from scipy.stats import t  # noqa: PLC0415

    differences = one - other
    mean, sd = float(differences.mean()), float(differences.std(ddof=1))
    pooled = math.sqrt((float(one.var(ddof=1)) + float(other.var(ddof=1))) / 2.0)
    deviations = _ratio(mean, sd) * math.sqrt(pairs)
    p = 2.0 * float(t.sf(abs(deviations), pairs - 1))
    return Comparison(pairs, mean, mean_interval(mean, sd, pairs), sd, _ratio(mean, pooled), p)


def _ratio(mean: float, sd: float) -> float:
    """Return how many standard deviations a mean is, also where nothing varies."""
    if sd > 0.0:
        return mean / sd
    return math.copysign(math.inf, mean) if mean else 0.0


def holm(ps: Sequence[float]) -> list[float]:
    """Return probabilities adjusted for as many comparisons (Holm's step-down method); nan stays and does not count."""
    known = sorted((p, i) for i, p in enumerate(ps) if not math.isnan(p))
    adjusted = [math.nan] * len(ps)
    highest = 0.0
    for rank, (p, i) in enumerate(known):
        highest = max(highest, min(1.0, (len(known) - rank) * p))
        adjusted[i] = highest
    return adjusted


@dataclass(frozen=True)
class Effect:
    """A line of an analysis of variance."""

    source: tuple[str, ...]
    """The factors, several for an interaction; empty for what remains."""
    squares: float
    freedom: int
    F: float
    p: float
    partial_eta_squared: float
    """Its share of its own and the remaining squares."""


def variance_by_factor(values: Array, factors: Sequence[str]) -> list[Effect]:
    """Return the analysis of variance of values ``(levels of factor 1, levels of factor 2, ..., replicates)``.

    A fixed-effects full factorial whose blocks are the replicates; every factor and interaction, and last what remains.
    Replicates that lack a value in any cell are left out; nothing is returned where fewer than two are whole.
    """
    whole = np.isfinite(values).all(axis=tuple(range(values.ndim - 1)))
    values = values[..., whole]
    n = values.shape[-1]
    if n < 2:
        return []
    from scipy.stats import f  # noqa: PLC0415

    cell_means = values.mean(axis=-1)
    parts = _parts(cell_means)
    total = float(((values - values.mean()) ** 2).sum())
    cells = int(np.prod(cell_means.shape))
    blocks = values.mean(axis=tuple(range(values.ndim - 1)))
    between = cells * float(((blocks - blocks.mean()) ** 2).sum())
    squares = {axes: n * float((np.broadcast_to(part, cell_means.shape) ** 2).sum()) for axes, part in parts.items()}
    freedom = {axes: math.prod(cell_means.shape[axis] - 1 for axis in axes) for axes in parts}
    left = max(0.0, total - between - math.fsum(squares.values()))
    left_freedom = (cells - 1) * (n - 1)
    noise = left / left_freedom
    effects = []
    for axes in parts:
        ratio = squares[axes] / freedom[axes] / noise if noise > 0.0 else math.inf if squares[axes] > 0.0 else math.nan
        p = float(f.sf(ratio, freedom[axes], left_freedom))
        own = squares[axes] + left
        share = squares[axes] / own if own > 0.0 else math.nan
        effects.append(Effect(tuple(factors[axis] for axis in axes), squares[axes], freedom[axes], ratio, p, share))
    return [*effects, Effect((), left, left_freedom, math.nan, math.nan, math.nan)]


def _parts(means: Array) -> Mapping[tuple[int, ...], Array]:
    """Return what every factor and interaction adds to cell means, by its axes, each broadcastable to them."""
    axes = range(means.ndim)
    parts: dict[tuple[int, ...], Array] = {(): means.mean(keepdims=True)}
    for order in range(1, means.ndim + 1):
        for chosen in combinations(axes, order):
            others = tuple(axis for axis in axes if axis not in chosen)
            below = sum((part for of, part in parts.items() if set(of) < set(chosen)), np.zeros_like(means[:1]) * 0.0)
            parts[chosen] = means.mean(axis=others, keepdims=True) - below if others else means - below
    del parts[()]
    return parts
