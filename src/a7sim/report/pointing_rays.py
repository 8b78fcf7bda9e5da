"""Positions of each point's ray at the height of a perspective centre, from the book."""

import math
import re
from collections.abc import Mapping

from a7sim.report.forms import mean, valid_readings
from a7sim.report.session_folder import SessionFolder
from a7sim.result_documents import Document

_ITEM = re.compile(r"(?P<axis>[XY]) (left|right) at Z (?P<level>-?[0-9.]+)")

TOLERATED = 2e-3
"""Tolerance in counter units between the rms of the rays and that of the results."""


def pointing_rays(kept: SessionFolder, model: Document, side: str) -> dict[str, tuple[float, float]]:
    """Return X and Y by point where the line of its pointings at two levels, extended by T0, reaches the centre's
    height.

    They show the residuals of the centre's equations. Empty if a centre was found by another method, or if the book
    does not give the rms of the results.
    """
    form = f"{side} perspective centre"
    entries = [entry for entry in kept.book if entry.model == model["model"] and entry.form == form]
    found = model["perspective_centres"][side]
    by_point: dict[str, dict[tuple[str, float], float]] = {}
    for (point, item), readings in valid_readings(entries).items():
        if match := _ITEM.fullmatch(item):
            by_point.setdefault(point, {})[match["axis"], float(match["level"])] = mean(readings)
    levels = sorted({level for readings in by_point.values() for _, level in readings})
    if len(levels) != 2 or any(len(readings) != 4 for readings in by_point.values()):
        return {}
    low, high = levels if found["T0"] > 0.0 else (levels[1], levels[0])
    rays = {point: _ray(readings, low, high, found["T0"]) for point, readings in by_point.items()}
    return rays if abs(_rms(rays, found) - found["rms"]) < TOLERATED else {}


def _ray(readings: Mapping[tuple[str, float], float], low: float, high: float, t: float) -> tuple[float, float]:
    x, y = (readings[axis, low] + t * (readings[axis, high] - readings[axis, low]) for axis in ("X", "Y"))
    return x, y


def _rms(rays: Mapping[str, tuple[float, float]], found: Document) -> float:
    squares = sum((x - found["X0"]) ** 2 + (y - found["Y0"]) ** 2 for x, y in rays.values())
    return math.sqrt(squares / (2 * len(rays) - 3)) if len(rays) > 1 else math.nan
