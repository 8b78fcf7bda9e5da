"""Every command of the language: protocol.md as frozen data, each with the few lines that carry it out."""

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from a7sim.instrument.language.errors import ErrorNumber, LanguageError
from a7sim.instrument.language.status import Register
from a7sim.instrument.language.syntax import quoted
from a7sim.instrument.language.table import (
    AnyWord,
    Call,
    Choice,
    Command,
    CommandTable,
    Limits,
    Quantity,
    Quoted,
    QuotedOrNumber,
    short_form,
)
from a7sim.instrument.recorder import Registration
from a7sim.manual import NOT_VISIBLE, SCPI_VERSION

if TYPE_CHECKING:
    from a7sim.instrument.autograph import Autograph
    from a7sim.instrument.language.engine import Engine


LARGEST_PICTURE = 1024
"""Columns or rows of an eyepiece picture."""

LARGEST_READING = 999999.99
"""Of a counter's drums."""

LONGEST_TEXT = 1000
"""Characters of a remark or of a point's name."""

_ELEMENT_NODES = (
    ("KAPPa", "kappa", "gon", "swing"),
    ("PHI", "phi", "gon", "longitudinal tilt"),
    ("OMEGa", "omega", "gon", "lateral tilt"),
    ("BY", "by", "mm", "base component across"),
    ("BZ", "bz", "mm", "base component in height"),
    ("PDIStance", "c", "mm", "principal distance"),
)

_FITTING_NODES = (
    ("DOVE", "dove", ("INside", "OUTside"), "indices of the Dove prisms"),
    ("TRIangulation", "triangulation", ("BACK", "FRONt"), "triangulation lever"),
    ("DIAPositive", "diapositive", ("RIGHt", "LEFT"), "diapositive lever"),
    ("XCOLlar", "xcollar", ("IN", "OUT"), "collar of the X handwheel"),
    ("YCOLlar", "ycollar", ("IN", "OUT"), "collar of the Y handwheel"),
)

_LIMIT = Choice(("MINimum", "MAXimum", "DEFault"), optional=True)


def _autograph(engine: "Engine") -> "Autograph":
    return engine.desk.autograph


def _fixed(value: float, decimals: int = 2) -> str:
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


# --- common and system ---------------------------------------------------------------------------------


def _identity(engine: "Engine", call: Call) -> str:
    autograph = _autograph(engine)
    return f"WILD HEERBRUGG,{autograph.variant.name},{autograph.serial},{engine.desk.version}"


def _clear(engine: "Engine", call: Call) -> None:
    engine.clear()


def _complete(engine: "Engine", call: Call) -> None:
    engine.complete()


def _reset(engine: "Engine", call: Call) -> None:
    engine.forget_completion()
    _autograph(engine).reset()


def _mask(call: Call, largest: int) -> int:
    value = call.arguments[0]
    if not 0 <= value <= largest:
        raise LanguageError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected 0 to {largest}, got {value:g}")
    return int(value)


def _enable_events(engine: "Engine", call: Call) -> None:
    engine.status.event_enable = _mask(call, 255)


def _enable_service(engine: "Engine", call: Call) -> None:
    engine.status.service_enable = _mask(call, 255) & ~64


def _preset_status(engine: "Engine", call: Call) -> None:
    engine.status.operation.enable = engine.status.questionable.enable = 0


def _headers(engine: "Engine", call: Call) -> str:
    return ",".join(quoted(header) for header in COMMANDS.headers())


def _release(engine: "Engine", call: Call) -> None:
    engine.desk.release_lock(engine.client)


def _log_in(engine: "Engine", call: Call) -> None:
    engine.log_in(call.arguments[0])


def _registers(node: str, which: Callable[["Engine"], Register]) -> list[Command]:
    def enable(engine: "Engine", call: Call) -> None:
        which(engine).enable = _mask(call, 65535) & 32767

    return [
        Command(
            f"STATus:{node}[:EVENt]?",
            lambda e, c: str(which(e).read_event()),
            polls=True,
            about="events, cleared by reading",
        ),
        Command(
            f"STATus:{node}:CONDition?",
            lambda e, c: str(which(e).condition),
            polls=True,
            about="condition now",
        ),
        Command(f"STATus:{node}:ENABle", enable, (Quantity(whole=True, name="mask"),), about="what is reported"),
        Command(f"STATus:{node}:ENABle?", lambda e, c: str(which(e).enable)),
    ]


