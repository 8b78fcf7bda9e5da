"""Statistics of a study: spreads with intervals, paired comparisons of cells, variance by factor.

Replicates with the same number share their random numbers in all cells. Cells are therefore compared replicate by
replicate, and replicates are the blocks of the analysis of variance.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array

CONFIDENCE = 0.95
QUANTILES = (0.05, 0.5, 0.95)
RESAMPLES = 999
_DRAWN_AT_ONCE = 1_000_000
_NOTHING = 1e-24
_PLACES, _MAX_IN_A_DENSITY = 121, 20_000
_STREAM = 10
"""Spawn key of the bootstrap resamples."""

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
    """Return the bootstrap interval of the standard deviation of values ``(n,)``; seed and key determine it."""
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
    """Return a quantile of values ``(n,)`` and its bootstrap interval for infinitely many resamples.

    Each value stands for `counts` ``(n,)`` values, or for itself. The k-th of n ordered values is in a resample the
    value at position n B, where B is Beta(k, n - k + 1).
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


def densities(values: Mapping[str, Array]) -> dict[str, Any]:
    """Return Gaussian kernel densities of values ``(n,)`` by name on common positions; empty if no value varies.

    Bandwidths by Scott's rule. The positions contain all but the outermost 0.2 % on either side.
    """
    known = {name: each[np.isfinite(each)] for name, each in values.items()}
    varying = {name: each for name, each in known.items() if each.size > 2 and np.ptp(each) > 0.0}
    if not varying:
        return {}
    from scipy.stats import gaussian_kde  # noqa: PLC0415

    low, high = np.quantile(np.concatenate(list(varying.values())), (0.002, 0.998))
    margin = 0.1 * (high - low)
    places = np.linspace(low - margin, high + margin, _PLACES)
    if min(float(each.min()) for each in varying.values()) >= 0.0:
        places = np.linspace(max(0.0, low - margin), high + margin, _PLACES)
    return {
        "places": _rounded(places),
        "densities": {name: _rounded(gaussian_kde(each[:_MAX_IN_A_DENSITY])(places)) for name, each in varying.items()},
    }


def _rounded(values: Array) -> list[float]:
    return [float(f"{each:.6g}") for each in values.tolist()]


def binned(values: Array, on: Array, bins: int = 10) -> dict[str, list[float]]:
    """Return means of values ``(cells, n)`` and of the values they depend on, in bins of equal number.

    The intervals of the means treat values as independent; they are for a figure.
    """
    both = np.isfinite(values) & np.isfinite(on)
    y, x = values[both], on[both]
    parts = [part for part in np.array_split(np.argsort(x, kind="stable"), bins) if part.size > 1]
    intervals = [mean_interval(float(y[part].mean()), float(y[part].std(ddof=1)), part.size) for part in parts]
    return {
        "on": _rounded(np.array([x[part].mean() for part in parts])),
        "mean": _rounded(np.array([y[part].mean() for part in parts])),
        "low": _rounded(np.array([low for low, _ in intervals])),
        "high": _rounded(np.array([high for _, high in intervals])),
    }


@dataclass(frozen=True)
class CellComparison:
    """Replicates of a cell minus the replicates of another cell, in pairs."""

    pairs: int
    difference: float
    interval: Interval
    sd: float
    """Standard deviation of the differences."""
    effect: float
    """Difference in standard deviations of one replicate, pooled over both cells (Cohen's d)."""
    effect_interval: Interval
    p: float
    """Probability of no difference, by the paired t test."""


