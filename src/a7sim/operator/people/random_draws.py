"""What chance does to a person: errors of settings and slips of reading."""

import numpy as np

from a7sim.geometry import Array
from a7sim.scenario import Observer

OPERATOR_STREAM = 4
"""Spawn key of the operator's random numbers."""

_LAST_DIGITS = 0.01 * np.array([-1.0, 1.0])
_GROSS_SLIPS = np.array([-1.0, -0.5, -0.1, 0.1, 0.5, 1.0])
"""A digit read wrong further up, in counter units."""


class OperatorRandom:
    """The random numbers of one session's operator.

    Errors come in blocks, one draw for each setting that a step of the procedure makes, so that the same
    seed gives the same errors however long the closed loop of turning and looking takes. Lapses, of which most
    persons have none, come one by one from a stream of their own. What is drawn is put into the arrays handed over.
    """

    def __init__(self, observer: Observer, seed: int) -> None:
        self.observer = observer
        planned, again, lapses = np.random.SeedSequence(seed, spawn_key=(OPERATOR_STREAM,)).spawn(3)
        self._planned = np.random.default_rng(planned)
        self._again = np.random.default_rng(again)
        self._lapses = np.random.default_rng(lapses)

    def fill_setting_errors(self, into: Array) -> None:
        """Draw the errors of planned settings, in units of their standard deviation."""
        into[...] = self._planned.standard_normal(into.shape)

    def refill_setting_errors(self, into: Array) -> None:
        """Draw the errors ``(count,)`` of settings that have to be made once more, in the same unit."""
        into[:] = self._again.standard_normal(into.size)

    def fill_reading_draws(self, into: Array) -> None:
        """Draw the luck ``(3, ...)`` with which planned readings are read, for `misread`."""
        _luck(self._planned, into)

    def refill_reading_draws(self, into: Array) -> None:
        """Draw the luck ``(3, count)`` with which readings are made once more."""
        for i in range(into.shape[1]):
            _luck(self._again, into[:, i : i + 1])

    def slip_draws(self, rate: float) -> bool:
        """Return whether something happens that does so with this rate."""
        return rate > 0.0 and bool(self._lapses.random() < rate)

    def choice(self, count: int) -> int:
        """Return which of so many ways a lapse takes."""
        return int(self._lapses.integers(count))


def _luck(rng: np.random.Generator, into: Array) -> None:
    shape = into.shape[1:]
    into[0] = rng.random(shape)
    into[1] = rng.integers(len(_LAST_DIGITS), size=shape)
    into[2] = rng.integers(len(_GROSS_SLIPS), size=shape)


def misreading(observer: Observer, luck: Array, factor: Array) -> Array:
    """Return what is misread ``(*shape, m)``, in counter units, with a luck ``(3, *shape, m)``; zero mostly.

    Slips are so many times as frequent ``(m,)`` as the observer's rates say.
    """
    chance, (last_digit, gross) = luck[0], luck[1:].astype(np.intp)
    blunders = factor * observer.blunder_rate
    slipped = np.where(chance < blunders + factor * observer.last_digit_slip, _LAST_DIGITS[last_digit], 0.0)
    return np.where(chance < blunders, _GROSS_SLIPS[gross], slipped)