_SYSTEM = [
    Command("*CLS", _clear, about="clear events and errors"),
    Command("*ESE", _enable_events, (Quantity(whole=True, name="mask"),), about="events that bit 5 sums up"),
    Command("*ESE?", lambda e, c: str(e.status.event_enable)),
    Command("*ESR?", lambda e, c: str(e.status.read_event()), polls=True, about="standard events, cleared by reading"),
    Command("*IDN?", _identity, open_to_all=True, about="maker, type, serial number, version"),
    Command("*OPC", _complete, about="raise bit 0 of the events when all movement is done"),
    Command("*OPC?", lambda e, c: "1", waits=True, about="1 when all movement is done"),
    Command(
        "*RST",
        _reset,
        turns=True,
        about="elements to their zeros, base inside, fittings for a positive, no presets",
    ),
    Command("*SRE", _enable_service, (Quantity(whole=True, name="mask"),), about="bits that ask for service"),
    Command("*SRE?", lambda e, c: str(e.status.service_enable)),
    Command("*STB?", lambda e, c: str(e.status.status_byte()), polls=True, about="status byte"),
    Command("*TST?", lambda e, c: "0", about="0: the instrument finds itself in order"),
    Command("*WAI", lambda e, c: None, waits=True, about="wait until all movement is done"),
    Command("SYSTem:ERRor[:NEXT]?", lambda e, c: e.status.next_error(), about="oldest error, taken off the queue"),
    Command("SYSTem:ERRor:COUNt?", lambda e, c: str(len(e.status.errors)), about="errors in the queue"),
    Command("SYSTem:VERSion?", lambda e, c: SCPI_VERSION, about="version of SCPI"),
    Command("SYSTem:HELP:HEADers?", _headers, about="all headers, in quotes"),
    Command(
        "SYSTem:LOCK:REQuest?",
        lambda e, c: "1" if e.desk.request_lock(e.client) else "0",
        about="1: this client alone may turn now; 0: another may",
    ),
    Command(
        "SYSTem:LOGin",
        _log_in,
        (Quoted("token"),),
        open_to_all=True,
        about="first of all, where the instrument is served to other machines",
    ),
    Command("SYSTem:LOCK:RELease", _release, about="give the lock back"),
    *_registers("OPERation", lambda e: e.status.operation),
    *_registers("QUEStionable", lambda e: e.status.questionable),
    Command("STATus:PRESet", _preset_status, about="report nothing of the two registers"),
]

# --- elements, base, fittings, gears -------------------------------------------------------------------


def _element(header: str, name_of: Callable[[int], str], unit: str, about: str) -> list[Command]:
    def limits(engine: "Engine", suffix: int) -> Limits:
        element = _autograph(engine).element_data(name_of(suffix))
        return element.low, element.high, element.zero

    def move(engine: "Engine", call: Call) -> None:
        _autograph(engine).set_element(name_of(call.suffix), call.arguments[0])

    def turn(engine: "Engine", call: Call) -> None:
        _autograph(engine).turn_element(name_of(call.suffix), call.arguments[0])

    def to_the_ends(engine: "Engine", suffix: int) -> Limits:
        low, high, _ = limits(engine, suffix)
        here = _autograph(engine).element(name_of(suffix))
        return low - here, high - here, 0.0

    def show(engine: "Engine", call: Call) -> str:
        shown = _autograph(engine).element(name_of(call.suffix))
        if call.arguments:
            shown = dict(zip(_LIMIT.words, limits(engine, call.suffix), strict=True))[_long(call.arguments[0])]
        return _fixed(shown)

    return [
        Command(header, move, (Quantity(unit, limits),), turns=True, about=about),
        Command(f"{header}?", show, (_LIMIT,)),
        Command(
            f"{header}:TURN",
            turn,
            (Quantity(unit, to_the_ends, name="amount"),),
            turns=True,
            about="turn its drum by so much, signed, between two counts too",
        ),
    ]


def _long(word: str) -> str:
    return next(each for each in _LIMIT.words if each.lower() == word)


def _numbered(name: str) -> Callable[[int], str]:
    return lambda suffix: f"{name}{suffix}"


def _base_mode(engine: "Engine", call: Call) -> None:
    _autograph(engine).set_base_mode(call.arguments[0])