def compare_cells(values: Array, against: Array) -> CellComparison:
    """Compare replicates ``(n,)`` with the same replicates in another cell, or ``(cells, n)`` in several cells.

    Several cells are averaged replicate by replicate. A replicate that gave up in any cell is left out. The interval of
    the effect is by its influence function for independent replicates and needs no normal distribution.
    """
    values, against = np.atleast_2d(values), np.atleast_2d(against)
    n = min(values.shape[1], against.shape[1])
    values, against = values[:, :n], against[:, :n]
    whole = np.isfinite(values).all(axis=0) & np.isfinite(against).all(axis=0)
    values, against = values[:, whole], against[:, whole]
    pairs = values.shape[1]
    if pairs < 2:
        return CellComparison(pairs, math.nan, _UNKNOWN, math.nan, math.nan, _UNKNOWN, math.nan)
    from scipy.stats import t  # noqa: PLC0415

    differences = values.mean(axis=0) - against.mean(axis=0)
    mean, sd = float(differences.mean()), float(differences.std(ddof=1))
    squares = (_squares(values) + _squares(against)) / 2.0
    variance = float(squares.sum()) / (pairs - 1)
    effect = _ratio(mean, math.sqrt(variance))
    deviations = _ratio(mean, sd) * math.sqrt(pairs)
    p = 2.0 * float(t.sf(abs(deviations), pairs - 1))
    influence = (differences - mean) / math.sqrt(variance) - effect / 2.0 * (squares / variance) if variance else None
    spread = mean_interval(effect, float(influence.std(ddof=1)), pairs) if influence is not None else _UNKNOWN
    return CellComparison(pairs, mean, mean_interval(mean, sd, pairs), sd, effect, spread, p)


def _squares(values: Array) -> Array:
    """Return the squared deviations ``(n,)`` of values ``(cells, n)`` from the means of their cells, averaged over
    cells.
    """
    return np.asarray(((values - values.mean(axis=1, keepdims=True)) ** 2).mean(axis=0))


@dataclass(frozen=True)
class Dependence:
    """Relation of two responses in the same cells after removal of the differences between cells."""

    replicates: int
    slope: float
    """Change of the first response per unit of the other."""
    interval: Interval
    correlation: float
    correlation_interval: Interval
    p: float
    """Probability of no relation; cells share replicates, which therefore count once (cluster-robust)."""


def regress_on(values: Array, on: Array) -> Dependence:
    """Regress values ``(cells, n)`` on another response ``(cells, n)``.

    The interval of the correlation is by its influence function and Fisher's transformation.
    """
    whole = np.isfinite(values).all(axis=0) & np.isfinite(on).all(axis=0)
    y, x = (each[:, whole] for each in (values, on))
    n = y.shape[1]
    if n < 3:
        return Dependence(n, math.nan, _UNKNOWN, math.nan, _UNKNOWN, math.nan)
    x, y = (each - each.mean(axis=1, keepdims=True) for each in (x, y))
    xx, xy, yy = ((one * other).sum(axis=0) for one, other in ((x, x), (x, y), (y, y)))
    if not (xx.sum() > 0.0 and yy.sum() > 0.0):
        return Dependence(n, math.nan, _UNKNOWN, math.nan, _UNKNOWN, math.nan)
    from scipy.stats import t  # noqa: PLC0415

    slope = float(xy.sum() / xx.sum())
    spread = float((xy - slope * xx).std(ddof=1)) * n / float(xx.sum())
    p = 2.0 * float(t.sf(abs(_ratio(slope, spread)) * math.sqrt(n), n - 1))
    r = float(xy.sum() / math.sqrt(xx.sum() * yy.sum()))
    influence = xy / math.sqrt(xx.mean() * yy.mean()) - r / 2.0 * (xx / xx.mean() + yy / yy.mean())
    within = max(1.0 - r * r, 1e-12)
    low, high = mean_interval(math.atanh(min(max(r, -1.0 + 1e-12), 1.0 - 1e-12)), float(influence.std()) / within, n)
    return Dependence(n, slope, mean_interval(slope, spread, n), r, (math.tanh(low), math.tanh(high)), p)


def _ratio(mean: float, sd: float) -> float:
    """Return a mean in standard deviations, also if nothing varies."""
    if sd > 0.0:
        return mean / sd
    return math.copysign(math.inf, mean) if mean else 0.0


def holm(ps: Sequence[float]) -> list[float]:
    """Return probabilities adjusted for their number (Holm's step-down method); nan stays and does not count."""
    known = sorted((p, i) for i, p in enumerate(ps) if not math.isnan(p))
    adjusted = [math.nan] * len(ps)
    highest = 0.0
    for rank, (p, i) in enumerate(known):
        highest = max(highest, min(1.0, (len(known) - rank) * p))
        adjusted[i] = highest
    return adjusted


