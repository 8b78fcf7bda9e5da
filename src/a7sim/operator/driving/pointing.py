"""One eye: finding the image of a point from the paper print, and setting the mark on it."""

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
"""A handwheel, or a drum, is let go when the image would move by less than this, or this share of what the eye sees."""

PATIENT_LOOKS, IMPATIENT_MM = 12, 0.0015
"""Where play keeps the mark from coming to rest, more is borne with after so many looks."""

SEARCH_RINGS = 3
SEARCH_STEP_MM = 14.0
"""At photo scale: how far the operator looks around for a point that is not where the print shows it."""

DIVERGENCE_UM = 150.0
DIVERGENCE_LOOKS = 3
"""What grows in so many looks in a row, though it is turned down, runs away."""


class Pointing:
    """The eyes of a crew, each looking at its own photograph."""

    def __init__(self, controls: Controls) -> None:
        self.controls = controls
        self.operators = controls.operators
        observer = controls.operators.observer
        eye = min(observer.monocular_um, observer.stereo_um, observer.height_um, observer.parallax_um)
        self.finest_mm = max(FINEST_MM, FINEST_SHARE * 1e-3 * eye * controls.job.plan.projection_height / controls.c)
        """What handwheels and drums are not turned by any more."""
        self._prints: Mapping[int, Mapping[str, Array]] = {}
        self._strayed = np.zeros((3, 2, controls.operators.size))
        self._seen_from = np.zeros((2, controls.operators.size))

    def set_prints(self, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Take up the paper prints by hand (1 left, 2 right): places ``(2, sessions)`` of points in mm."""
        self._prints = prints
        self._strayed[:] = 0.0

    def bring_into_view(self, active: Indices, side: int, point: str) -> None:
        """Drive to where the print shows a point and look around until it is in the field of view."""
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
        """Return what is not turned any more after so many looks, mm."""
        return self.finest_mm if looks < PATIENT_LOOKS else max(self.finest_mm, IMPATIENT_MM)

    def measure_drift(self, active: Indices, side: int, point: str, readings: Array) -> None:
        """Bear in mind how far from where the print showed it a point was found, by its readings ``(2 or 3, m)``."""
        controls = self.controls
        expected = controls.rotate_by_swing(
            active, side, self.operators.print_position(self._prints[side], point)[:, active]
        )
        away = controls.to_mm(readings[:2] - controls.under_centre(active, side))
        self._strayed[side][:, active] = away * controls.c / controls.z[active] - expected

    def view_point(self, active: Indices, side: int, point: str) -> Array:
        """Look: where the image stands from the mark ``(2, m)`` in um, nan where it is not in the field of view."""
        self.operators.spend(active, self.operators.observer.seconds_to_look, "looking")
        return self.operators.view_points(
            active, point, lambda them, name: self.controls.driver.view_point(them, side, name)
        )

    def bisect(self, active: Indices, side: int, point: str, errors: Array) -> None:
        """Turn X and Y until the image seems to lie at the mark; errors ``(2, sessions)`` in um."""
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
        """Put right the levers of those from whom a point ran away, go back to where it was seen and look, in place."""
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
        """Go back to where the point was seen and try each wheel to find out what is wrong."""
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
    """Watches whether displacements grow though they are being turned down."""

    def __init__(self, displacements: int, sessions: int) -> None:
        self._before = np.full((displacements, sessions), np.inf)
        self._times = np.zeros((displacements, sessions), dtype=int)
        self._any_grew = False

    def is_converging(self, active: Indices, seen: Array) -> bool:
        """Whether all displacements ``(k, m)`` in um are seen and small, and none ever grew; if not, ask on."""
        now = np.abs(seen)
        well = not self._any_grew and bool(now.max(initial=0.0) <= DIVERGENCE_UM)
        if well:
            put(now, active, self._before)
        return well

    def has_grown(self, active: Indices) -> BoolArray:
        """Return which of the displacements ``(k, m)`` had grown when they were last seen."""
        return take(self._times, active) > 0

    def is_diverging(self, active: Indices, seen: Array) -> BoolArray:
        """Return which of the displacements ``(k, m)`` in um have grown in look after look."""
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
