"""What the plotters of a fleet are made of, each part held as arrays of all of them: carriages, drums, carriers.

`who` are the indices ``(m,)`` of the instruments that are worked; what comes in and goes out has them as its last axis.
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
    """Return values rounded as the counters of one instrument round them: a tie by what the number exactly is.

    Wheels turn by thousandths, so that ties are common; numpy scales before it rounds and would take some for halves.
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
    """The errors of screws that repeat with every turn: amplitudes and phases ``(3, instruments)``, lead; mm."""

    amplitude: Array
    lead: float
    phase: Array

    def at(self, active: Indices, position: Array) -> Array:
        """Return by how much the nuts have gone further ``(3, m)`` than the turns say, mm."""
        turns = 2.0 * math.pi * position / self.lead
        return np.asarray(take(self.amplitude, active) * np.sin(turns + take(self.phase, active)))


class Carriages:
    """The carriages X, Y and Z of every instrument: where their spindles stand and where these bring them with play."""

    def __init__(self, variant: Variant, play: Array, runouts: PeriodicErrors | None) -> None:
        self._low, self._high = np.array([variant.carriages[axis] for axis in AXES]).T
        self.at = np.repeat(np.array([[variant.carriages_at_rest[axis]] for axis in AXES]), play.size, axis=1)
        self._shaft = self.at.copy()
        self._half_play = play / 2.0
        self._runouts = runouts

    def position(self, active: Indices) -> Array:
        """Return where they really stand ``(3, m)``."""
        position = take(self._shaft, active)
        return position if self._runouts is None else position + self._runouts.at(active, position)

    def position_without_periodic_error(self, active: Indices, place: Array) -> Array:
        """Return where they would stand ``(3, m)`` without the errors that the turns of their screws repeat."""
        position = place
        if self._runouts is not None:
            for _ in range(APPROXIMATIONS):
                position = place - self._runouts.at(active, position)
        return position

    def snap_to_end(self, axis: int, places: Array, within: float) -> Array:
        """Return places ``(m,)`` of a carriage, the end of its range where they are so near it."""
        at_end = np.clip(places, self._low[axis], self._high[axis])
        return np.where(np.abs(at_end - places) <= within, at_end, places)

    def within_range(self, axis: int, places: Array) -> BoolArray:
        """Return to which places ``(m,)`` a carriage can be run."""
        return np.asarray((places >= self._low[axis] - 1e-9) & (places <= self._high[axis] + 1e-9))

    def range_contains(self, low: Array, high: Array) -> bool:
        """Return whether the ranges of the first k carriages hold all from the low to the high places ``(k,)``."""
        k = len(low)
        return bool(((low >= self._low[:k]) & (high <= self._high[:k])).all())

    def move_to(self, active: Indices, first: int, places: Array) -> None:
        """Run carriages, from a first one on, to places ``(k, m)`` that they allow."""
        rows = slice(first, first + len(places))
        half = take(self._half_play, active)
        put(places, active, self.at[rows])
        put(
            np.minimum(np.maximum(take(self._shaft[rows], active), places - half), places + half),
            active,
            self._shaft[rows],
        )


class Drums:
    """A spindle of every instrument: what the drum shows, where the shaft follows it with play and setting error."""

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
        """Return where the shafts really stand ``(m,)``."""
        return np.asarray(take(self._shaft, active) + take(self._error, active) + take(self._fault, active))

    def shown(self, active: Indices) -> Array:
        """Return what the counters show ``(m,)``."""
        shown = round_like_counter(take(self.at, active), COUNTER_DECIMALS)
        return round_like_counter(shown % self.high, COUNTER_DECIMALS) if self.endless else np.asarray(shown + 0.0)

    def within_range(self, values: Array) -> BoolArray:
        """Return which values the drum can be turned to."""
        return np.asarray((values >= self.low - 1e-9) & (values <= self.high + 1e-9))

    def value_after_turn(self, active: Indices, amounts: Array) -> Array:
        """Return to what values ``(m,)`` the drums come when they are turned by so much."""
        values = take(self.at, active) + amounts
        return np.asarray(values % self.high if self.endless else values)

    def turn_to(self, active: Indices, values: Array, rngs: Sequence[np.random.Generator] = ()) -> None:
        """Turn the drums to values ``(m,)`` that they allow; with dice, by their counters (see `Spindle.turn_to`)."""
        if self.endless:
            values = values + self.high * np.round((take(self.at, active) - values) / self.high)
        put(values, active, self.at)
        half = take(self._half_play, active)
        put(np.minimum(np.maximum(take(self._shaft, active), values - half), values + half), active, self._shaft)
        for session in active[take(self._sigma, active) > 0.0] if rngs else ():
            self._error[session] = self._sigma[session] * rngs[session].standard_normal()


class Carriers:
    """A picture of the same name on a carrier of every instrument, each laid and centred in its own way."""

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
        """Shift and turn the pictures ``(3, m)``, mm and gon, from where they were laid."""
        self.centring[:, active] = values
        dx, dy, turn = self.laid[:, active] + values
        self._turn[:, :, active] = plane_rotation(turn * GON)
        self._shift[:, active] = dx, dy
        self._placed.clear()

    def point(self, active: Indices, name: str) -> Array:
        """Return where an image point lies on the carriers ``(2, m)``, nan where a picture has none such."""
        placed = self._placed.get(name)
        if placed is None:
            placed = self._placed[name] = mxv(self._turn, self._film(name)) + self._shift
        return take(placed, active)

    def _film(self, name: str) -> Array:
        """Return where an image point lies on the films ``(2, instruments)``."""
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
        """Return the places ``(2, m)`` of points on the paper prints, nan where a print has it not."""
        return _places_of([self.photographs[session].sketch for session in active])


def _places_of(prints: Sequence[NamedPoints]) -> dict[str, Array]:
    """Return the places ``(2, m)`` of marks on many photographs by name, nan where one has it not."""
    alike: dict[tuple[str, ...], list[int]] = {}
    for i, each in enumerate(prints):
        alike.setdefault(each.names, []).append(i)
    places = {name: np.full((2, len(prints)), np.nan) for names in alike for name in names}
    for names, those in alike.items():
        for name, place in zip(names, np.stack([prints[i].xy for i in those], axis=-1).swapaxes(0, 1), strict=True):
            places[name][:, those] = place
    return places
