"""Common commands of IEEE 488.2, status and system."""

from collections.abc import Callable

from a7sim.instrument.language.commands.common import autograph_for
from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.status import Register
from a7sim.instrument.language.syntax import quote_text
from a7sim.instrument.language.table import (
    Call,
    Command,
    Quantity,
    Quoted,
)
from a7sim.plotters import SCPI_VERSION


def _identity(engine: CommandContext, call: Call) -> str:
    autograph = autograph_for(engine)
    return f"WILD HEERBRUGG,{autograph.variant.name},{autograph.serial},{engine.instrument.version}"


def _clear(engine: CommandContext, call: Call) -> None:
    engine.clear()


def _complete(engine: CommandContext, call: Call) -> None:
    engine.complete()


def _reset(engine: CommandContext, call: Call) -> None:
    engine.cancel_completion()
    autograph_for(engine).reset()


def _mask(call: Call, largest: int) -> int:
    value = call.arguments[0]
    if not 0 <= value <= largest:
        raise CommandError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected 0 to {largest}, got {value:g}")
    return int(value)


def _enable_events(engine: CommandContext, call: Call) -> None:
    engine.status.event_enable = _mask(call, 255)


def _enable_service(engine: CommandContext, call: Call) -> None:
    engine.status.service_enable = _mask(call, 255) & ~64


def _preset_status(engine: CommandContext, call: Call) -> None:
    engine.status.operation.enable = engine.status.questionable.enable = 0


def _release(engine: CommandContext, call: Call) -> None:
    engine.instrument.release_lock(engine.client)


def _log_in(engine: CommandContext, call: Call) -> None:
    engine.log_in(call.arguments[0])


def _registers(node: str, register_of: Callable[[CommandContext], Register]) -> list[Command]:
    def enable(engine: CommandContext, call: Call) -> None:
        register_of(engine).enable = _mask(call, 65535) & 32767

    return [
        Command(
            f"STATus:{node}[:EVENt]?",
            lambda e, c: str(register_of(e).read_event()),
            polls=True,
            help="events, cleared by reading",
        ),
        Command(
            f"STATus:{node}:CONDition?",
            lambda e, c: str(register_of(e).condition),
            polls=True,
            help="condition now",
        ),
        Command(
            f"STATus:{node}:ENABle",
            enable,
            (Quantity(whole=True, name="mask"),),
            help="enabled bits of the summary in the status byte",
        ),
        Command(f"STATus:{node}:ENABle?", lambda e, c: str(register_of(e).enable)),
    ]


SYSTEM = [
    Command("*CLS", _clear, help="clear events and errors"),
    Command(
        "*ESE",
        _enable_events,
        (Quantity(whole=True, name="mask"),),
        help="enabled events of the summary in bit 5 of the status byte",
    ),
    Command("*ESE?", lambda e, c: str(e.status.event_enable)),
    Command("*ESR?", lambda e, c: str(e.status.read_event()), polls=True, help="standard events, cleared by reading"),
    Command("*IDN?", _identity, allowed_before_login=True, help="maker, type, serial number, version"),
    Command("*OPC", _complete, help="set bit 0 of the standard events when all movement is done"),
    Command("*OPC?", lambda e, c: "1", waits=True, help="1 when all movement is done"),
    Command(
        "*RST",
        _reset,
        moves=True,
        help="set elements to their zeros, base inside, fittings for a positive, no presets",
    ),
    Command("*SRE", _enable_service, (Quantity(whole=True, name="mask"),), help="enabled bits of the service request"),
    Command("*SRE?", lambda e, c: str(e.status.service_enable)),
    Command("*STB?", lambda e, c: str(e.status.status_byte()), polls=True, help="status byte"),
    Command("*TST?", lambda e, c: "0", help="result of the self-test: 0, no error"),
    Command("*WAI", lambda e, c: None, waits=True, help="wait until all movement is done"),
    Command("SYSTem:ERRor[:NEXT]?", lambda e, c: e.status.next_error(), help="oldest error, removed from the queue"),
    Command("SYSTem:ERRor:COUNt?", lambda e, c: str(len(e.status.errors)), help="errors in the queue"),
    Command("SYSTem:VERSion?", lambda e, c: SCPI_VERSION, help="version of SCPI"),
    Command("SYSTem:HELP:HEADers?", lambda e, c: ",".join(map(quote_text, e.headers)), help="all headers, in quotes"),
    Command(
        "SYSTem:LOCK:REQuest?",
        lambda e, c: "1" if e.instrument.request_lock(e.client) else "0",
        help="lock the instrument: 1 if this client holds the lock, 0 if another does",
    ),
    Command(
        "SYSTem:LOGin",
        _log_in,
        (Quoted("token"),),
        allowed_before_login=True,
        help="log in; required first if the server has a token",
    ),
    Command("SYSTem:LOCK:RELease", _release, help="release the lock"),
    *_registers("OPERation", lambda e: e.status.operation),
    *_registers("QUEStionable", lambda e: e.status.questionable),
    Command("STATus:PRESet", _preset_status, help="clear both enable registers"),
]
