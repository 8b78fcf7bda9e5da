"""Data of the plotters: elements, ranges, gears and fittings.

Instrument and operator use the same data. Source unless stated otherwise: the thesis, tables 3.2, 3.3 and 3.7 and
section 3.2.3.6 (geometry.md, Counters and ranges, Gears, Fittings).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TypeVar

import numpy as np
import numpy.typing as npt

_Counts = TypeVar("_Counts", float, npt.NDArray[np.float64])

TILTS = ("omega", "phi", "kappa")
"""Elements that rotate a projector, from the primary axis inward."""

LEAST_COUNT = 0.01
"""mm and gon, of all counters of the elements and of X and Y (thesis table 3.7)."""

COUNTER_DECIMALS = 2

NOT_VISIBLE = "9.91E37"
"""Reply of the command language for a quantity that cannot be seen or measured (SCPI's not-a-number)."""


SCPI_VERSION = "1999.0"
"""Edition of SCPI of the command language, as reported."""


@dataclass(frozen=True, slots=True)
class Element:
    """Orientation element: its range and its counter zero, in mm or gon."""

    low: float
    high: float
    zero: float
    unit: str
    endless: bool = False


@dataclass(frozen=True, slots=True)
class Gear:
    """Height gear: counter units per mm, and decimals."""

    units_per_mm: float
    decimals: int = COUNTER_DECIMALS


@dataclass(frozen=True, slots=True)
class Scale:
    """Scale of a carriage: ``at_origin + units_per_mm * position`` until it is preset."""

    units_per_mm: float = 1.0
    at_origin: float = 0.0
    """Its reading in the origin of the instrument frame."""
    unit: str = "mm"
    """Unit in which a reading may be given, empty if it is no length."""
    preset: bool = True
    """Whether it can be preset."""


MILLIMETRES = Scale()
GEARED = Scale(unit="")


@dataclass(frozen=True, slots=True)
class Rates:
    """Speeds of the parts of a plotter [assumption of this project: no source gives any of it]."""

    carriage: float = 10.0
    """mm/s of the X, Y and Z carriages."""
    length: float = 2.0
    """mm/s of base components, principal distances and pictures on their carriers."""
    angle: float = 1.0
    """gon/s of tilts, swings and pictures on their carriers."""
    lever: float = 2.0
    """s to change a fitting or the Zeiss parallelogram."""
    gear: float = 10.0
    """s to exchange the wheels of a height gear."""
    laying: float = 15.0
    """s to mount or remove a picture."""

    def of(self, unit: str) -> float:
        """Return the speed of an element in mm or gon per second."""
        return self.angle if unit == "gon" else self.length


@dataclass(frozen=True)
class Variant:
    """Type of a plotter. The instrument does not have elements or fittings that are not listed."""

    name: str
    elements: Mapping[str, Element]
    carriages: Mapping[str, tuple[float, float]]
    """mm; Z as height of the mark below the base line, hence negative."""
    height_gears: Mapping[str, Gear]
    base_modes: tuple[str, ...]
    fittings: tuple[str, ...]
    scales: Mapping[str, Scale] = field(
        default_factory=lambda: MappingProxyType({"X": MILLIMETRES, "Y": MILLIMETRES, "Z": GEARED})
    )
    centres_on_base: tuple[float, float] = (0.0, 1.0)
    """X positions of the left-hand and the right-hand centre, as shares of bx from the origin."""
    carriages_at_rest: Mapping[str, float] = field(
        default_factory=lambda: MappingProxyType({"X": 0.0, "Y": 0.0, "Z": -300.0})
    )
    field_radius_mm: float = 10.0
    """Radius of the field of view at photo scale [assumption; no source at hand]."""
    rod_limit_gon: float = 62.0
    """Maximum inclination of a space rod from the plumb line [assumption; no source at hand]."""
    carriage_lead_mm: float = 5.0
    """Travel of a carriage per turn of an X, Y or Z spindle [assumption; no source states mm per turn]."""
    centring_mm: float = 15.0
    centring_gon: float = 20.0
    """Range of shift and rotation of a picture on its carrier [assumption; no source at hand]."""
    rates: Rates = Rates()

    def missing_elements(self, *elements: str) -> list[str]:
        """Return those of the elements that the plotter does not have."""
        return [name for name in elements if name not in self.elements]

    def tilts(self, counts: Mapping[str, _Counts], projector: int) -> tuple[_Counts, _Counts, _Counts]:
        """Return omega, phi and kappa of a projector in gon from their zeros, by the counter readings of elements."""
        omega, phi, kappa = (
            counts[name] - self.elements[name].zero for name in (f"{name}{projector}" for name in TILTS)
        )
        return omega, phi, kappa


@dataclass(frozen=True, slots=True)
class Fittings:
    """Positions of the five fittings."""

    dove: str
    triangulation: str
    diapositive: str
    xcollar: str
    ycollar: str

    def as_words(self) -> dict[str, str]:
        """Return the position of each fitting by its name."""
        return {name: getattr(self, name) for name in POSITIONS_OF}


POSITIONS_OF: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "dove": ("inside", "outside"),
        "triangulation": ("back", "front"),
        "diapositive": ("right", "left"),
        "xcollar": ("in", "out"),
        "ycollar": ("in", "out"),
    }
)
"""The two positions of each fitting."""