def _fitting(node: str, name: str, words: tuple[str, ...], about: str) -> list[Command]:
    shown = {word.lower(): short_form(word) for word in words}

    def put(engine: "Engine", call: Call) -> None:
        _autograph(engine).set_fitting(name, call.arguments[0])

    return [
        Command(f"FITTing:{node}", put, (Choice(words),), turns=True, about=about),
        Command(f"FITTing:{node}?", lambda e, c: shown[_autograph(e).fitting(name)]),
    ]


def _height_gear(engine: "Engine", call: Call) -> None:
    _autograph(engine).set_height_gear(call.arguments[0])


def _plan_gear(engine: "Engine", call: Call) -> None:
    gear = call.arguments[0]
    if isinstance(gear, float) and not 0.0 < gear <= 100.0:
        raise LanguageError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected more than 0 to 100, got {gear:g}")
    _autograph(engine).plan_gear = _text_within(gear) if isinstance(gear, str) else f"{gear:.10g}"


def _gear_text(gear: str) -> str:
    return gear if re.fullmatch(r"\d+(\.\d+)?(e[+-]?\d+)?", gear) else quoted(gear)


_HANDLES = [
    *(
        command
        for node, name, unit, about in _ELEMENT_NODES
        for command in _element(f"PROJector<n>:{node}", _numbered(name), unit, about)
    ),
    *_element("BASE:BX", lambda suffix: "bx", "mm", "base component along the base"),
    Command("BASE:MODE", _base_mode, (Choice(("INside", "OUTside")),), turns=True, about="Zeiss parallelogram"),
    Command("BASE:MODE?", lambda e, c: {"inside": "IN", "outside": "OUT"}[_autograph(e).base_mode]),
    *_element("COMMon:PHI", lambda suffix: "common_phi", "gon", "common longitudinal tilt (A8)"),
    *(command for fitting in _FITTING_NODES for command in _fitting(*fitting)),
    Command(
        "GEAR:HEIGht",
        _height_gear,
        (QuotedOrNumber("combination"),),
        turns=True,
        about="height gear, or units a mm",
    ),
    Command("GEAR:HEIGht?", lambda e, c: _gear_text(_autograph(e).height_gear)),
    Command(
        "GEAR:PLAN",
        _plan_gear,
        (QuotedOrNumber("combination"),),
        turns=True,
        about="gear to the plotting table",
    ),
    Command("GEAR:PLAN?", lambda e, c: _gear_text(_autograph(e).plan_gear)),
]

# --- counters and carriages ----------------------------------------------------------------------------


def _counters(engine: "Engine", call: Call) -> str:
    return ",".join(_autograph(engine).counter_text(axis) for axis in "XYZ")


def _axis(axis: str) -> list[Command]:
    usual = "" if axis == "Z" else "mm"

    def unit(engine: "Engine") -> str:
        return _autograph(engine).variant.scales[axis].unit

    def limits(engine: "Engine", suffix: int) -> Limits:
        autograph = _autograph(engine)
        low, high = autograph.counter_limits(axis)
        return low, high, autograph.counter_at_rest(axis)

    def to_the_ends(engine: "Engine", suffix: int) -> Limits:
        autograph = _autograph(engine)
        low, high = autograph.counter_limits(axis)
        here = autograph.counter(axis)
        return low - here, high - here, 0.0

    def preset_limits(engine: "Engine", suffix: int) -> Limits:
        return -LARGEST_READING, LARGEST_READING, 0.0

    def preset(engine: "Engine", call: Call) -> None:
        if abs(call.arguments[0]) > LARGEST_READING:
            raise LanguageError(
                ErrorNumber.DATA_OUT_OF_RANGE, f"expected at most {LARGEST_READING}, got {call.arguments[0]:.10g}"
            )
        _autograph(engine).preset(axis, call.arguments[0])

    def drive(engine: "Engine", call: Call) -> None:
        _autograph(engine).drive(axis, call.arguments[0])

    def wheel(engine: "Engine", call: Call) -> None:
        _autograph(engine).wheel(axis, call.arguments[0])

    return [
        Command(f"COUNter:{axis}?", lambda e, c: _autograph(e).counter_text(axis), about=f"{axis} counter"),
        Command(
            f"COUNter:{axis}:PRESet",
            preset,
            (Quantity(usual, preset_limits, name="reading", unit_there=unit),),
            turns=True,
            about="what the counter shall show here",
        ),
        Command(
            f"DRIVe:{axis}",
            drive,
            (Quantity(usual, limits, name="reading", unit_there=unit),),
            turns=True,
            about="run to a counter reading",
        ),
        Command(
            f"WHEel:{axis}",
            wheel,
            (Quantity(usual, to_the_ends, name="amount", unit_there=unit),),
            turns=True,
            about="turn by so much counter, signed",
        ),
    ]


