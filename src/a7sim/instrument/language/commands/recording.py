"""Registrations, strikes and remarks."""

import re

from a7sim.instrument.language.commands.common import ELEMENT_NODES, autograph_for, format_fixed, text_argument
from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.syntax import quote_text
from a7sim.instrument.language.table import (
    AnyWord,
    Call,
    Command,
    Quantity,
    Quoted,
    short_form,
)
from a7sim.instrument.recorder import Registration

_RECORDED = {short_form(node): name for node, name, _, _ in ELEMENT_NODES}
_RECORDED |= {node.upper(): name for node, name, _, _ in ELEMENT_NODES}


_COMMON_TO_BOTH = {"BX": "bx", "CPHI": "common_phi"}


def recorded_element(word: str) -> str:
    """Return the element named by a word of a registration. Raises CommandError."""
    if word in _COMMON_TO_BOTH:
        return _COMMON_TO_BOTH[word]
    found = re.fullmatch(r"([A-Z]+)([12])", word)
    if found is None or found[1] not in _RECORDED:
        raise CommandError(
            ErrorNumber.ILLEGAL_PARAMETER_VALUE, f"expected BX, CPHI or an element such as BY1, got {word}"
        )
    return f"{_RECORDED[found[1]]}{found[2]}"


def _record(engine: CommandContext, call: Call) -> None:
    autograph = autograph_for(engine)
    point, *words = call.arguments
    elements = [(word, format_fixed(autograph.element(recorded_element(word)))) for word in words]
    counters = [(axis, autograph.counter_text(axis)) for axis in "XYZ"]
    autograph.recorder.register(text_argument(point), counters + elements)


def _last_record(engine: CommandContext, call: Call) -> str:
    registrations = autograph_for(engine).recorder.registrations
    if not registrations:
        raise CommandError(ErrorNumber.EXECUTION_ERROR, "nothing is registered yet")
    return _shown(registrations[-1])


def _numbered_record(engine: CommandContext, call: Call) -> str:
    return _shown(autograph_for(engine).recorder.by_number(int(call.arguments[0])))


def _shown(registration: Registration) -> str:
    counters = [reading for _, reading in registration.readings[:3]]
    elements = [f"{name},{reading}" for name, reading in registration.readings[3:]]
    struck = [quote_text(f"struck: {registration.struck}")] if registration.struck is not None else []
    return ",".join([str(registration.number), quote_text(registration.point), *counters, *elements, *struck])


def _struck_records(engine: CommandContext, call: Call) -> str:
    return str(sum(each.struck is not None for each in autograph_for(engine).recorder.registrations))


def _strike(engine: CommandContext, call: Call) -> None:
    number, why = call.arguments
    autograph_for(engine).recorder.strike(int(number), text_argument(why))


def _note(engine: CommandContext, call: Call) -> None:
    text_argument(call.arguments[0])


RECORDING = [
    Command(
        "RECord",
        _record,
        (Quoted("point"),),
        repeated_parameter=AnyWord("element"),
        help="register X, Y, Z and the named elements (BY1, KAPP2, BX, CPHI ...) under the point",
    ),
    Command(
        "RECord?",
        _numbered_record,
        (Quantity(whole=True, name="number"),),
        help="a registration: number, point, X, Y, Z and element,reading ...",
    ),
    Command("RECord:LAST?", _last_record, help="last registration: number, point, X, Y, Z and element,reading ..."),
    Command(
        "RECord:COUNt?", lambda e, c: str(len(autograph_for(e).recorder.registrations)), help="number of registrations"
    ),
    Command(
        "RECord:STRike",
        _strike,
        (Quantity(whole=True, name="number"), Quoted("why")),
        help="strike a registration out; it remains, marked as struck",
    ),
    Command("RECord:STRike:COUNt?", _struck_records, help="number of registrations struck out"),
    Command("NOTE", _note, (Quoted("text"),), help="write a remark into the journal"),
]
