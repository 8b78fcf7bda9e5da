"""Main effects of the factors of a Latin hypercube: shares of the variance between cells, and signs.

Each cell has its own values of all factors, so nothing repeats and an analysis of variance is not possible. Instead one
curve per factor is fitted jointly to the means of the cells: a polynomial for a range, steps for levels. The share of a
factor is the variance of its curve (main effect, first-order index). The remainder is interactions, deviations from the
curves, and noise.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from a7sim.geometry import Array
from a7sim.study.statistics import CONFIDENCE, Interval

MIN_CELLS = 10
"""Minimum number of cells for this analysis."""

MAX_DEGREES = 8
CELLS_A_COEFFICIENT = 5
"""The degree of a polynomial leaves this number of cells per coefficient."""

_UNKNOWN = (math.nan, math.nan)


@dataclass(frozen=True)
class MainEffect:
    """Effect of one factor alone on the means of cells."""

    factor: str
    share: float
    """Share of the variance between cells, 0 to 1, corrected for the noise that a curve absorbs."""
    interval: Interval
    p: float
    """Probability of no effect, by the F test of the curve."""
    slope: float
    """Standardised coefficient of its ranks among the ranks of all factors, -1 to 1; nan for a factor without order."""
    slope_interval: Interval


def main_effects(means: Array, factors: Mapping[str, Array | Sequence[str]]) -> list[MainEffect]:
    """Return the main effect of each factor on means ``(cells,)``; empty for too few cells or equal means.

    Factor values by name are numbers ``(cells,)`` of a range, or labels of levels. Cells with a nan mean are left out.
    Intervals are jackknife intervals over cells.
    """
    known = np.isfinite(means)
    means = means[known]
    values = {name: np.asarray(each)[known] for name, each in factors.items()}
    degrees = max(1, min(MAX_DEGREES, means.size // (CELLS_A_COEFFICIENT * max(1, len(values)))))
    curves = {name: _curve(each, degrees) for name, each in values.items()}
    coefficients = 1 + sum(each.shape[1] for each in curves.values())
    if means.size < max(MIN_CELLS, coefficients + 2) or not np.ptp(means) > 0.0:
        return []
    from scipy.stats import f  # noqa: PLC0415

    fit = _Fit(np.concatenate([np.ones((means.size, 1)), *curves.values()], axis=1), means)
    ordered = {name: _standardised(_ranks(each.astype(float))) for name, each in values.items() if _is_range(each)}
    ranks = _Fit(np.array([*ordered.values()]).T.reshape(means.size, -1), _standardised(_ranks(means)))
    slopes = dict(zip(ordered, zip(ranks.found, ranks.without.T, strict=True), strict=True))
    effects = []
    begin = 1
    for name, curve in curves.items():
        of_curve = slice(begin, begin + curve.shape[1])
        begin = of_curve.stop
        share, jackknifed = fit.share(of_curve)
        p = float(f.sf(fit.ratio(of_curve), curve.shape[1], fit.freedom))
        slope, without = slopes.get(name, (math.nan, np.zeros(0)))
        effects.append(
            MainEffect(
                name,
                min(1.0, max(0.0, share)),
                _interval(share, jackknifed, 0.0),
                p,
                float(slope),
                _interval(float(slope), without, -1.0) if without.size else _UNKNOWN,
            )
        )
    return effects


def noise_share(values: Array) -> float:
    """Return the share of noise in the variance between the means of cells, from values ``(cells, replicates)``.

    Replicates are blocks: what they share in all cells changes no difference between cells. nan if unknown.
    """
    values = values[np.isfinite(values).any(axis=1)]
    values = values[:, np.isfinite(values).all(axis=0)]
    cells, n = values.shape
    if cells < 2 or n < 2:
        return math.nan
    means = values.mean(axis=1, keepdims=True)
    between = float(means.var(ddof=1))
    left = values - means - values.mean(axis=0) + values.mean()
    chance = float((left**2).sum()) / ((cells - 1) * (n - 1)) / n
    return min(1.0, chance / between) if between > 0.0 else math.nan


class _Fit:
    """Least-squares fit ``(cells, coefficients)`` and the fits without each cell in turn."""

    def __init__(self, design: Array, means: Array) -> None:
        self.design, self.means = design, means
        self.cofactors = np.linalg.pinv(design.T @ design)
        self.found = self.cofactors @ design.T @ means
        self.residuals = means - design @ self.found
        self.freedom = means.size - int(np.linalg.matrix_rank(design)) if design.size else means.size

    @cached_property
    def without(self) -> Array:
        """Coefficients ``(cells, coefficients)`` without each cell."""
        leverage = np.einsum("ij,jk,ik->i", self.design, self.cofactors, self.design)
        moved = self.residuals / np.maximum(1.0 - leverage, 1e-12)
        return np.asarray(self.found - moved[:, None] * (self.design @ self.cofactors))

    def share(self, of: slice) -> tuple[float, Array]:
        """Return the share of some coefficients in the variance of the means, and the same without each cell."""
        centred = self.design[:, of] - self.design[:, of].mean(axis=0)
        spread = centred.T @ centred / self.means.size
        chance = float((self.residuals**2).sum()) / self.freedom * float(np.trace(spread @ self.cofactors[of, of]))
        n, deviations = self.means.size, self.means - self.means.mean()
        total = float((deviations**2).mean())
        totals = (n * total - deviations**2 * n / (n - 1)) / (n - 1)
        explained, each = self.found[of], self.without[:, of]
        return (
            (float(explained @ spread @ explained) - chance) / total,
            (np.einsum("ij,jk,ik->i", each, spread, each) - chance) / totals,
        )

    def ratio(self, of: slice) -> float:
        """Return the F ratio of some coefficients."""
        found, noise = self.found[of], float((self.residuals**2).sum()) / self.freedom
        squares = float(found @ np.linalg.pinv(self.cofactors[of, of]) @ found)
        return squares / found.size / noise if noise > 0.0 else math.inf


def _is_range(values: npt.NDArray[np.generic]) -> bool:
    return values.dtype.kind == "f"


def _curve(values: npt.NDArray[np.generic], degrees: int) -> Array:
    """Return the columns of the curve of a factor: powers for a range, a step for each level but the first."""
    if not _is_range(values):
        return np.array([values == level for level in np.unique(values)[1:]], dtype=float).reshape(-1, values.size).T
    numbers = values.astype(float)
    width = np.ptp(numbers) or 1.0
    return np.asarray(np.polynomial.legendre.legvander(2.0 * (numbers - numbers.min()) / width - 1.0, degrees)[:, 1:])


def _ranks(values: Array) -> Array:
    return np.argsort(np.argsort(values, kind="stable"), kind="stable").astype(float)


def _standardised(values: Array) -> Array:
    return np.asarray((values - values.mean()) / values.std())


def _interval(found: float, without: Array, least: float) -> Interval:
    """Return the jackknife interval of the estimate from all cells, limited to `least` and 1."""
    from scipy.stats import t  # noqa: PLC0415

    n = without.size
    spread = math.sqrt((n - 1) / n * float(((without - without.mean()) ** 2).sum()))
    half = float(t.ppf(0.5 + CONFIDENCE / 2.0, n - 1)) * spread
    return min(1.0, max(least, found - half)), min(1.0, max(least, found + half))