_CARRIAGES = [
    Command("COUNter?", _counters, about="X, Y and Z"),
    *(command for axis in "XYZ" for command in _axis(axis)),
]

# --- pictures and eyepieces ----------------------------------------------------------------------------


def _load(engine: "Engine", call: Call) -> None:
    _autograph(engine).load(call.suffix, call.arguments[0])


def _unload(engine: "Engine", call: Call) -> None:
    _autograph(engine).unload(call.suffix)


def _catalogue(engine: "Engine", call: Call) -> str:
    return ",".join(quoted(name) for name in _autograph(engine).catalogue) or '""'


def _centre(engine: "Engine", call: Call) -> None:
    _autograph(engine).centre_picture(call.suffix, *call.arguments)


def _centring_limits(name: str) -> Callable[["Engine", int], Limits]:
    def limits(engine: "Engine", suffix: int) -> Limits:
        limit = getattr(_autograph(engine).variant, name)
        return -limit, limit, 0.0

    return limits


def _centring(engine: "Engine", call: Call) -> str:
    return ",".join(_fixed(value, 3) for value in _autograph(engine).carrier(call.suffix).centring)


def _fiducials(engine: "Engine", call: Call) -> str:
    displacements = _autograph(engine).carrier(call.suffix).fiducial_displacements()
    return ",".join(f"{quoted(name)},{_fixed(dx, 3)},{_fixed(dy, 3)}" for name, dx, dy in displacements)


def _sketch(engine: "Engine", call: Call) -> str:
    sketch = _autograph(engine).carrier(call.suffix).photograph.sketch
    places = zip(sketch.names, sketch.xy[0], sketch.xy[1], strict=True)
    return ",".join(f"{quoted(name)},{_fixed(float(x), 1)},{_fixed(float(y), 1)}" for name, x, y in places) or '""'


def _pair(seen: tuple[float, float] | None) -> str:
    return f"{_fixed(seen[0])},{_fixed(seen[1])}" if seen else f"{NOT_VISIBLE},{NOT_VISIBLE}"


def _eyepiece(engine: "Engine", call: Call) -> str:
    return _pair(_autograph(engine).eyepiece(call.suffix, call.arguments[0]))


def _stereo(engine: "Engine", call: Call) -> str:
    return _pair(_autograph(engine).stereo(call.arguments[0]))


def _picture(engine: "Engine", call: Call) -> bytes:
    columns, rows, magnification = call.arguments
    for name, value, largest in (("columns", columns, LARGEST_PICTURE), ("rows", rows, LARGEST_PICTURE)):
        if not 1 <= value <= largest:
            raise LanguageError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected 1 to {largest} {name}, got {value:g}")
    if not 0.1 <= magnification <= 100.0:
        raise LanguageError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected 0.1 to 100 times, got {magnification:g}")
    grey = _autograph(engine).picture(call.suffix, int(columns), int(rows), magnification)
    pixels = np.round(255.0 * grey).astype(np.uint8).tobytes()
    length = str(len(pixels))
    return f"#{len(length)}{length}".encode("ascii") + pixels


_PICTURES = [
    Command("PHOTo<n>:LOAD", _load, (Quoted("picture"),), turns=True, about="lay a picture on the carrier"),
    Command("PHOTo<n>:UNLoad", _unload, turns=True, about="take it off"),
    Command("PHOTo<n>?", lambda e, c: quoted(_autograph(e).loaded(c.suffix) or ""), about="its name"),
    Command("PHOTo:CATalog?", _catalogue, about="the pictures at hand"),
    Command(
        "PHOTo<n>:CENTring",
        _centre,
        (
            Quantity("mm", _centring_limits("centring_mm"), name="dx"),
            Quantity("mm", _centring_limits("centring_mm"), name="dy"),
            Quantity("gon", _centring_limits("centring_gon"), name="dkappa"),
        ),
        turns=True,
        about="shift and turn the picture from where it was laid",
    ),
    Command("PHOTo<n>:CENTring?", _centring),
    Command(
        "PHOTo<n>:FIDucial?",
        _fiducials,
        about="name,dx,dy,... of the fiducials from their collimating marks, mm",
    ),
    Command("PHOTo<n>:SKETch?", _sketch, about="name,x,y,... of the points pricked on the paper print, mm"),
    Command(
        "EYEPiece<n>?",
        _eyepiece,
        (Quoted("point"),),
        about="dx,dy of the image from the floating mark, um at photo scale; n is the observer's eye",
    ),
    Command(
        "EYEPiece<n>:PICTure?",
        _picture,
        (
            Quantity(whole=True, name="columns"),
            Quantity(whole=True, name="rows"),
            Quantity(name="magnification"),
        ),
        about="block of grey bytes, row by row from the top",
    ),
    Command(
        "EYEPiece:STEReo?",
        _stereo,
        (Quoted("point"),),
        about="px,py, left image minus right, um at photo scale",
    ),
]

