"""Both eyes: setting the floating mark on a point, and clearing its y-parallax with an element."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from a7sim.geometry import Array
from a7sim.manual import LEAST_COUNT, NOT_VISIBLE
from a7sim.operator.bench import CannotFuse
from a7sim.operator.eyes import AT_REST_MM, MOST_LOOKS, Errors, Eyes, Watch
from a7sim.operator.seat import header

CONTENT = 0.45
"""With this many counts of the element left, just below a half, no other count can be nearer; beyond it the next is
tried."""

LONGEST_RISE_MM = 20.0
"""The foot disc is not turned further than this between two looks."""

RISES_TO_FUSE_MM = (0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0)
"""Where the mark is taken to find the height at which the right eye sees the point as well."""


@dataclass(frozen=True)
class Clearing:
    """An element that is turned on vanishing y-parallax, and what one unit of its counter adds to the parallax, mm."""

    element: str
    gain: float
    error: float = 0.0
    """um at photo scale: by how much the person misjudges the parallax."""


class FloatingMark:
    """The mark as both eyes see it."""

    def __init__(self, eyes: Eyes) -> None:
        self.eyes = eyes
        self.seat = eyes.seat

    def fuse(self, point: str, plan_error: Errors, height_error: float) -> None:
        """Set the mark on a point, first with the left eye, then with both. Raises CannotFuse."""
        seat, eyes = self.seat, self.eyes
        eyes.bring_into_view(1, point)
        height = -seat.z
        for rise in RISES_TO_FUSE_MM:
            if rise:
                if not seat.drive_z_to(height + rise):
                    seat.person.client.errors()
                    continue
                eyes.bring_into_view(1, point)
            eyes.bisect(1, point, (0.0, 0.0))
            if eyes.seen(2, point) is not None:
                self.settle(point, plan_error, height_error)
                return
        seat.drive_z_to(height)
        raise CannotFuse(point)

    def settle(self, point: str, plan_error: Errors, height_error: float, clearing: Clearing | None = None) -> None:
        """Turn X, Y, Z, and an element where one is to clear the y-parallax, until the mark seems to stand there."""
        seat = self.seat
        now = seat.elements([clearing.element])[clearing.element] if clearing else 0.0
        watch = Watch()
        tried: dict[float, float] = {}
        for _ in range(MOST_LOOKS):
            seen = self.looked(point)
            self._see_that_it_fuses(point, watch.running_away(seen), clearing)
            x, y, _ = seat.place(seat.counters())
            scale = 1e-3 * seat.z / seat.c
            rise = float(seen[2] + height_error) * scale * seat.z / abs(seat.bx)
            rise = min(max(rise, -LONGEST_RISE_MM), LONGEST_RISE_MM)
            along_the_rays = -rise / seat.z * np.array([x - seat.bx / 2.0, y])
            dx, dy = (seen[:2] + plan_error) * scale + along_the_rays
            at_rest = max(abs(dx), abs(dy), abs(rise)) < AT_REST_MM
            line = f"WHE:X {dx:.3f};Y {dy:.3f};Z {rise * seat.units_per_mm:.3f}"
            if clearing is not None:
                step = -float(seen[3] + clearing.error) * scale / clearing.gain
                tried[now] = abs(step)
                following = self._next_count(clearing.element, now, step, tried)
                if following != now:
                    at_rest = False
                    line += f";:{header(clearing.element)} {following:.2f}"
                    now = following
            if at_rest:
                return
            seat.person.turn(line)
        seat.see_that_nothing_was_refused(f"setting the mark on {point}")
        raise seat.person.give_up(
            f"{seat.model.name}: point {point} cannot be brought to rest under the mark stereoscopically"
        )

    def looked(self, point: str) -> Array:
        """Return what both eyes see: x and y from the mark (mean of both), px, py, in um. Raises CannotFuse."""
        person = self.seat.person
        person.look()
        lx, ly, rx, ry = person.client.numbers(f'EYEP1? "{point}";:EYEP2? "{point}"')
        if float(NOT_VISIBLE) in (lx, rx):
            raise CannotFuse(point)
        return np.array([(lx + rx) / 2.0, (ly + ry) / 2.0, lx - rx, ly - ry])

    def _next_count(self, name: str, now: float, step: float, tried: Mapping[float, float]) -> float:
        """Return the count of an element to go to: here if content, else the nearest not tried, else the best tried."""
        if abs(step) < CONTENT * LEAST_COUNT:
            return now
        wanted = round(now + math.copysign(max(abs(step), LEAST_COUNT), step), 2)
        element = self.seat.manual.elements[name]
        if element.endless:
            wanted = round(wanted % element.high, 2)
        elif not element.low <= wanted <= element.high:
            raise CannotFuse(name)
        if wanted in tried and abs(step) < 1.5 * LEAST_COUNT:
            return now if tried[now] <= tried[wanted] else wanted
        return wanted

    def _see_that_it_fuses(self, point: str, running_away: Array, clearing: Clearing | None) -> None:
        seat = self.seat
        if running_away[2]:
            raise seat.person.give_up(
                f"{seat.model.name}: point {point}: the x-parallax grows when the mark is moved to clear it, the "
                "relief is inside out: the eyes see each other's pictures (triangulation lever, base)"
            )
        if clearing and running_away[3]:
            raise seat.person.give_up(
                f"{seat.model.name}: point {point}: the y-parallax grows when {clearing.element} is turned to clear "
                "it: the picture is mirrored or the base is set for the other arrangement"
            )
