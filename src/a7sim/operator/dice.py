"""What chance does to a person: errors of settings and slips of reading."""

import numpy as np

from a7sim.geometry import Array
from a7sim.scenario import Observer

OPERATOR_STREAM = 4
"""Spawn key of the operator's random numbers."""

_GROSS_SLIPS = (-1.0, -0.5, -0.1, 0.1, 0.5, 1.0)
"""A digit read wrong further up, in counter units."""


class Dice:
    """The random numbers of one session's operator.

    Errors come in blocks, one draw for each setting that a step of the procedure makes, so that the same
    seed gives the same errors however long the closed loop of turning and looking takes. Lapses, of which most
    persons have none, come one by one from a stream of their own.
    """

    def __init__(self, observer: Observer, seed: int) -> None:
        self.observer = observer
        planned, again, lapses = np.random.SeedSequence(seed, spawn_key=(OPERATOR_STREAM,)).spawn(3)
        self._planned = np.random.default_rng(planned)
        self._again = np.random.default_rng(again)
        self._lapses = np.random.default_rng(lapses)

    def errors(self, sigma: float, shape: tuple[int, ...]) -> Array:
        """Return the errors of planned settings, in the unit of sigma."""
        return sigma * self._planned.standard_normal(shape)

    def errors_again(self, sigma: float, count: int) -> Array:
        """Return the errors ``(count,)`` of settings that have to be made once more."""
        return np.array([sigma * float(self._again.standard_normal()) for _ in range(count)])

    def slips(self, shape: tuple[int, ...], factor: float = 1.0) -> Array:
        """Return what the person misreads at planned readings, in counter units; zero for most.

        Slips are so many times as frequent as the observer's rates say.
        """
        return _slips(self._planned, self.observer, shape, factor)

    def slips_again(self, count: int, factor: float = 1.0) -> Array:
        """Return what the person misreads at readings ``(count,)`` made once more."""
        return np.array([float(_slips(self._again, self.observer, (1,), factor)[0]) for _ in range(count)])

    def lapses(self, rate: float) -> bool:
        """Return whether something happens that does so with this rate."""
        return rate > 0.0 and bool(self._lapses.random() < rate)

    def choice(self, count: int) -> int:
        """Return which of so many ways a lapse takes."""
        return int(self._lapses.integers(count))


def _slips(rng: np.random.Generator, observer: Observer, shape: tuple[int, ...], factor: float) -> Array:
    luck = rng.random(shape)
    last_digit = 0.01 * rng.choice((-1.0, 1.0), shape)
    gross = rng.choice(_GROSS_SLIPS, shape)
    blunders = factor * observer.blunder_rate
    slipped = np.where(luck < blunders + factor * observer.last_digit_slip, last_digit, 0.0)
    return np.where(luck < blunders, gross, slipped)
