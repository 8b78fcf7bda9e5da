"""Observing the perspective centres at two Z levels (thesis 3.6)."""

from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from a7sim.geometry import Array
from a7sim.operator.bench import Bench
from a7sim.operator.crew import Who
from a7sim.operator.job import ModelJob
from a7sim.reduction import PerspectiveCentre, perspective_centre

SUSPICIOUS_RMS = 0.19
"""Counter units; none of the thesis's twenty centres but the misprinted one has a larger rms."""

SLIPPED = 1.5
"""A point whose removal lowers a suspicious rms by this factor is pointed at again."""

MOST_REPETITIONS = 3


def observe_centre(
    bench: Bench, who: Who, model: ModelJob, hand: int, levels: tuple[float, float], tolerated_rms: float
) -> PerspectiveCentre:
    """Point monocularly at points 1 to 6 at both levels and compute the centres ``(sessions,)`` of one photograph.

    hand is 1 for the left-hand photograph, 2 for the right-hand one. A point that does not fit the others is
    struck out and pointed at again; when the rms stays suspicious though no point stands out, a second set
    is observed and the mean of both is taken. Those for whom even then the rms is beyond the tolerated give up.
    """
    crew = bench.crew
    points = [model.standard_points[label] for label in model.points_of_case("A")]
    shown = bench.seat.levels_shown(who, levels)
    who = crew.still(who)
    low_level, high_level = float(shown[0, 0]), float(shown[1, 0])
    low, high = _one_set(bench, who, hand, points, low_level, high_level)
    who = crew.still(who)
    doubtful = who[_rms(low, high, low_level, high_level, who) > SUSPICIOUS_RMS]
    if doubtful.size:
        crew.remark(doubtful, f"{model.name}: the points of the centre fit badly, a second set is observed")
        again = _one_set(bench, doubtful, hand, points, low_level, high_level)
        for pointings, more in zip((low, high), again, strict=True):
            pointings[:, :, doubtful] = (pointings[:, :, doubtful] + more[:, :, doubtful]) / 2.0
        who = crew.still(who)
    rms = _rms(low, high, low_level, high_level, who)
    for session, bad in zip(who[rms > tolerated_rms], rms[rms > tolerated_rms], strict=True):
        crew.give_up(
            np.array([session]),
            f"{model.name}: the pointings of a perspective centre do not meet: rms {bad:.2f}, "
            f"tolerated {tolerated_rms:.2f}",
        )
    return _among_all(perspective_centre(low[:, :, who], high[:, :, who], low_level, high_level), who, crew.sessions)


def centre_of(centres: PerspectiveCentre, session: int) -> PerspectiveCentre:
    """Return one session's centre."""
    return PerspectiveCentre(*(_each(centres, lambda values: values[..., session])))


def _among_all(centres: PerspectiveCentre, who: Who, sessions: int) -> PerspectiveCentre:
    def spread(values: Array) -> Array:
        every = np.full((*values.shape[:-1], sessions), np.nan)
        every[..., who] = values
        return every

    return PerspectiveCentre(*_each(centres, spread))


def _each(centres: PerspectiveCentre, change: Callable[[Array], Array]) -> list[Any]:
    values = (getattr(centres, field.name) for field in fields(centres))
    return [None if each is None else change(each) for each in values]


def _rms(low: Array, high: Array, low_level: float, high_level: float, who: Who) -> Array:
    return perspective_centre(low[:, :, who], high[:, :, who], low_level, high_level).rms


def _one_set(
    bench: Bench, who: Who, hand: int, points: Sequence[str], low_level: float, high_level: float
) -> tuple[Array, Array]:
    crew = bench.crew
    levels = (low_level, high_level)
    low, high = (bench.point_with(crew.still(who), hand, points, level) for level in levels)
    looking = crew.still(who)
    bench.compute(looking)
    for _ in range(MOST_REPETITIONS):
        misread = _misread_points(low, high, low_level, high_level, looking)
        looking, misread = looking[misread >= 0], misread[misread >= 0]
        if not looking.size:
            break
        why = "does not agree with the other points at the two levels"
        for place in np.unique(misread):
            again = looking[misread == place]
            for pointings, level in zip((low, high), levels, strict=True):
                pointings[:, place, again] = bench.point_again(again, hand, points[place], level, why)[:, again]
        looking = crew.still(looking)
        bench.compute(looking)
    return low, high


def _misread_points(low: Array, high: Array, low_level: float, high_level: float, who: Who) -> Array:
    """Return the index ``(m,)`` of the point that does not fit the others, -1 for none."""
    n = low.shape[1]
    of_all = _rms(low, high, low_level, high_level, who)
    without = np.array(
        [_rms(np.delete(low, i, axis=1), np.delete(high, i, axis=1), low_level, high_level, who) for i in range(n)]
    )
    suspicious = (of_all > SUSPICIOUS_RMS) & (of_all > SLIPPED * without.min(axis=0))
    return np.where(suspicious, without.argmin(axis=0), -1)
