"""Parts of a batch of plotters as arrays: carriages, drums, carriers.

`active` are the indices ``(m,)`` of the active instruments; parameters and results have them as their last axis.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from a7sim.batch import Indices, put, take
from a7sim.geometry import GON, Array, mxv, plane_rotation
from a7sim.instrument.spindles import APPROXIMATIONS
from a7sim.plotters import COUNTER_DECIMALS, Variant
from a7sim.scene.camera import fiducial_places
from a7sim.scene.photograph import NamedPoints, Photograph

BoolArray = npt.NDArray[np.bool_]

AXES = "XYZ"

TIE_TOLERANCE = 1e-6
"""Of the last decimal."""


def round_like_counter(values: Array, decimals: int) -> Array:
    """Return values rounded like the counters of one instrument: a tie by the exact value of the number.

    Wheels turn by thousandths, so ties are common; numpy scales before it rounds and would take some for halves.
    """
    scaled = values * 10.0**decimals
    nearest = np.rint(scaled)
    scaled -= nearest
    ties = np.abs(scaled, out=scaled) > 0.5 - TIE_TOLERANCE
    nearest /= 10.0**decimals
    if ties.any():
        nearest[ties] = [round(value, decimals) for value in values[ties].tolist()]
    return np.asarray(nearest + 0.0)


@dataclass(frozen=True)
class PeriodicErrors:
    """Periodic errors of screws: amplitudes and phases ``(3, instruments)``, lead; mm."""

    amplitude: Array
    lead: float
    phase: Array

    def at(self, active: Indices, position: Array) -> Array:
        """Return the excess travel of the nuts ``(3, m)`` over the turns, mm."""
        turns = 2.0 * math.pi * position / self.lead
        return np.asarray(take(self.amplitude, active) * np.sin(turns + take(self.phase, active)))


class Carriages:
    """Carriages X, Y and Z of each instrument: positions of their spindles, and of the carriages with play."""

    def __init__(self, variant: Variant, play: Array, runouts: PeriodicErrors | None) -> None:
        self._low, self._high = np.array([variant.carriages[axis] for axis in AXES]).T
        self.at = np.repeat(np.array([[variant.carriages_at_rest[axis]] for axis in AXES]), play.size, axis=1)
        self._shaft = self.at.copy()
        self._half_play = play / 2.0
        self._runouts = runouts

    def position(self, active: Indices) -> Array:
        """Return the true positions ``(3, m)``."""
        position = take(self._shaft, active)
        return position if self._runouts is None else position + self._runouts.at(active, position)

    def position_without_periodic_error(self, active: Indices, place: Array) -> Array:
        """Return the positions ``(3, m)`` without the periodic errors of the screws."""
        position = place
        if self._runouts is not None:
            for _ in range(APPROXIMATIONS):
                position = place - self._runouts.at(active, position)
        return position

    def snap_to_end(self, axis: int, places: Array, within: float) -> Array:
        """Return positions ``(m,)`` of a carriage, replaced by the end of its range where they are within a distance of
        it.
        """
        at_end = np.clip(places, self._low[axis], self._high[axis])
        return np.where(np.abs(at_end - places) <= within, at_end, places)

    def within_range(self, axis: int, places: Array) -> BoolArray:
        """Return which positions ``(m,)`` a carriage can reach."""
        return np.asarray((places >= self._low[axis] - 1e-9) & (places <= self._high[axis] + 1e-9))

    def range_contains(self, low: Array, high: Array) -> bool:
        """Return whether the ranges of the first k carriages contain all between the low and the high positions
        ``(k,)``.
        """
        k = len(low)
        return bool(((low >= self._low[:k]) & (high <= self._high[:k])).all())

    def move_to(self, active: Indices, first: int, places: Array) -> None:
        """Drive carriages, from a first one on, to positions ``(k, m)`` within their ranges."""
        rows = slice(first, first + len(places))
        half = take(self._half_play, active)
        put(places, active, self.at[rows])
        put(
            np.minimum(np.maximum(take(self._shaft[rows], active), places - half), places + half),
            active,
            self._shaft[rows],
        )


class Drums:
    """Spindle of each instrument: the drum reading, and the shaft that follows it with play and setting error."""

    def __init__(
        self,
        at: float,
        low: float,
        high: float,
        endless: bool,
        play: Array,
        sigma: Array,
        fault: Array,
    ) -> None:
        self.low, self.high, self.endless = low, high, endless
        self.at = np.full(fault.shape, at)
        self._shaft = self.at.copy()
        self._error = np.zeros(fault.shape)
        self._half_play, self._sigma, self._fault = play / 2.0, sigma, fault

    def position(self, active: Indices) -> Array:
        """Return the true positions of the shafts ``(m,)``."""
        return np.asarray(take(self._shaft, active) + take(self._error, active) + take(self._fault, active))

    def shown(self, active: Indices) -> Array:
        """Return the counter readings ``(m,)``."""
        shown = round_like_counter(take(self.at, active), COUNTER_DECIMALS)
        return round_like_counter(shown % self.high, COUNTER_DECIMALS) if self.endless else np.asarray(shown + 0.0)

    def within_range(self, values: Array) -> BoolArray:
        """Return to which values the drum can be turned."""
        return np.asarray((values >= self.low - 1e-9) & (values <= self.high + 1e-9))

    def value_after_turn(self, active: Indices, amounts: Array) -> Array:
        """Return the values ``(m,)`` of the drums after a turn by amounts."""
        values = take(self.at, active) + amounts
        return np.asarray(values % self.high if self.endless else values)

    def turn_to(self, active: Indices, values: Array, rngs: Sequence[np.random.Generator] = ()) -> None:
        """Turn the drums to values ``(m,)`` within range; with `rngs`, by their counters (see `Spindle.turn_to`)."""
        if self.endless:
            values = values + self.high * np.round((take(self.at, active) - values) / self.high)
        put(values, active, self.at)
        half = take(self._half_play, active)
        put(np.minimum(np.maximum(take(self._shaft, active), values - half), values + half), active, self._shaft)
        for session in active[take(self._sigma, active) > 0.0] if rngs else ():
            self._error[session] = self._sigma[session] * rngs[session].standard_normal()


class Carriers:
    """Picture of the same name on a carrier of each instrument, each with its own placement and centring."""

    def __init__(self, photographs: Sequence[Photograph], laid: Array) -> None:
        self.name = photographs[0].name
        self.polarity = photographs[0].polarity
        self.photographs = photographs
        self.laid = laid
        self.centring = np.zeros_like(laid)
        self._turn = np.zeros((2, 2, laid.shape[1]))
        self._shift = np.zeros((2, laid.shape[1]))
        self._films = _places_of([photograph.points for photograph in photographs])
        self._placed: dict[str, Array] = {}
        self.centre(np.arange(laid.shape[1]), self.centring)

    def centre(self, active: Indices, values: Array) -> None:
        """Shift and rotate the pictures ``(3, m)``, mm and gon, from their initial placement."""
        self.centring[:, active] = values
        dx, dy, turn = self.laid[:, active] + values
        self._turn[:, :, active] = plane_rotation(turn * GON)
        self._shift[:, active] = dx, dy
        self._placed.clear()

    def point(self, active: Indices, name: str) -> Array:
        """Return the positions of an image point on the carriers ``(2, m)``, nan where a picture does not have it."""
        placed = self._placed.get(name)
        if placed is None:
            placed = self._placed[name] = mxv(self._turn, self._film(name)) + self._shift
        return take(placed, active)

    def _film(self, name: str) -> Array:
        """Return the positions of an image point on the films ``(2, instruments)``."""
        nowhere = np.full((2, len(self.photographs)), np.nan)
        return self._films.get(name, nowhere)

    def fiducial_displacements(self, active: Indices) -> tuple[tuple[str, ...], Array]:
        """Return names and displacements ``(2, n, m)`` of the fiducials from their collimating marks."""
        fiducials = self.photographs[0].fiducials
        names, calibrated = fiducial_places(self.photographs[0].camera)
        marks = calibrated[:, [names.index(name) for name in fiducials.names]]
        film = np.stack([self.photographs[session].fiducials.xy for session in active], axis=-1)
        placed = np.einsum("ijm,jnm->inm", self._turn[:, :, active], film) + self._shift[:, None, active]
        return fiducials.names, np.asarray(placed - marks[:, :, None])

    def sketch(self, active: Indices) -> dict[str, Array]:
        """Return the positions ``(2, m)`` of points on the paper prints, nan where a print does not show them."""
        return _places_of([self.photographs[session].sketch for session in active])


def _places_of(prints: Sequence[NamedPoints]) -> dict[str, Array]:
    """Return the positions ``(2, m)`` of marks on a batch of photographs by name, nan where one does not have it."""
    alike: dict[tuple[str, ...], list[int]] = {}
    for i, each in enumerate(prints):
        alike.setdefault(each.names, []).append(i)
    places = {name: np.full((2, len(prints)), np.nan) for names in alike for name in names}
    for names, members in alike.items():
        for name, place in zip(names, np.stack([prints[i].xy for i in members], axis=-1).swapaxes(0, 1), strict=True):
            places[name][:, members] = place
    return places