@dataclass(frozen=True)
class Effect:
    """Line of an analysis of variance."""

    source: tuple[str, ...]
    """Factors, several for an interaction; empty for the remainder."""
    squares: float
    freedom: int
    remaining: float
    """Sum of squares of its interaction with the replicates, against which it is tested."""
    F: float
    p: float
    """With Greenhouse-Geisser degrees of freedom, since the replicate effects of two levels may be correlated."""
    epsilon: float
    """Factor by which both degrees of freedom are multiplied for p."""
    partial_eta_squared: float
    """Its sum of squares as a share of itself and its remainder."""


def variance_by_factor(values: Array, factors: Sequence[str]) -> list[Effect]:
    """Return the analysis of variance of values ``(levels of factor 1, levels of factor 2, ..., replicates)``.

    A fixed-effects full factorial with replicates as blocks (repeated measures): each factor and interaction is tested
    against its own interaction with the replicates, so that cells that share a session do not count twice; the last
    line is the remainder. Replicates without a value in any cell are left out; the result is empty if fewer than two
    are complete.
    """
    whole = np.isfinite(values).all(axis=tuple(range(values.ndim - 1)))
    values = values[..., whole]
    if values.shape[-1] < 2:
        return []
    size = float((values**2).mean(axis=-1).sum()) * values.shape[-1]
    effects = [
        _effect(tuple(factors[axis] for axis in axes), part, values.shape[:-1], size)
        for axes, part in _parts(values).items()
    ]
    left = math.fsum(each.remaining for each in effects)
    freedom = (math.prod(values.shape[:-1]) - 1) * (values.shape[-1] - 1)
    return [*effects, Effect((), left, freedom, math.nan, math.nan, math.nan, math.nan, math.nan)]


def _effect(source: tuple[str, ...], part: Array, shape: Sequence[int], size_of_all: float) -> Effect:
    """Return the line of an effect from its contribution to each replicate ``(levels or 1, ..., replicates)``.

    A sum of squares at the level of the rounding errors of `size_of_all` counts as zero.
    """
    from scipy.stats import f  # noqa: PLC0415

    n = part.shape[-1]
    freedom = math.prod(levels - 1 for levels in part.shape[:-1] if levels > 1)
    cells = math.prod(shape) // math.prod(part.shape[:-1])
    mean = part.mean(axis=-1)
    off = (part - mean[..., None]).reshape(-1, n)
    squares, left = cells * n * float((mean**2).sum()), cells * float((off**2).sum())
    if squares + left <= _NOTHING * size_of_all:
        return Effect(source, 0.0, freedom, 0.0, math.nan, math.nan, 1.0, math.nan)
    together = off @ off.T
    size = float((together**2).sum())
    epsilon = min(1.0, max(1.0 / freedom, float(np.trace(together)) ** 2 / (freedom * size))) if size > 0.0 else 1.0
    noise = left / (freedom * (n - 1))
    ratio = squares / freedom / noise if noise > 0.0 else math.inf if squares > 0.0 else math.nan
    p = float(f.sf(ratio, epsilon * freedom, epsilon * freedom * (n - 1)))
    share = squares / (squares + left) if squares + left > 0.0 else math.nan
    return Effect(source, squares, freedom, left, ratio, p, epsilon, share)


def _parts(values: Array) -> Mapping[tuple[int, ...], Array]:
    """Return the contribution of each factor and interaction to each replicate, by its axes, broadcastable to all
    values.
    """
    axes = range(values.ndim - 1)
    parts: dict[tuple[int, ...], Array] = {(): values.mean(axis=tuple(axes), keepdims=True)}
    for order in range(1, len(axes) + 1):
        for chosen in combinations(axes, order):
            others = tuple(axis for axis in axes if axis not in chosen)
            mean = values.mean(axis=others, keepdims=True) if others else values
            parts[chosen] = mean - sum((part for of, part in parts.items() if set(of) < set(chosen)), np.zeros(()))
    del parts[()]
    return parts
