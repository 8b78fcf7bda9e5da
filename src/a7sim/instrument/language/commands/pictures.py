"""Photographs in their carriers, and the views of the eyepieces."""

from collections.abc import Callable

import numpy as np

from a7sim.instrument.language.commands.common import autograph_for, format_fixed
from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.syntax import quote_text
from a7sim.instrument.language.table import (
    Call,
    Command,
    Limits,
    Quantity,
    Quoted,
)
from a7sim.plotters import NOT_VISIBLE

MAX_PICTURE = 1024
"""Columns or rows of an eyepiece picture."""


def _load(engine: CommandContext, call: Call) -> None:
    autograph_for(engine).load(call.suffix, call.arguments[0])


def _unload(engine: CommandContext, call: Call) -> None:
    autograph_for(engine).unload(call.suffix)


def _catalogue(engine: CommandContext, call: Call) -> str:
    return ",".join(quote_text(name) for name in autograph_for(engine).catalogue) or '""'


def _centre(engine: CommandContext, call: Call) -> None:
    autograph_for(engine).centre_picture(call.suffix, *call.arguments)


def _centring_limits(name: str) -> Callable[[CommandContext, int], Limits]:
    def limits(engine: CommandContext, suffix: int) -> Limits:
        limit = getattr(autograph_for(engine).variant, name)
        return -limit, limit, 0.0

    return limits


def _centring(engine: CommandContext, call: Call) -> str:
    return ",".join(format_fixed(value, 3) for value in autograph_for(engine).carrier(call.suffix).centring)


def _fiducials(engine: CommandContext, call: Call) -> str:
    displacements = autograph_for(engine).carrier(call.suffix).fiducial_displacements()
    return ",".join(f"{quote_text(name)},{format_fixed(dx, 3)},{format_fixed(dy, 3)}" for name, dx, dy in displacements)


def _sketch(engine: CommandContext, call: Call) -> str:
    sketch = autograph_for(engine).carrier(call.suffix).photograph.sketch
    places = zip(sketch.names, sketch.xy[0], sketch.xy[1], strict=True)
    return (
        ",".join(f"{quote_text(name)},{format_fixed(float(x), 1)},{format_fixed(float(y), 1)}" for name, x, y in places)
        or '""'
    )


def _pair(seen: tuple[float, float] | None) -> str:
    return f"{format_fixed(seen[0])},{format_fixed(seen[1])}" if seen else f"{NOT_VISIBLE},{NOT_VISIBLE}"


def _eyepiece(engine: CommandContext, call: Call) -> str:
    return _pair(autograph_for(engine).eyepiece(call.suffix, call.arguments[0]))


def _stereo(engine: CommandContext, call: Call) -> str:
    return _pair(autograph_for(engine).stereo(call.arguments[0]))


def _picture(engine: CommandContext, call: Call) -> bytes:
    columns, rows, magnification = call.arguments
    for name, value, largest in (("columns", columns, MAX_PICTURE), ("rows", rows, MAX_PICTURE)):
        if not 1 <= value <= largest:
            raise CommandError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected 1 to {largest} {name}, got {value:g}")
    if not 0.1 <= magnification <= 100.0:
        raise CommandError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected 0.1 to 100 times, got {magnification:g}")
    grey = autograph_for(engine).picture(call.suffix, int(columns), int(rows), magnification)
    pixels = np.round(255.0 * grey).astype(np.uint8).tobytes()
    length = str(len(pixels))
    return f"#{len(length)}{length}".encode("ascii") + pixels


PICTURES = [
    Command("PHOTo<n>:LOAD", _load, (Quoted("picture"),), moves=True, help="lay a picture on the carrier"),
    Command("PHOTo<n>:UNLoad", _unload, moves=True, help="remove the picture from the carrier"),
    Command(
        "PHOTo<n>?",
        lambda e, c: quote_text(autograph_for(e).loaded(c.suffix) or ""),
        help="name of the picture, empty without one",
    ),
    Command("PHOTo:CATalog?", _catalogue, help="names of all available pictures"),
    Command(
        "PHOTo<n>:CENTring",
        _centre,
        (
            Quantity("mm", _centring_limits("centring_mm"), name="dx"),
            Quantity("mm", _centring_limits("centring_mm"), name="dy"),
            Quantity("gon", _centring_limits("centring_gon"), name="dkappa"),
        ),
        moves=True,
        help="shift and turn the picture from its initial position",
    ),
    Command("PHOTo<n>:CENTring?", _centring),
    Command(
        "PHOTo<n>:FIDucial?",
        _fiducials,
        help="name,dx,dy,... of the fiducials from their collimating marks, mm",
    ),
    Command("PHOTo<n>:SKETch?", _sketch, help="name,x,y,... of the points pricked on the paper print, mm"),
    Command(
        "EYEPiece<n>?",
        _eyepiece,
        (Quoted("point"),),
        help="dx,dy of the image from the floating mark, um at photo scale; n is the observer's eye",
    ),
    Command(
        "EYEPiece<n>:PICTure?",
        _picture,
        (
            Quantity(whole=True, name="columns"),
            Quantity(whole=True, name="rows"),
            Quantity(name="magnification"),
        ),
        help="block of grey bytes, row by row from the top",
    ),
    Command(
        "EYEPiece:STEReo?",
        _stereo,
        (Quoted("point"),),
        help="px,py, left image minus right, um at photo scale",
    ),
]