# --- recording -----------------------------------------------------------------------------------------

_RECORDED = {short_form(node): name for node, name, _, _ in _ELEMENT_NODES}
_RECORDED |= {node.upper(): name for node, name, _, _ in _ELEMENT_NODES}


_COMMON_TO_BOTH = {"BX": "bx", "CPHI": "common_phi"}


def recorded_element(word: str) -> str:
    """Return the element that a word in a registration names. Raises LanguageError."""
    if word in _COMMON_TO_BOTH:
        return _COMMON_TO_BOTH[word]
    found = re.fullmatch(r"([A-Z]+)([12])", word)
    if found is None or found[1] not in _RECORDED:
        raise LanguageError(
            ErrorNumber.ILLEGAL_PARAMETER_VALUE, f"expected BX, CPHI or an element such as BY1, got {word}"
        )
    return f"{_RECORDED[found[1]]}{found[2]}"


def _text_within(text: str) -> str:
    if not 1 <= len(text) <= LONGEST_TEXT:
        raise LanguageError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected 1 to {LONGEST_TEXT} characters, got {len(text)}")
    return text


def _record(engine: "Engine", call: Call) -> None:
    autograph = _autograph(engine)
    point, *words = call.arguments
    elements = [(word, _fixed(autograph.element(recorded_element(word)))) for word in words]
    counters = [(axis, autograph.counter_text(axis)) for axis in "XYZ"]
    autograph.recorder.register(_text_within(point), counters + elements)


def _last_record(engine: "Engine", call: Call) -> str:
    registrations = _autograph(engine).recorder.registrations
    if not registrations:
        raise LanguageError(ErrorNumber.EXECUTION_ERROR, "nothing is registered yet")
    return _shown(registrations[-1])


def _numbered_record(engine: "Engine", call: Call) -> str:
    return _shown(_autograph(engine).recorder.numbered(int(call.arguments[0])))


def _shown(registration: Registration) -> str:
    counters = [reading for _, reading in registration.readings[:3]]
    elements = [f"{name},{reading}" for name, reading in registration.readings[3:]]
    struck = [quoted(f"struck: {registration.struck}")] if registration.struck is not None else []
    return ",".join([str(registration.number), quoted(registration.point), *counters, *elements, *struck])


def _struck_records(engine: "Engine", call: Call) -> str:
    return str(sum(each.struck is not None for each in _autograph(engine).recorder.registrations))


def _strike(engine: "Engine", call: Call) -> None:
    number, why = call.arguments
    _autograph(engine).recorder.strike(int(number), _text_within(why))


def _note(engine: "Engine", call: Call) -> None:
    _text_within(call.arguments[0])


_RECORDING = [
    Command(
        "RECord",
        _record,
        (Quoted("point"),),
        repeats=AnyWord("element"),
        about="register X, Y, Z and the named elements (BY1, KAPP2, BX, CPHI ...) under the point",
    ),
    Command(
        "RECord?",
        _numbered_record,
        (Quantity(whole=True, name="number"),),
        about="a registration as it stands: number, point, X, Y, Z and element,reading ...",
    ),
    Command("RECord:LAST?", _last_record, about="number, point, X, Y, Z and element,reading ..."),
    Command("RECord:COUNt?", lambda e, c: str(len(_autograph(e).recorder.registrations)), about="registrations"),
    Command(
        "RECord:STRike",
        _strike,
        (Quantity(whole=True, name="number"), Quoted("why")),
        about="strike a registration out; it stays, marked",
    ),
    Command("RECord:STRike:COUNt?", _struck_records, about="registrations that are struck out"),
    Command("NOTE", _note, (Quoted("text"),), about="a remark into the journal"),
]

COMMANDS = CommandTable([*_SYSTEM, *_HANDLES, *_CARRIAGES, *_PICTURES, *_RECORDING])
"""The whole language."""
