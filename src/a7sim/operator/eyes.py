"""One eye: finding the image of a point from the paper print, and setting the mark on it."""

from collections.abc import Iterator, Mapping

import numpy as np

from a7sim.geometry import Array
from a7sim.manual import NOT_VISIBLE
from a7sim.operator.seat import Seat, side

MOST_LOOKS = 40
"""At one setting of the mark."""

AT_REST_MM = 0.0015
"""A handwheel is let go when it would have to be turned by less than this."""

SEARCH_RINGS = 3
SEARCH_STEP_MM = 14.0
"""At photo scale: how far the operator looks around for a point that is not where the print shows it."""

RUNNING_AWAY_UM = 150.0
RUNNING_AWAY_LOOKS = 3
"""What grows in so many looks in a row, though it is turned down, runs away."""

Errors = tuple[float, float]


class Eyes:
    """The eyes of a person in a seat, each looking at its own photograph."""

    def __init__(self, seat: Seat) -> None:
        self.seat = seat
        self._prints: dict[int, dict[str, Array]] = {}
        self._strayed = {1: np.zeros(2), 2: np.zeros(2)}
        self._seen_from = np.zeros(2)

    def take_prints(self, prints: Mapping[int, Mapping[str, Array]]) -> None:
        """Take up the paper prints by hand (1 left, 2 right): places ``(2,)`` of points in mm."""
        self._prints = {hand: dict(each) for hand, each in prints.items()}
        self._strayed = {1: np.zeros(2), 2: np.zeros(2)}

    def bring_into_view(self, hand: int, point: str) -> None:
        """Drive to where the print shows a point and look around until it is in the field of view."""
        seat = self.seat
        print_place = self._prints[hand].get(point)
        if print_place is None:
            raise seat.person.give_up(f"point {point} is not pricked on the print of the {side(hand)} photograph")
        seat.counters()
        expected = seat.on_carrier(hand, print_place)
        origin = seat.below(hand)
        for around in _outward():
            place = origin + (expected + self._strayed[hand] + around) * seat.z / seat.c
            if seat.drive("DRIV:X {:.2f};Y {:.2f}".format(*place)) and self.seen(hand, point) is not None:
                self._seen_from = place
                return
        seat.see_that_nothing_was_refused(f"looking for point {point}")
        raise seat.person.give_up(
            f"{seat.model.name}: point {point} is nowhere near where the print shows it in the {side(hand)} eye, "
            f"not within {SEARCH_RINGS * SEARCH_STEP_MM:.0f} mm: wrong picture in the projector, or the base "
            "setting does not belong to this model"
        )

    def learn_straying(self, hand: int, point: str, readings: Array) -> None:
        """Bear in mind how far from where the print showed it a point was found."""
        seat = self.seat
        expected = seat.on_carrier(hand, self._prints[hand][point])
        self._strayed[hand] = (readings[:2] - seat.below(hand)) * seat.c / seat.z - expected

    def seen(self, hand: int, point: str) -> Array | None:
        """Look: where the image stands from the mark ``(2,)`` in um, None when it is not in the field of view."""
        person = self.seat.person
        person.look()
        seen = np.array(person.client.numbers(f'EYEP{hand}? "{point}"'))
        return None if seen[0] == float(NOT_VISIBLE) else seen

    def bisect(self, hand: int, point: str, error: Errors) -> None:
        """Turn X and Y until the image seems to lie at the mark."""
        seat = self.seat
        scale = 1e-3 * seat.z / seat.c
        watch = Watch()
        for _ in range(MOST_LOOKS):
            seen = self.seen(hand, point)
            if seen is None or watch.running_away(seen).any():
                raise self._ran_away(hand, point)
            steps = (seen + error) * scale
            if (np.abs(steps) < AT_REST_MM).all():
                return
            seat.person.turn("WHE:X {:.3f};Y {:.3f}".format(*steps))
        seat.see_that_nothing_was_refused(f"pointing at {point}")
        raise seat.person.give_up(f"{seat.model.name}: point {point}: the mark cannot be brought to rest on the image")

    def _ran_away(self, hand: int, point: str) -> Exception:
        """Go back to where the point was seen, try each wheel to find out what is wrong, and give up."""
        seat = self.seat
        reasons = []
        for axis, mirror, fitting in (
            (0, "left to right", "diapositive lever"),
            (1, "top to bottom", "Dove prisms"),
        ):
            seat.drive("DRIV:X {:.2f};Y {:.2f}".format(*self._seen_from))
            counters, seen = seat.counters(), self.seen(hand, point)
            seat.person.turn(f"WHE:{'XY'[axis]} 1.00")
            counters_then, seen_then = seat.counters(), self.seen(hand, point)
            if counters_then[axis] < counters[axis]:
                reasons.append(f"the {'XY'[axis]} wheel turns the wrong way (its collar)")
            elif seen is not None and seen_then is not None and seen_then[axis] > seen[axis]:
                reasons.append(f"the picture is mirrored {mirror} (the {fitting})")
        reason = " and ".join(reasons) or "it left the field of view"
        return seat.person.give_up(
            f"{seat.model.name}: point {point} runs away from the mark in the {side(hand)} eye: {reason}"
        )


class Watch:
    """Watches whether displacements grow though they are being turned down."""

    def __init__(self) -> None:
        self._before: Array | None = None
        self._times: Array | int = 0

    def running_away(self, seen: Array) -> Array:
        """Return which of the displacements in um have grown in look after look."""
        before, self._before = self._before, np.abs(seen)
        if before is None:
            return np.zeros(seen.shape, dtype=bool)
        grown = (self._before > 1.4 * before) & (self._before > RUNNING_AWAY_UM)
        self._times = np.where(grown, self._times + 1, 0)
        return np.asarray(self._times >= RUNNING_AWAY_LOOKS)


def _outward() -> Iterator[Array]:
    """Yield shifts in mm at photo scale, from the middle outward in rings."""
    yield np.zeros(2)
    for ring in range(1, SEARCH_RINGS + 1):
        for direction in np.arange(6 * ring) * (2.0 * np.pi / (6 * ring)):
            yield ring * SEARCH_STEP_MM * np.array([np.cos(direction), np.sin(direction)])