REQUIRED_FITTINGS: Mapping[tuple[str, str], Fittings] = MappingProxyType(
    {
        ("negative", "inside"): Fittings("inside", "back", "right", "in", "in"),
        ("negative", "outside"): Fittings("outside", "front", "right", "in", "in"),
        ("positive", "inside"): Fittings("outside", "back", "left", "in", "out"),
        ("positive", "outside"): Fittings("inside", "front", "left", "in", "out"),
    }
)
"""The thesis's table: the fittings required by picture and base."""


BASE_COMPONENTS = ("by1", "by2", "bz1", "bz2")
"""Elements that shift single centres across the base and in height."""


def _both(name: str, element: Element) -> dict[str, Element]:
    return {f"{name}1": element, f"{name}2": element}


A7 = Variant(
    name="A7",
    elements=MappingProxyType(
        {
            **_both("c", Element(98.0, 215.0, 150.0, "mm")),
            **_both("kappa", Element(0.0, 400.0, 0.0, "gon", endless=True)),
            "phi1": Element(70.0, 106.0, 100.0, "gon"),
            "phi2": Element(94.0, 130.0, 100.0, "gon"),
            **_both("omega", Element(70.0, 109.0, 100.0, "gon")),
            **_both("by", Element(-50.0, 50.0, 0.0, "mm")),
            **_both("bz", Element(-27.0, 27.0, 0.0, "mm")),
            "bx": Element(-280.0, 280.0, 0.0, "mm"),
        }
    ),
    carriages=MappingProxyType({"X": (-280.0, 280.0), "Y": (-420.0, 350.0), "Z": (-490.0, -140.0)}),
    height_gears=MappingProxyType(
        {"Bd": Gear(3.0), "Dc": Gear(10.0 / 3.0, decimals=1), "Cd": Gear(3.75)},
    ),
    base_modes=("inside", "outside"),
    fittings=tuple(POSITIONS_OF),
)

A8 = Variant(
    name="A8",
    elements=MappingProxyType(
        {
            **_both("c", Element(98.0, 215.0, 150.0, "mm")),
            **_both("kappa", Element(0.0, 400.0, 0.0, "gon", endless=True)),
            **_both("phi", Element(90.0, 110.0, 100.0, "gon")),
            **_both("omega", Element(90.0, 110.0, 100.0, "gon")),
            "bx": Element(0.0, 280.0, 0.0, "mm"),
            "common_phi": Element(90.0, 110.0, 100.0, "gon"),
        }
    ),
    carriages=MappingProxyType({"X": (-280.0, 280.0), "Y": (-280.0, 280.0), "Z": (-350.0, -175.0)}),
    height_gears=MappingProxyType(
        {
            "1:10000": Gear(1.0),
            "1:1000": Gear(1.0),
            "1:2000": Gear(2.0),
            "1:2500": Gear(2.5),
            "1:4000": Gear(4.0),
            "1:5000": Gear(5.0),
            "1:8000": Gear(8.0),
            "1:20000": Gear(20.0, decimals=1),
            "1:25000": Gear(25.0, decimals=1),
        }
    ),
    base_modes=("inside",),
    fittings=("diapositive", "xcollar", "ycollar"),
    scales=MappingProxyType(
        {
            "X": Scale(units_per_mm=0.5, at_origin=200.0, unit="", preset=False),
            "Y": Scale(units_per_mm=0.5, at_origin=200.0, unit="", preset=False),
            "Z": GEARED,
        }
    ),
    centres_on_base=(-0.5, 0.5),
)
"""The Autograph A8: P 3.1 and 3.2, and docs/decisions/0007-a8.md, which lists the assumptions.

X and Y are read in units of 2 mm about 200.00, the middle of the base; the glass scale 1:10 000 reads mm, the others
metres of the ground, and a glass scale can be shifted in its holder, which presets Z. Common Phi rotates the main
frame, with both projectors and the base, about the Y axis.
"""

VARIANTS: Mapping[str, Variant] = MappingProxyType({"A7": A7, "A8": A8})
