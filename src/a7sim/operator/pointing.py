"""One eye: finding the image of a point from the paper print, and setting the mark on it."""

from collections.abc import Iterator, Mapping

import numpy as np

from a7sim.batch import Indices, exclude, put, take
from a7sim.geometry import Array
from a7sim.operator.controls import Controls, side_name
from a7sim.operator.driver import BoolArray
from a7sim.operator.fittings import correct_fittings

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

    def __init__(self, seat: Controls) -> None:
        self.seat = seat
        self.crew = seat.crew
        observer = seat.crew.observer
        eye = min(observer.monocular_um, observer.stereo_um, observer.height_um, observer.parallax_um)
        self.finest_mm = max(FINEST_MM, FINEST_SHARE * 1e-3 * eye * seat.job.plan.projection_height / seat.c)
        """What handwheels and drums are not turned by any more."""
        self._prints: Mapping[int, Mapping[str, Array]] = {}
        self._strayed = np.zeros((3, 2, seat.crew.size))
        self._seen_from = np.zeros((2, seat.crew.size))

    def set_prints(self, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Take up the paper prints by hand (1 left, 2 right): places ``(2, sessions)`` of points in mm."""
        self._prints = prints
        self._strayed[:] = 0.0

    def bring_into_view(self, who: Indices, hand: int, point: str) -> None:
        """Drive to where the print shows a point and look around until it is in the field of view."""
        seat = self.seat
        printed = self.crew.print_position(self._prints[hand], point)
        nowhere = np.isnan(printed[0, who])
        self.crew.give_up(
            who[nowhere], f"point {point} is not pricked on the print of the {side_name(hand)} photograph"
        )
        who = who[~nowhere]
        if not who.size:
            return
        seat.counters(who)
        from_below = seat.rotate_by_swing(who, hand, printed[:, who]) + self._strayed[hand][:, who]
        origin = seat.under_centre(who, hand)
        looking = np.arange(who.size)
        for around in _outward():
            places = origin + seat.to_counter_units((from_below + around[:, None]) * seat.z[who] / seat.c)
            x, y = places[:, looking]
            went = looking[seat.drive(who[looking], {"X": x, "Y": y})]
            found = went[~np.isnan(self.view_point(who[went], hand, point)[0])] if went.size else went
            self._seen_from[:, who[found]] = places[:, found]
            looking = exclude(looking, found)
            if not looking.size:
                return
        looking_on = who[looking]
        again = correct_fittings(seat, looking_on)
        if again.any():
            self.bring_into_view(looking_on[again], hand, point)
            looking = looking[~again]
        seat.give_up_on_errors(who[looking], f"{seat.model.name}: looking for point {point}")
        self.crew.give_up(
            self.crew.remaining(who[looking]),
            f"{seat.model.name}: point {point} is nowhere near where the print shows it in the {side_name(hand)} eye, "
            f"not within {SEARCH_RINGS * SEARCH_STEP_MM:.0f} mm: wrong picture in the projector, or the base "
            "setting does not belong to this model",
        )

    def at_rest_mm(self, looks: int) -> float:
        """Return what is not turned any more after so many looks, mm."""
        return self.finest_mm if looks < PATIENT_LOOKS else max(self.finest_mm, IMPATIENT_MM)

    def measure_drift(self, who: Indices, hand: int, point: str, readings: Array) -> None:
        """Bear in mind how far from where the print showed it a point was found, by its readings ``(2 or 3, m)``."""
        seat = self.seat
        expected = seat.rotate_by_swing(who, hand, self.crew.print_position(self._prints[hand], point)[:, who])
        away = seat.to_mm(readings[:2] - seat.under_centre(who, hand))
        self._strayed[hand][:, who] = away * seat.c / seat.z[who] - expected

    def view_point(self, who: Indices, hand: int, point: str) -> Array:
        """Look: where the image stands from the mark ``(2, m)`` in um, nan where it is not in the field of view."""
        self.crew.spend(who, self.crew.observer.seconds_to_look, "looking")
        return self.crew.view_points(who, point, lambda them, name: self.seat.hands.view_point(them, hand, name))

    def bisect(self, who: Indices, hand: int, point: str, errors: Array) -> None:
        """Turn X and Y until the image seems to lie at the mark; errors ``(2, sessions)`` in um."""
        seat = self.seat
        watch = DivergenceMonitor(2, self.crew.size)
        for looks in range(MAX_LOOKS):
            seen = self.view_point(who, hand, point)
            if not watch.is_converging(who, seen):
                lost = np.isnan(seen[0]) | watch.is_diverging(who, seen).any(axis=0)
                if lost.any():
                    self._look_again_with_levers_right(who, hand, point, seen, lost)
                    self._ran_away(who[lost], hand, point)
                    who, seen = who[~lost], seen[:, ~lost]
            steps = (seen + take(errors, who)) * (1e-3 * take(seat.z, who) / seat.c)
            moving = ~(np.abs(steps) < self.at_rest_mm(looks)).all(axis=0)
            who = who[moving]
            if not who.size:
                return
            seat.turn(who, seat.to_counter_units(steps[:, moving]))
        seat.give_up_on_errors(who, f"{seat.model.name}: pointing at {point}")
        self.crew.give_up(
            self.crew.remaining(who),
            f"{seat.model.name}: point {point}: the mark cannot be brought to rest on the image",
        )

    def _look_again_with_levers_right(self, who: Indices, hand: int, point: str, seen: Array, lost: BoolArray) -> None:
        """Put right the levers of those from whom a point ran away, go back to where it was seen and look, in place."""
        away = np.flatnonzero(lost)
        mended = away[correct_fittings(self.seat, who[away])]
        if mended.size:
            self._go_back(who[mended])
            seen[:, mended] = self.view_point(who[mended], hand, point)
            lost[mended] = np.isnan(seen[0, mended])

    def _go_back(self, who: Indices) -> None:
        self.seat.drive(who, {"X": self._seen_from[0, who], "Y": self._seen_from[1, who]})

    def _ran_away(self, who: Indices, hand: int, point: str) -> None:
        for session in who:
            one = np.array([session])
            self.crew.give_up(
                one,
                f"{self.seat.model.name}: point {point} runs away from the mark in the {side_name(hand)} eye: "
                f"{self._why_it_ran_away(one, hand, point)}",
            )

    def _why_it_ran_away(self, one: Indices, hand: int, point: str) -> str:
        """Go back to where the point was seen and try each wheel to find out what is wrong."""
        seat = self.seat
        reasons = []
        for axis, mirror, fitting in (
            (0, "left to right", "diapositive lever"),
            (1, "top to bottom", "Dove prisms"),
        ):
            self._go_back(one)
            counters, seen = seat.counters(one), self.view_point(one, hand, point)
            seat.turn(one, np.eye(2)[:, [axis]])
            counters_then, seen_then = seat.counters(one), self.view_point(one, hand, point)
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

    def is_converging(self, who: Indices, seen: Array) -> bool:
        """Whether all displacements ``(k, m)`` in um are seen and small, and none ever grew; if not, ask on."""
        now = np.abs(seen)
        well = not self._any_grew and bool(now.max(initial=0.0) <= DIVERGENCE_UM)
        if well:
            put(now, who, self._before)
        return well

    def has_grown(self, who: Indices) -> BoolArray:
        """Return which of the displacements ``(k, m)`` had grown when they were last seen."""
        return take(self._times, who) > 0

    def is_diverging(self, who: Indices, seen: Array) -> BoolArray:
        """Return which of the displacements ``(k, m)`` in um have grown in look after look."""
        now = np.abs(seen)
        grown = (now > 1.4 * take(self._before, who)) & (now > DIVERGENCE_UM)
        put(now, who, self._before)
        if not grown.any() and not self._any_grew:
            return grown
        self._any_grew = True
        times = np.where(grown, take(self._times, who) + 1, 0)
        self._times[:, who] = times
        return np.asarray(times >= DIVERGENCE_LOOKS)


def _outward() -> Iterator[Array]:
    """Yield shifts in mm at photo scale, from the middle outward in rings."""
    yield np.zeros(2)
    for ring in range(1, SEARCH_RINGS + 1):
        for direction in np.arange(6 * ring) * (2.0 * np.pi / (6 * ring)):
            yield ring * SEARCH_STEP_MM * np.array([np.cos(direction), np.sin(direction)])
