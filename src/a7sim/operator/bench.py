"""What a procedure asks of whoever sits at the instrument: the same for one real link and for a batch of sessions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from a7sim.geometry import Array
from a7sim.operator.person import DoesNotFit

ELEMENT_NODES: Mapping[str, str] = {
    "kappa": "KAPP",
    "phi": "PHI",
    "omega": "OMEG",
    "by": "BY",
    "bz": "BZ",
    "c": "PDIS",
}


class CannotFuse(Exception):
    """The two images of a point are too far apart to be brought together with by."""


@dataclass(frozen=True)
class Parallaxes:
    """Y-parallaxes ``(n,)`` in mm, left-hand minus right-hand, and the places ``(3, n)`` they were read at.

    x is counted from the left-hand centre, y from the base line, z below the centres, all in mm.
    """

    p: Array
    places: Array


class Bench(Protocol):
    """One who sets, looks and reads. Points are named; arrays are in the order of the names."""

    def elements(self, names: Sequence[str]) -> dict[str, float]:
        """Read the counters of elements such as kappa1, in gon or mm."""

    def set_elements(self, settings: Mapping[str, float]) -> None:
        """Set elements through their counters."""

    def parallaxes(self, points: Sequence[str], readings: int) -> Parallaxes:
        """Measure y-parallaxes with by' and by", so many readings of each. Raises CannotFuse."""

    def point_with(self, hand: int, points: Sequence[str], level: float) -> Array:
        """Point with the eye of one photograph (1 left-hand, 2 right-hand) at a Z reading; X, Y ``(2, n)``."""

    def point_again(self, hand: int, point: str, level: float, why: str) -> Array:
        """Strike out a pointing and make it once more; X, Y ``(2,)``."""

    def measure(self, points: Sequence[str]) -> Array:
        """Measure model points stereoscopically, two pointings that agree; X, Y, Z ``(3, n)``, NaN where not fused."""

    def in_frame(self, readings: Array, level: float) -> Array:
        """Return X, Y readings ``(2, n)`` at a Z reading as places x, y, z ``(3, n)`` in mm (see Parallaxes)."""

    @property
    def level_now(self) -> float:
        """The Z reading where the mark stands."""

    def levels_shown(self, levels: tuple[float, float]) -> tuple[float, float]:
        """Return two Z readings as the counter shows them when it is driven there."""

    def begin_round(self, number: int) -> None:
        """Begin a round of a procedure: what is read now is entered under its number."""

    def compute(self) -> None:
        """Spend the time of one computation."""

    def remark(self, text: str) -> None:
        """Write a remark into the book."""


def given_up(bench: Bench, text: str) -> DoesNotFit:
    """Write what does not fit into the book and return it as an error to raise."""
    bench.remark(f"does not fit: {text}")
    return DoesNotFit(text)


def wrapped(gon: float) -> float:
    """Return an angle within 200 gon of zero."""
    return (gon + 200.0) % 400.0 - 200.0


def counter_value(name: str, value: float) -> float:
    """Return what the counter of an element must show, kappa brought to 0..400."""
    return round(value % 400.0, 2) % 400.0 if name.startswith("kappa") else round(value, 2)
