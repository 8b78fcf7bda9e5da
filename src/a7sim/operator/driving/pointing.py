"""Monocular pointing: finding the image of a point by the paper print, and setting the mark on it."""

from collections.abc import Iterator, Mapping

import numpy as np

from a7sim.batch import Indices, exclude, put, take
from a7sim.geometry import Array
from a7sim.operator.driving.controls import Controls, side_name
from a7sim.operator.driving.driver import BoolArray
from a7sim.operator.driving.fittings import correct_fittings

MAX_LOOKS = 40
"""At one setting of the mark."""

FINEST_MM, FINEST_SHARE = 0.0003, 0.15
"""A handwheel or drum is released when the image would move by less than this, or by less than this share of the
displacement.
"""

PATIENT_LOOKS, IMPATIENT_MM = 12, 0.0015
"""If play keeps the mark moving, a larger displacement is accepted after this number of looks."""

SEARCH_RINGS = 3
SEARCH_STEP_MM = 14.0
"""At photo scale: step of the search for a point that is not at the position of the print."""

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
        self.finest_mm = max(FINEST_MM, FINEST_SHARE * 1e-3 * eye * controls.job.plan.projection_height / controls.c)
        """Smallest displacement for which handwheels and drums are turned."""
        self._prints: Mapping[int, Mapping[str, Array]] = {}
        self._strayed = np.zeros((3, 2, controls.operators.size))
        self._seen_from = np.zeros((2, controls.operators.size))

    def set_prints(self, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Set the paper prints by side (1 left, 2 right): positions ``(2, sessions)`` of points in mm."""
        self._prints = prints
        self._strayed[:] = 0.0

    def bring_into_view(self, active: Indices, side: int, point: str) -> None:
        """Drive to the position of a point on the print and search until it is in the field of view."""
        controls = self.controls
        printed = self.operators.print_position(self._prints[side], point)
        nowhere = np.isnan(printed[0, active])
        self.operators.give_up(
            active[nowhere], f"point {point} is not pricked on the print of the {side_name(side)} photograph"
        )
        active = active[~nowhere]
        if not active.size:
            return
        controls.counters(active)
        from_below = controls.rotate_by_swing(active, side, printed[:, active]) + self._strayed[side][:, active]
        origin = controls.under_centre(active, side)
        looking = np.arange(active.size)
        for around in _outward():
            places = origin + controls.to_counter_units(
                (from_below + around[:, None]) * controls.z[active] / controls.c
            )
            x, y = places[:, looking]
            went = looking[controls.drive(active[looking], {"X": x, "Y": y})]
            found = went[~np.isnan(self.view_point(active[went], side, point)[0])] if went.size else went
            self._seen_from[:, active[found]] = places[:, found]
            looking = exclude(looking, found)
            if not looking.size:
                return
        looking_on = active[looking]
        again = correct_fittings(controls, looking_on)
        if again.any():
            self.bring_into_view(looking_on[again], side, point)
            looking = looking[~again]
        controls.give_up_on_errors(active[looking], f"{controls.model.name}: looking for point {point}")
        self.operators.give_up(
            self.operators.remaining(active[looking]),
            f"{controls.model.name}: point {point} is nowhere near where the print shows it in the "
            f"{side_name(side)} eye, "
            f"not within {SEARCH_RINGS * SEARCH_STEP_MM:.0f} mm: wrong picture in the projector, or the base "
            "setting does not belong to this model",
        )

    def at_rest_mm(self, looks: int) -> float:
        """Return the accepted displacement after a number of looks, mm."""
        return self.finest_mm if looks < PATIENT_LOOKS else max(self.finest_mm, IMPATIENT_MM)

    def measure_drift(self, active: Indices, side: int, point: str, readings: Array) -> None:
        """Record the distance of a point from its position on the print, by its readings ``(2 or 3, m)``."""
        controls = self.controls
        expected = controls.rotate_by_swing(
            active, side, self.operators.print_position(self._prints[side], point)[:, active]
        )
        away = controls.to_mm(readings[:2] - controls.under_centre(active, side))
        self._strayed[side][:, active] = away * controls.c / controls.z[active] - expected

    def view_point(self, active: Indices, side: int, point: str) -> Array:
        """Return the position of the image relative to the mark ``(2, m)`` in um, nan outside the field of view."""
        self.operators.spend(active, self.operators.observer.seconds_to_look, "looking")
        return self.operators.view_points(
            active, point, lambda them, name: self.controls.driver.view_point(them, side, name)
        )

    def bisect(self, active: Indices, side: int, point: str, errors: Array) -> None:
        """Turn X and Y until the image appears to be at the mark; errors ``(2, sessions)`` in um."""
        controls = self.controls
        watch = DivergenceMonitor(2, self.operators.size)
        for looks in range(MAX_LOOKS):
            seen = self.view_point(active, side, point)
            if not watch.is_converging(active, seen):
                lost = np.isnan(seen[0]) | watch.is_diverging(active, seen).any(axis=0)
                if lost.any():
                    self._look_again_with_levers_right(active, side, point, seen, lost)
                    self._ran_away(active[lost], side, point)
                    active, seen = active[~lost], seen[:, ~lost]
            steps = (seen + take(errors, active)) * (1e-3 * take(controls.z, active) / controls.c)
            moving = ~(np.abs(steps) < self.at_rest_mm(looks)).all(axis=0)
            active = active[moving]
            if not active.size:
                return
            controls.turn(active, controls.to_counter_units(steps[:, moving]))
        controls.give_up_on_errors(active, f"{controls.model.name}: pointing at {point}")
        self.operators.give_up(
            self.operators.remaining(active),
            f"{controls.model.name}: point {point}: the mark cannot be brought to rest on the image",
        )

    def _look_again_with_levers_right(
        self, active: Indices, side: int, point: str, seen: Array, lost: BoolArray
    ) -> None:
        """Correct the fittings of sessions that lost a point, return to where it was seen and look again, in place."""
        away = np.flatnonzero(lost)
        mended = away[correct_fittings(self.controls, active[away])]
        if mended.size:
            self._go_back(active[mended])
            seen[:, mended] = self.view_point(active[mended], side, point)
            lost[mended] = np.isnan(seen[0, mended])

    def _go_back(self, active: Indices) -> None:
        self.controls.drive(active, {"X": self._seen_from[0, active], "Y": self._seen_from[1, active]})

    def _ran_away(self, active: Indices, side: int, point: str) -> None:
        for session in active:
            one = np.array([session])
            self.operators.give_up(
                one,
                f"{self.controls.model.name}: point {point} runs away from the mark in the {side_name(side)} eye: "
                f"{self._why_it_ran_away(one, side, point)}",
            )

    def _why_it_ran_away(self, one: Indices, side: int, point: str) -> str:
        """Return to where the point was seen and try each wheel to find the cause."""
        controls = self.controls
        reasons = []
        for axis, mirror, fitting in (
            (0, "left to right", "diapositive lever"),
            (1, "top to bottom", "Dove prisms"),
        ):
            self._go_back(one)
            counters, seen = controls.counters(one), self.view_point(one, side, point)
            controls.turn(one, np.eye(2)[:, [axis]])
            counters_then, seen_then = controls.counters(one), self.view_point(one, side, point)
            if counters_then[axis, 0] < counters[axis, 0]:
                reasons.append(f"the {'XY'[axis]} wheel turns the wrong way (its collar)")
            elif seen_then[axis, 0] > seen[axis, 0]:
                reasons.append(f"the picture is mirrored {mirror} (the {fitting})")
        return " and ".join(reasons) or "it left the field of view"


class DivergenceMonitor:
    """Monitor of displacements that grow while they are being reduced."""

    def __init__(self, displacements: int, sessions: int) -> None:
        self._before = np.full((displacements, sessions), np.inf)
        self._times = np.zeros((displacements, sessions), dtype=int)
        self._any_grew = False

    def is_converging(self, active: Indices, seen: Array) -> bool:
        """Return whether all displacements ``(k, m)`` in um are visible and small, and none ever grew."""
        now = np.abs(seen)
        well = not self._any_grew and bool(now.max(initial=0.0) <= DIVERGENCE_UM)
        if well:
            put(now, active, self._before)
        return well

    def has_grown(self, active: Indices) -> BoolArray:
        """Return which of the displacements ``(k, m)`` had grown at the last look."""
        return take(self._times, active) > 0

    def is_diverging(self, active: Indices, seen: Array) -> BoolArray:
        """Return which of the displacements ``(k, m)`` in um grew in successive looks."""
        now = np.abs(seen)
        grown = (now > 1.4 * take(self._before, active)) & (now > DIVERGENCE_UM)
        put(now, active, self._before)
        if not grown.any() and not self._any_grew:
            return grown
        self._any_grew = True
        times = np.where(grown, take(self._times, active) + 1, 0)
        self._times[:, active] = times
        return np.asarray(times >= DIVERGENCE_LOOKS)


def _outward() -> Iterator[Array]:
    """Yield shifts in mm at photo scale, from the middle outward in rings."""
    yield np.zeros(2)
    for ring in range(1, SEARCH_RINGS + 1):
        for direction in np.arange(6 * ring) * (2.0 * np.pi / (6 * ring)):
            yield ring * SEARCH_STEP_MM * np.array([np.cos(direction), np.sin(direction)])
