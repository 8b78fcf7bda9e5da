"""Elements, base, fittings and gears."""

import re
from collections.abc import Callable

from a7sim.instrument.language.commands.common import ELEMENT_NODES, LIMIT, autograph_for, format_fixed, text_argument
from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.syntax import quote_text
from a7sim.instrument.language.table import (
    Call,
    Choice,
    Command,
    Limits,
    Quantity,
    QuotedOrNumber,
    short_form,
)

_FITTING_NODES = (
    ("DOVE", "dove", ("INside", "OUTside"), "indices of the Dove prisms"),
    ("TRIangulation", "triangulation", ("BACK", "FRONt"), "triangulation lever"),
    ("DIAPositive", "diapositive", ("RIGHt", "LEFT"), "diapositive lever"),
    ("XCOLlar", "xcollar", ("IN", "OUT"), "collar of the X handwheel"),
    ("YCOLlar", "ycollar", ("IN", "OUT"), "collar of the Y handwheel"),
)


def _element(header: str, name_of: Callable[[int], str], unit: str, about: str) -> list[Command]:
    def limits(engine: CommandContext, suffix: int) -> Limits:
        element = autograph_for(engine).element_data(name_of(suffix))
        return element.low, element.high, element.zero

    def move(engine: CommandContext, call: Call) -> None:
        autograph_for(engine).set_element(name_of(call.suffix), call.arguments[0])

    def turn(engine: CommandContext, call: Call) -> None:
        autograph_for(engine).turn_element(name_of(call.suffix), call.arguments[0])

    def amount_limits(engine: CommandContext, suffix: int) -> Limits:
        low, high, _ = limits(engine, suffix)
        reading = autograph_for(engine).element(name_of(suffix))
        return low - reading, high - reading, 0.0

    def show(engine: CommandContext, call: Call) -> str:
        shown = autograph_for(engine).element(name_of(call.suffix))
        if call.arguments:
            shown = dict(zip(LIMIT.words, limits(engine, call.suffix), strict=True))[_long(call.arguments[0])]
        return format_fixed(shown)

    return [
        Command(header, move, (Quantity(unit, limits),), moves=True, help=about),
        Command(f"{header}?", show, (LIMIT,)),
        Command(
            f"{header}:TURN",
            turn,
            (Quantity(unit, amount_limits, name="amount"),),
            moves=True,
            help="turn the drum by a signed amount, also less than a count",
        ),
    ]


def _long(word: str) -> str:
    return next(each for each in LIMIT.words if each.lower() == word)


def _numbered(name: str) -> Callable[[int], str]:
    return lambda suffix: f"{name}{suffix}"


def _base_mode(engine: CommandContext, call: Call) -> None:
    autograph_for(engine).set_base_mode(call.arguments[0])


def _fitting(node: str, name: str, words: tuple[str, ...], about: str) -> list[Command]:
    shown = {word.lower(): short_form(word) for word in words}

    def put(engine: CommandContext, call: Call) -> None:
        autograph_for(engine).set_fitting(name, call.arguments[0])

    return [
        Command(f"FITTing:{node}", put, (Choice(words),), moves=True, help=about),
        Command(f"FITTing:{node}?", lambda e, c: shown[autograph_for(e).fitting(name)]),
    ]


def _height_gear(engine: CommandContext, call: Call) -> None:
    autograph_for(engine).set_height_gear(call.arguments[0])


def _plan_gear(engine: CommandContext, call: Call) -> None:
    gear = call.arguments[0]
    if isinstance(gear, float) and not 0.0 < gear <= 100.0:
        raise CommandError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected more than 0 to 100, got {gear:g}")
    autograph_for(engine).plan_gear = text_argument(gear) if isinstance(gear, str) else f"{gear:.10g}"


def _gear_text(gear: str) -> str:
    return gear if re.fullmatch(r"\d+(\.\d+)?(e[+-]?\d+)?", gear) else quote_text(gear)


ELEMENT_COMMANDS = [
    *(
        command
        for node, name, unit, about in ELEMENT_NODES
        for command in _element(f"PROJector<n>:{node}", _numbered(name), unit, about)
    ),
    *_element("BASE:BX", lambda suffix: "bx", "mm", "base component along the base"),
    Command("BASE:MODE", _base_mode, (Choice(("INside", "OUTside")),), moves=True, help="Zeiss parallelogram"),
    Command("BASE:MODE?", lambda e, c: {"inside": "IN", "outside": "OUT"}[autograph_for(e).base_mode]),
    *_element("COMMon:PHI", lambda suffix: "common_phi", "gon", "common longitudinal tilt (A8)"),
    *(command for fitting in _FITTING_NODES for command in _fitting(*fitting)),
    Command(
        "GEAR:HEIGht",
        _height_gear,
        (QuotedOrNumber("combination"),),
        moves=True,
        help="height gear, or its units per mm",
    ),
    Command("GEAR:HEIGht?", lambda e, c: _gear_text(autograph_for(e).height_gear)),
    Command(
        "GEAR:PLAN",
        _plan_gear,
        (QuotedOrNumber("combination"),),
        moves=True,
        help="gear to the plotting table",
    ),
    Command("GEAR:PLAN?", lambda e, c: _gear_text(autograph_for(e).plan_gear)),
]
