"""Stereoscopic setting of the floating mark on a point, and clearing of its y-parallax with an element."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, exclude, put, take
from a7sim.geometry import Array
from a7sim.operator.driving.driver import BoolArray
from a7sim.operator.driving.fittings import correct_fittings
from a7sim.operator.driving.pointing import MAX_LOOKS, DivergenceMonitor, Pointing

MAX_RISE_MM = 20.0
"""Maximum rotation of the foot disc between two looks."""

RISES_TO_FUSE_MM = (0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0)
"""Heights at which the point is looked for in the right eyepiece as well."""


@dataclass(frozen=True)
class SettingErrors:
    """Errors of setting of a batch: in plan ``(2, sessions)`` and in x-parallax, um."""

    plan: Array
    height: Array


@dataclass(frozen=True)
class Clearing:
    """Element that clears a y-parallax."""

    element: str
    gain: Array
    """Change of the parallax by one unit of its counter ``(sessions,)``, mm."""
    error: Array
    """Error of the perceived parallax ``(sessions,)``, um at photo scale."""


class FloatingMark:
    """The mark in both eyepieces."""

    def __init__(self, pointing: Pointing) -> None:
        self.pointing = pointing
        self.controls = pointing.controls
        self.operators = pointing.operators

    def fuse(self, active: Indices, point: str, judgement: SettingErrors) -> Indices:
        """Set the mark on a point, first with the left eye, then with both; return the sessions that fused it."""
        controls, pointing, operators = self.controls, self.pointing, self.operators
        pointing.bring_into_view(active, 1, point)
        active = operators.remaining(active)
        height = np.zeros(operators.size)
        height[active] = -controls.z[active]
        exactly = np.zeros((2, operators.size))
        fused: list[Indices] = []
        for rise in RISES_TO_FUSE_MM:
            there = active
            if rise:
                there = active[controls.drive_z_to(active, height[active] + rise)]
                controls.driver.pop_errors(active)
                if not there.size:
                    continue
                pointing.bring_into_view(there, 1, point)
                there = operators.remaining(there)
            pointing.bisect(there, 1, point, exactly)
            there = operators.remaining(there)
            seen = there[~np.isnan(pointing.view_point(there, 2, point)[0])]
            if seen.size:
                fused.append(self.settle(seen, point, judgement))
            active = exclude(operators.remaining(active), seen)
            if not active.size:
                return _together(fused)
        controls.drive_z_to(active, height[active])
        return _together(fused)

    def settle(
        self, active: Indices, point: str, judgement: SettingErrors, clearing: Clearing | None = None
    ) -> Indices:
        """Turn X, Y, Z, and an element if one clears the y-parallax, until the mark appears to be on the point.

        Return the sessions that succeeded; the others gave up, lost the point or reached the element's end.
        """
        controls, pointing, operators = self.controls, self.pointing, self.operators
        drum = _Drum(self, active, clearing) if clearing is not None else None
        watch = DivergenceMonitor(4, operators.size)
        settled: list[Indices] = []
        begun = np.full((3, operators.size), np.nan)
        for looks in range(MAX_LOOKS):
            seen = self.view(active, point)
            well = watch.is_converging(active, seen)
            if not well:
                self._see_what_runs_away(active, point, seen, watch, begun, clearing)
            if operators.reasons or not well:
                keep = operators.is_active(active) & ~np.isnan(seen).any(axis=0)
                active, seen = active[keep], seen.compress(keep, axis=-1)
            if not active.size:
                return _together(settled)
            readings = controls.counters(active)
            if looks == 0:
                put(readings, active, begun)
            x, y, _ = controls.model_position(active, readings)
            z, bx = take(controls.z, active), controls.bx(active)
            scale = 1e-3 * z / controls.c
            rise = (seen[2] + take(judgement.height, active)) * scale * z / np.abs(bx)
            rise = np.minimum(np.maximum(rise, -MAX_RISE_MM), MAX_RISE_MM)
            along_the_rays = -rise / z * np.array([x - bx / 2.0, y])
            steps = (seen[:2] + take(judgement.plan, active)) * scale + along_the_rays
            at_rest = pointing.at_rest_mm(looks)
            moving = np.maximum(np.abs(steps).max(axis=0), np.abs(rise)) >= at_rest
            wheels = np.concatenate([controls.to_counter_units(steps), [rise * controls.units_per_mm]])
            amounts: Array | None = None
            if drum is not None:
                amounts, at_end = drum.to_turn(active, seen[3] * scale, scale, at_rest)
                moving |= amounts != 0.0
                if at_end.any():
                    on = ~at_end
                    active, wheels, amounts, moving = active[on], wheels.compress(on, axis=-1), amounts[on], moving[on]
            settled.append(active[~moving])
            active = active[moving]
            if not active.size:
                return _together(settled)
            controls.turn(
                active,
                wheels.compress(moving, axis=-1),
                clearing.element if clearing else None,
                amounts[moving] if amounts is not None else None,
            )
        controls.give_up_on_errors(active, f"{controls.model.name}: setting the mark on {point}")
        operators.give_up(
            operators.remaining(active),
            f"{controls.model.name}: point {point} cannot be brought to rest under the mark stereoscopically",
        )
        return _together(settled)

    def view(self, active: Indices, point: str) -> Array:
        """Return the view of both eyes ``(4, m)``: x and y from the mark (mean of both), px, py, um; nan if lost."""
        self.operators.spend(active, self.operators.observer.seconds_to_look, "looking")
        lx, ly, rx, ry = self.operators.view_points(active, point, self.controls.driver.view_point_stereo)
        return np.array([(lx + rx) / 2.0, (ly + ry) / 2.0, lx - rx, ly - ry])

    def _see_what_runs_away(
        self,
        active: Indices,
        point: str,
        seen: Array,
        watch: DivergenceMonitor,
        begun: Array,
        clearing: Clearing | None,
    ) -> None:
        """Correct the fittings of sessions whose parallaxes grow if these are wrong, otherwise give up."""
        unseen = np.isnan(seen)
        vanished = watch.has_grown(active) & unseen.any(axis=0)
        running_away = watch.is_diverging(active, np.where(unseen, 0.0, seen))
        running_away[3] &= clearing is not None
        away = (vanished | running_away)[2:]
        if away.any():
            mended = self._look_again_with_levers_right(active, point, seen, away, begun)
            running_away[:, mended] = False
            self._see_that_it_fuses(active, point, running_away, clearing)

    def _look_again_with_levers_right(
        self, active: Indices, point: str, seen: Array, parallaxes_grow: BoolArray, begun: Array
    ) -> npt.NDArray[np.intp]:
        """Correct the fittings of sessions whose parallaxes grow, return to the start and look again, in place.

        Return the sessions whose fittings were corrected, as indices into `active`.
        """
        away = np.flatnonzero(parallaxes_grow.any(axis=0))
        mended = away[correct_fittings(self.controls, active[away])]
        if mended.size:
            self.controls.drive(active[mended], dict(zip("XYZ", begun[:, active[mended]], strict=True)))
            seen[:, mended] = self.view(active[mended], point)
        return mended

    def _see_that_it_fuses(
        self, active: Indices, point: str, running_away: BoolArray, clearing: Clearing | None
    ) -> None:
        model = self.controls.model.name
        self.operators.give_up(
            active[running_away[2]],
            f"{model}: point {point}: the x-parallax grows when the mark is moved to clear it, the "
            "relief is inside out: the eyes see each other's pictures (triangulation lever, base)",
        )
        if clearing is not None:
            self.operators.give_up(
                self.operators.remaining(active[running_away[3]]),
                f"{model}: point {point}: the y-parallax grows when {clearing.element} is turned to clear "
                "it: the picture is mirrored or the base is set for the other arrangement",
            )


def _together(parts: Sequence[Indices]) -> Indices:
    return np.sort(np.concatenate([np.zeros(0, dtype=np.intp), *parts]))


class _Drum:
    """Drum of an element that is being turned."""

    def __init__(self, mark: FloatingMark, active: Indices, clearing: Clearing) -> None:
        self._controls = mark.controls
        self._clearing = clearing
        self._element = mark.controls.manual.elements[clearing.element]
        mark.controls.grab_drum(active, clearing.element)

    def to_turn(self, active: Indices, parallax: Array, scale: Array, at_rest: float) -> tuple[Array, BoolArray]:
        """Return the required turn, zero if the parallax is clear, and where it is out of range ``(m,)``."""
        left = parallax + take(self._clearing.error, active) * scale
        amounts = np.where(np.abs(left) < at_rest, 0.0, -left / take(self._clearing.gain, active))
        if self._element.endless:
            return amounts, np.zeros(active.size, dtype=bool)
        wanted = self._controls.held_position(active, self._clearing.element) + amounts
        return amounts, (wanted < self._element.low) | (wanted > self._element.high)
