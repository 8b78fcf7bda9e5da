"""Monocular pointing: finding the image of a point by the paper print, and setting the mark on it."""

from collections.abc import Iterator, Mapping

import numpy as np

from a7sim.batch import Indices, exclude, put, take
from a7sim.geometry import Array
from a7sim.operator.driving.controls import Controls, side_name
from a7sim.operator.driving.driver import BoolArray
from a7sim.operator.driving.fittings import correct_fittings

MAX_LOOKS = 40
"""Maximum number of looks at one setting of the mark."""

MIN_TURN_MM, MIN_TURN_SHARE = 0.0003, 0.15
"""Minimum movement of the image for which a handwheel or drum is turned.

It is the larger of this length at model scale and this share of the observer's smallest setting error.
"""

RELAXED_AFTER_LOOKS, RELAXED_TURN_MM = 12, 0.0015
"""If play keeps the mark moving, a larger displacement is accepted after this number of looks."""

SEARCH_RINGS = 3
SEARCH_STEP_MM = 14.0
"""Step at photo scale of the search for a point that is not at its position on the print."""

DIVERGENCE_UM = 150.0
DIVERGENCE_LOOKS = 3
"""A displacement that grows in this number of successive looks while it is being reduced diverges."""


class Pointing:
    """Pointing of a batch of operators, each at their own photograph."""

    def __init__(self, controls: Controls) -> None:
        self.controls = controls
        self.operators = controls.operators
        observer = controls.operators.observer
        eye = min(observer.monocular_um, observer.stereo_um, observer.height_um, observer.parallax_um)
        self.finest_mm = max(
            MIN_TURN_MM, MIN_TURN_SHARE * 1e-3 * eye * controls.job.plan.projection_height / controls.c
        )
        """Smallest displacement for which handwheels and drums are turned."""
        self._prints: Mapping[int, Mapping[str, Array]] = {}
        self._drift = np.zeros((3, 2, controls.operators.size))
        self._last_seen_at = np.zeros((2, controls.operators.size))

    def set_prints(self, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Set the paper prints by side (1 left, 2 right): positions ``(2, sessions)`` of points in mm."""
        self._prints = prints
        self._drift[:] = 0.0

    def bring_into_view(self, active: Indices, side: int, point: str) -> None:
        """Drive to the position of a point on the print and search until it is in the field of view."""
        controls = self.controls
        printed = self.operators.print_position(self._prints[side], point)
        is_missing = np.isnan(printed[0, active])
        self.operators.give_up(
            active[is_missing], f"point {point} is not pricked on the print of the {side_name(side)} photograph"
        )
        active = active[~is_missing]
        if not active.size:
            return
        controls.counters(active)
        from_centre = controls.rotate_by_swing(active, side, printed[:, active]) + self._drift[side][:, active]
        origin = controls.under_centre(active, side)
        searching = np.arange(active.size)
        for shift in _search_shifts():
            readings = origin + controls.to_counter_units(
                (from_centre + shift[:, None]) * controls.z[active] / controls.c
            )
            x, y = readings[:, searching]
            reached = searching[controls.drive(active[searching], {"X": x, "Y": y})]
            found = reached[~np.isnan(self.view_point(active[reached], side, point)[0])] if reached.size else reached
            self._last_seen_at[:, active[found]] = readings[:, found]
            searching = exclude(searching, found)
            if not searching.size:
                return
        not_found = active[searching]
        is_corrected = correct_fittings(controls, not_found)
        if is_corrected.any():
            self.bring_into_view(not_found[is_corrected], side, point)
            searching = searching[~is_corrected]
        controls.give_up_on_errors(active[searching], f"{controls.model.name}: looking for point {point}")
        self.operators.give_up(
            self.operators.remaining(active[searching]),
            f"{controls.model.name}: point {point} is nowhere near where the print shows it in the "
            f"{side_name(side)} eye, "
            f"not within {SEARCH_RINGS * SEARCH_STEP_MM:.0f} mm: wrong picture in the projector, or the base "
            "setting does not belong to this model",
        )

    def at_rest_mm(self, looks: int) -> float:
        """Return the accepted displacement after a number of looks, mm."""
        return self.finest_mm if looks < RELAXED_AFTER_LOOKS else max(self.finest_mm, RELAXED_TURN_MM)

    def measure_drift(self, active: Indices, side: int, point: str, readings: Array) -> None:
        """Record the distance of a point from its position on the print, by its readings ``(2 or 3, m)``."""
        controls = self.controls
        expected = controls.rotate_by_swing(
            active, side, self.operators.print_position(self._prints[side], point)[:, active]
        )
        offset = controls.to_mm(readings[:2] - controls.under_centre(active, side))
        self._drift[side][:, active] = offset * controls.c / controls.z[active] - expected

    def view_point(self, active: Indices, side: int, point: str) -> Array:
        """Return the position of the image relative to the mark ``(2, m)`` in um, nan outside the field of view."""
        self.operators.spend(active, self.operators.observer.seconds_to_look, "looking")
        return self.operators.view_points(
            active, point, lambda sessions, name: self.controls.driver.view_point(sessions, side, name)
        )

    def bisect(self, active: Indices, side: int, point: str, errors: Array) -> None:
        """Turn X and Y until the image appears to be at the mark; errors ``(2, sessions)`` in um."""
        controls = self.controls
        monitor = DivergenceMonitor(2, self.operators.size)
        for looks in range(MAX_LOOKS):
            seen = self.view_point(active, side, point)
            if not monitor.is_converging(active, seen):
                is_lost = np.isnan(seen[0]) | monitor.is_diverging(active, seen).any(axis=0)
                if is_lost.any():
                    self._correct_fittings_and_look(active, side, point, seen, is_lost)
                    self._give_up_diverging(active[is_lost], side, point)
                    active, seen = active[~is_lost], seen[:, ~is_lost]
            steps = (seen + take(errors, active)) * (1e-3 * take(controls.z, active) / controls.c)
            is_moving = ~(np.abs(steps) < self.at_rest_mm(looks)).all(axis=0)
            active = active[is_moving]
            if not active.size:
                return
            controls.turn(active, controls.to_counter_units(steps[:, is_moving]))
        controls.give_up_on_errors(active, f"{controls.model.name}: pointing at {point}")
        self.operators.give_up(
            self.operators.remaining(active),
            f"{controls.model.name}: point {point}: the mark cannot be brought to rest on the image",
        )

    def _correct_fittings_and_look(
        self, active: Indices, side: int, point: str, seen: Array, is_lost: BoolArray
    ) -> None:
        """Correct the fittings of sessions that lost a point, return to where it was seen and look again, in place."""
        lost_rows = np.flatnonzero(is_lost)
        corrected = lost_rows[correct_fittings(self.controls, active[lost_rows])]
        if corrected.size:
            self._return_to_last_seen(active[corrected])
            seen[:, corrected] = self.view_point(active[corrected], side, point)
            is_lost[corrected] = np.isnan(seen[0, corrected])

    def _return_to_last_seen(self, active: Indices) -> None:
        self.controls.drive(active, {"X": self._last_seen_at[0, active], "Y": self._last_seen_at[1, active]})

    def _give_up_diverging(self, active: Indices, side: int, point: str) -> None:
        for session in active:
            single = np.array([session])
            self.operators.give_up(
                single,
                f"{self.controls.model.name}: point {point} runs away from the mark in the {side_name(side)} eye: "
                f"{self._divergence_cause(single, side, point)}",
            )

    def _divergence_cause(self, active: Indices, side: int, point: str) -> str:
        """Return to where the point was seen and try each wheel to find the cause."""
        controls = self.controls
        reasons = []
        for axis, mirror, fitting in (
            (0, "left to right", "diapositive lever"),
            (1, "top to bottom", "Dove prisms"),
        ):
            self._return_to_last_seen(active)
            counters, seen = controls.counters(active), self.view_point(active, side, point)
            controls.turn(active, np.eye(2)[:, [axis]])
            counters_after, seen_after = controls.counters(active), self.view_point(active, side, point)
            if counters_after[axis, 0] < counters[axis, 0]:
                reasons.append(f"the {'XY'[axis]} wheel turns the wrong way (its collar)")
            elif seen_after[axis, 0] > seen[axis, 0]:
                reasons.append(f"the picture is mirrored {mirror} (the {fitting})")
        return " and ".join(reasons) or "it left the field of view"


class DivergenceMonitor:
    """Monitor of displacements that grow while they are being reduced."""

    def __init__(self, displacements: int, sessions: int) -> None:
        self._previous = np.full((displacements, sessions), np.inf)
        self._growth_counts = np.zeros((displacements, sessions), dtype=int)
        self._has_any_grown = False

    def is_converging(self, active: Indices, seen: Array) -> bool:
        """Return whether all displacements ``(k, m)`` in um are visible and small, and none ever grew."""
        current = np.abs(seen)
        converging = not self._has_any_grown and bool(current.max(initial=0.0) <= DIVERGENCE_UM)
        if converging:
            put(current, active, self._previous)
        return converging

    def has_grown(self, active: Indices) -> BoolArray:
        """Return which of the displacements ``(k, m)`` had grown at the last look."""
        return take(self._growth_counts, active) > 0

    def is_diverging(self, active: Indices, seen: Array) -> BoolArray:
        """Return which of the displacements ``(k, m)`` in um grew in successive looks."""
        current = np.abs(seen)
        has_grown = (current > 1.4 * take(self._previous, active)) & (current > DIVERGENCE_UM)
        put(current, active, self._previous)
        if not has_grown.any() and not self._has_any_grown:
            return has_grown
        self._has_any_grown = True
        counts = np.where(has_grown, take(self._growth_counts, active) + 1, 0)
        self._growth_counts[:, active] = counts
        return np.asarray(counts >= DIVERGENCE_LOOKS)


def _search_shifts() -> Iterator[Array]:
    """Yield shifts in mm at photo scale, from the middle outward in rings."""
    yield np.zeros(2)
    for ring in range(1, SEARCH_RINGS + 1):
        for direction in np.arange(6 * ring) * (2.0 * np.pi / (6 * ring)):
            yield ring * SEARCH_STEP_MM * np.array([np.cos(direction), np.sin(direction)])
