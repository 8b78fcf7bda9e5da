"""Fatigue and breaks of an operator (docs/decisions/0008-operator-skill.md)."""

import numpy as np

from a7sim.geometry import Array
from a7sim.scenario import Observer

HOUR = 3600.0
MINUTE = 60.0


def acuity_factor(observer: Observer, since_start: Array, since_rest: Array) -> Array:
    """Return the factor of setting errors relative to the observer's best, from seconds at work and since a rest."""
    cold_share = np.maximum(1.0 - since_start / (MINUTE * observer.warm_up_minutes), 0.0)
    return (1.0 + observer.warm_up * cold_share) * (
        1.0 + observer.fatigue_per_hour * _fatigue_hours(observer, since_rest)
    )


def slip_factor(observer: Observer, since_rest: Array) -> Array:
    """Return the factor of the frequency of slips relative to a rested operator, from seconds since a rest."""
    return np.asarray(1.0 + observer.slip_fatigue_per_hour * _fatigue_hours(observer, since_rest))


def needs_a_break(observer: Observer, since_rest: Array) -> Array:
    """Return which operators take a break before the next task, from seconds since the last one."""
    return np.asarray(observer.takes_breaks & (since_rest >= HOUR * observer.break_every_hours))


def _fatigue_hours(observer: Observer, since_rest: Array) -> Array:
    return np.asarray(np.maximum(since_rest / HOUR - observer.fresh_hours, 0.0))
