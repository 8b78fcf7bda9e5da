"""Readouts: the displayed state of an instrument, queried with one line."""

import csv
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from a7sim.link.client.replies import Part
from a7sim.link.headers import FITTING_NODES, header, short_form
from a7sim.plotters import POSITIONS_OF, Variant


@dataclass(frozen=True)
class Readouts:
    """All readings of the instrument."""

    counters: Mapping[str, str]
    elements: Mapping[str, str]
    fittings: Mapping[str, str]
    base: str
    height_gear: str
    plan_gear: str
    pictures: tuple[str, str]
    """Names of the pictures in the left and the right projector, empty without one."""
    records: int
    """Number of registrations in the recorder."""
    struck: int
    """Number of struck registrations."""
    errors: int
    """Number of errors in the queue."""

    def element(self, name: str) -> float:
        """Return the reading of an element."""
        return float(self.elements[name])

    def counter(self, axis: str) -> float:
        """Return the reading of the X, Y or Z counter."""
        return float(self.counters[axis])


def readouts_query(variant: Variant) -> str:
    """Return the line that queries all readouts of a plotter."""
    return ";:".join(
        [
            "COUN?",
            *(f"{header(name)}?" for name in variant.elements),
            *(f"FITT:{FITTING_NODES[name]}?" for name in variant.fittings),
            "BASE:MODE?;:GEAR:HEIG?;:GEAR:PLAN?;:PHOT1?;:PHOT2?;:REC:COUN?;:REC:STR:COUN?;:SYST:ERR:COUN?",
        ]
    )


def parse_readouts(variant: Variant, reply: Sequence[Part]) -> Readouts:
    """Return the readouts of a reply to `readouts_query`. Raises ValueError for another reply."""
    texts = [part if isinstance(part, str) else "" for part in reply]
    counters, *rest = texts
    elements, rest = rest[: len(variant.elements)], rest[len(variant.elements) :]
    fittings, rest = rest[: len(variant.fittings)], rest[len(variant.fittings) :]
    mode, height, plan, left, right, records, struck, errors = rest
    return Readouts(
        dict(zip("XYZ", counters.split(","), strict=True)),
        dict(zip(variant.elements, elements, strict=True)),
        {name: _word(POSITIONS_OF[name], shown) for name, shown in zip(variant.fittings, fittings, strict=True)},
        _word(variant.base_modes, mode),
        unquote(height),
        unquote(plan),
        (unquote(left), unquote(right)),
        int(records),
        int(struck),
        int(errors),
    )


def _word(words: Sequence[str], shown: str) -> str:
    return next((word for word in words if short_form(word) == shown), shown.lower())


def unquote(text: str) -> str:
    """Return the first text of a reply without its quotes."""
    return values(text)[0]


def values(reply: str) -> list[str]:
    """Return the values of a reply, texts without their quotes."""
    return next(csv.reader([reply]), None) or [""]
