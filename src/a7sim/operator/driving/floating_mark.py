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
"""Maximum rise or fall of the mark by the foot disc between two looks."""

FUSING_RISES_MM = (0.0, 20.0, -20.0, 40.0, -40.0, 60.0, -60.0)
"""Rises of the mark, tried in order, to find the height at which the right eyepiece shows the point too."""


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

    def fuse(self, active: Indices, point: str, setting_errors: SettingErrors) -> Indices:
        """Set the mark on a point, first with the left eye, then with both; return the sessions that fused it."""
        controls, pointing, operators = self.controls, self.pointing, self.operators
        pointing.bring_into_view(active, 1, point)
        active = operators.remaining(active)
        height = np.zeros(operators.size)
        height[active] = -controls.z[active]
        no_errors = np.zeros((2, operators.size))
        fused: list[Indices] = []
        for rise in FUSING_RISES_MM:
            driven = active
            if rise:
                driven = active[controls.drive_z_to(active, height[active] + rise)]
                controls.driver.pop_errors(active)
                if not driven.size:
                    continue
                pointing.bring_into_view(driven, 1, point)
                driven = operators.remaining(driven)
            pointing.bisect(driven, 1, point, no_errors)
            driven = operators.remaining(driven)
            visible = driven[~np.isnan(pointing.view_point(driven, 2, point)[0])]
            if visible.size:
                fused.append(self.settle(visible, point, setting_errors))
            active = exclude(operators.remaining(active), visible)
            if not active.size:
                return _merge(fused)
        controls.drive_z_to(active, height[active])
        return _merge(fused)

    def settle(
        self, active: Indices, point: str, setting_errors: SettingErrors, clearing: Clearing | None = None
    ) -> Indices:
        """Turn X, Y, Z, and an element if one clears the y-parallax, until the mark appears to be on the point.

        Return the sessions that succeeded; the others gave up, lost the point or reached the element's end.
        """
        controls, pointing, operators = self.controls, self.pointing, self.operators
        drum = _Drum(self, active, clearing) if clearing is not None else None
        monitor = DivergenceMonitor(4, operators.size)
        settled: list[Indices] = []
        start_readings = np.full((3, operators.size), np.nan)
        for looks in range(MAX_LOOKS):
            seen = self.view(active, point)
            is_converging = monitor.is_converging(active, seen)
            if not is_converging:
                self._correct_or_give_up(active, point, seen, monitor, start_readings, clearing)
            if operators.reasons or not is_converging:
                is_kept = operators.is_active(active) & ~np.isnan(seen).any(axis=0)
                active, seen = active[is_kept], seen.compress(is_kept, axis=-1)
            if not active.size:
                return _merge(settled)
            readings = controls.counters(active)
            if looks == 0:
                put(readings, active, start_readings)
            x, y, _ = controls.model_position(active, readings)
            z, bx = take(controls.z, active), controls.bx(active)
            scale = 1e-3 * z / controls.c
            rise = (seen[2] + take(setting_errors.height, active)) * scale * z / np.abs(bx)
            rise = np.minimum(np.maximum(rise, -MAX_RISE_MM), MAX_RISE_MM)
            plan_shift = -rise / z * np.array([x - bx / 2.0, y])
            steps = (seen[:2] + take(setting_errors.plan, active)) * scale + plan_shift
            at_rest = pointing.at_rest_mm(looks)
            is_moving = np.maximum(np.abs(steps).max(axis=0), np.abs(rise)) >= at_rest
            wheels = np.concatenate([controls.to_counter_units(steps), [rise * controls.units_per_mm]])
            amounts: Array | None = None
            if drum is not None:
                amounts, is_at_end = drum.required_turn(active, seen[3] * scale, scale, at_rest)
                is_moving |= amounts != 0.0
                if is_at_end.any():
                    is_within = ~is_at_end
                    active, wheels, amounts, is_moving = (
                        active[is_within],
                        wheels.compress(is_within, axis=-1),
                        amounts[is_within],
                        is_moving[is_within],
                    )
            settled.append(active[~is_moving])
            active = active[is_moving]
            if not active.size:
                return _merge(settled)
            controls.turn(
                active,
                wheels.compress(is_moving, axis=-1),
                clearing.element if clearing else None,
                amounts[is_moving] if amounts is not None else None,
            )
        controls.give_up_on_errors(active, f"{controls.model.name}: setting the mark on {point}")
        operators.give_up(
            operators.remaining(active),
            f"{controls.model.name}: point {point} cannot be brought to rest under the mark stereoscopically",
        )
        return _merge(settled)

    def view(self, active: Indices, point: str) -> Array:
        """Return the view of both eyes ``(4, m)``: x and y from the mark (mean of both), px, py, um; nan if lost."""
        self.operators.spend(active, self.operators.observer.seconds_to_look, "looking")
        left_x, left_y, right_x, right_y = self.operators.view_points(
            active, point, self.controls.driver.view_point_stereo
        )
        return np.array([(left_x + right_x) / 2.0, (left_y + right_y) / 2.0, left_x - right_x, left_y - right_y])

    def _correct_or_give_up(
        self,
        active: Indices,
        point: str,
        seen: Array,
        monitor: DivergenceMonitor,
        start_readings: Array,
        clearing: Clearing | None,
    ) -> None:
        """Correct the fittings of sessions whose parallaxes grow where fittings are wrong, otherwise give up."""
        is_unseen = np.isnan(seen)
        has_vanished = monitor.has_grown(active) & is_unseen.any(axis=0)
        is_diverging = monitor.is_diverging(active, np.where(is_unseen, 0.0, seen))
        is_diverging[3] &= clearing is not None
        is_growing = (has_vanished | is_diverging)[2:]
        if is_growing.any():
            corrected = self._correct_fittings_and_look(active, point, seen, is_growing, start_readings)
            is_diverging[:, corrected] = False
            self._give_up_diverging(active, point, is_diverging, clearing)

    def _correct_fittings_and_look(
        self, active: Indices, point: str, seen: Array, is_growing: BoolArray, start_readings: Array
    ) -> npt.NDArray[np.intp]:
        """Correct the fittings of sessions whose parallaxes grow, return to the start and look again, in place.

        Return the sessions whose fittings were corrected, as indices into `active`.
        """
        growing = np.flatnonzero(is_growing.any(axis=0))
        corrected = growing[correct_fittings(self.controls, active[growing])]
        if corrected.size:
            self.controls.drive(active[corrected], dict(zip("XYZ", start_readings[:, active[corrected]], strict=True)))
            seen[:, corrected] = self.view(active[corrected], point)
        return corrected

    def _give_up_diverging(
        self, active: Indices, point: str, is_diverging: BoolArray, clearing: Clearing | None
    ) -> None:
        model = self.controls.model.name
        self.operators.give_up(
            active[is_diverging[2]],
            f"{model}: point {point}: the x-parallax grows when the mark is moved to clear it, the "
            "relief is inside out: the eyes see each other's pictures (triangulation lever, base)",
        )
        if clearing is not None:
            self.operators.give_up(
                self.operators.remaining(active[is_diverging[3]]),
                f"{model}: point {point}: the y-parallax grows when {clearing.element} is turned to clear "
                "it: the picture is mirrored or the base is set for the other arrangement",
            )


def _merge(parts: Sequence[Indices]) -> Indices:
    return np.sort(np.concatenate([np.zeros(0, dtype=np.intp), *parts]))


class _Drum:
    """Drum of an element that is being turned."""

    def __init__(self, mark: FloatingMark, active: Indices, clearing: Clearing) -> None:
        self._controls = mark.controls
        self._clearing = clearing
        self._element = mark.controls.manual.elements[clearing.element]
        mark.controls.grab_drum(active, clearing.element)

    def required_turn(self, active: Indices, parallax: Array, scale: Array, at_rest: float) -> tuple[Array, BoolArray]:
        """Return the required turn, zero if the parallax is clear, and where it is out of range ``(m,)``."""
        remaining = parallax + take(self._clearing.error, active) * scale
        amounts = np.where(np.abs(remaining) < at_rest, 0.0, -remaining / take(self._clearing.gain, active))
        if self._element.endless:
            return amounts, np.zeros(active.size, dtype=bool)
        wanted = self._controls.held_position(active, self._clearing.element) + amounts
        return amounts, (wanted < self._element.low) | (wanted > self._element.high)
