"""Random draws of an operator: setting errors and reading slips."""

import numpy as np

from a7sim.geometry import Array
from a7sim.scenario import Observer

OPERATOR_STREAM = 4
"""Spawn key of the operator's random numbers."""

_LAST_DIGITS = 0.01 * np.array([-1.0, 1.0])
_GROSS_SLIPS = np.array([-1.0, -0.5, -0.1, 0.1, 0.5, 1.0])
"""Errors of a misread higher digit, in counter units."""


class OperatorRandom:
    """Random numbers of the operator of one session.

    Errors are drawn in blocks, one number per setting of a step of the procedure, so that the same seed gives the same
    errors however many looks and turns the closed loop takes. Slips, which most operators do not make, are drawn one by
    one from a stream of their own. The draws are written into the given arrays.
    """

    def __init__(self, observer: Observer, seed: int) -> None:
        self.observer = observer
        planned, repeated, slips = np.random.SeedSequence(seed, spawn_key=(OPERATOR_STREAM,)).spawn(3)
        self._planned = np.random.default_rng(planned)
        self._repeated = np.random.default_rng(repeated)
        self._slips = np.random.default_rng(slips)

    def fill_setting_errors(self, out: Array) -> None:
        """Draw the errors of planned settings, in units of their standard deviation."""
        out[...] = self._planned.standard_normal(out.shape)

    def refill_setting_errors(self, out: Array) -> None:
        """Draw the errors ``(count,)`` of repeated settings, in the same unit."""
        out[:] = self._repeated.standard_normal(out.size)

    def fill_reading_draws(self, out: Array) -> None:
        """Draw the uniform numbers ``(3, ...)`` of planned readings, for `misreading`."""
        _fill_draws(self._planned, out)

    def refill_reading_draws(self, out: Array) -> None:
        """Draw the uniform numbers ``(3, count)`` of repeated readings."""
        for i in range(out.shape[1]):
            _fill_draws(self._repeated, out[:, i : i + 1])

    def slip_draws(self, rate: float) -> bool:
        """Return whether an event of this rate happens."""
        return rate > 0.0 and bool(self._slips.random() < rate)

    def choice(self, count: int) -> int:
        """Return the index of one of `count` alternatives."""
        return int(self._slips.integers(count))


def _fill_draws(rng: np.random.Generator, out: Array) -> None:
    shape = out.shape[1:]
    out[0] = rng.random(shape)
    out[1] = rng.integers(len(_LAST_DIGITS), size=shape)
    out[2] = rng.integers(len(_GROSS_SLIPS), size=shape)


def misreading(observer: Observer, draws: Array, factor: Array) -> Array:
    """Return the misreadings ``(*shape, m)`` in counter units for uniform numbers ``(3, *shape, m)``; mostly zero.

    The slip rates of the observer are multiplied by `factor` ``(m,)``.
    """
    chance, (last_digit, gross) = draws[0], draws[1:].astype(np.intp)
    blunders = factor * observer.blunder_rate
    small_errors = np.where(chance < blunders + factor * observer.last_digit_slip, _LAST_DIGITS[last_digit], 0.0)
    return np.where(chance < blunders, _GROSS_SLIPS[gross], small_errors)
