"""Counters and carriages."""

from a7sim.instrument.language.commands.common import autograph_for
from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.table import (
    Call,
    Command,
    Limits,
    Quantity,
)

MAX_READING = 999999.99
"""Maximum reading of a counter."""


def _counters(engine: CommandContext, call: Call) -> str:
    return ",".join(autograph_for(engine).counter_text(axis) for axis in "XYZ")


def _axis(axis: str) -> list[Command]:
    default_unit = "" if axis == "Z" else "mm"

    def unit(engine: CommandContext) -> str:
        return autograph_for(engine).variant.scales[axis].unit

    def limits(engine: CommandContext, suffix: int) -> Limits:
        autograph = autograph_for(engine)
        low, high = autograph.counter_limits(axis)
        return low, high, autograph.counter_at_rest(axis)

    def amount_limits(engine: CommandContext, suffix: int) -> Limits:
        autograph = autograph_for(engine)
        low, high = autograph.counter_limits(axis)
        reading = autograph.counter(axis)
        return low - reading, high - reading, 0.0

    def preset_limits(engine: CommandContext, suffix: int) -> Limits:
        return -MAX_READING, MAX_READING, 0.0

    def preset(engine: CommandContext, call: Call) -> None:
        if abs(call.arguments[0]) > MAX_READING:
            raise CommandError(
                ErrorNumber.DATA_OUT_OF_RANGE, f"expected at most {MAX_READING}, got {call.arguments[0]:.10g}"
            )
        autograph_for(engine).preset(axis, call.arguments[0])

    def drive(engine: CommandContext, call: Call) -> None:
        autograph_for(engine).drive(axis, call.arguments[0])

    def wheel(engine: CommandContext, call: Call) -> None:
        autograph_for(engine).turn_handwheel(axis, call.arguments[0])

    return [
        Command(f"COUNter:{axis}?", lambda e, c: autograph_for(e).counter_text(axis), help=f"{axis} counter"),
        Command(
            f"COUNter:{axis}:PRESet",
            preset,
            (Quantity(default_unit, preset_limits, name="reading", instrument_unit=unit),),
            moves=True,
            help="set the counter to a reading; nothing moves",
        ),
        Command(
            f"DRIVe:{axis}",
            drive,
            (Quantity(default_unit, limits, name="reading", instrument_unit=unit),),
            moves=True,
            help="drive to a counter reading",
        ),
        Command(
            f"WHEel:{axis}",
            wheel,
            (Quantity(default_unit, amount_limits, name="amount", instrument_unit=unit),),
            moves=True,
            help="turn the wheel by a signed counter amount",
        ),
    ]


CARRIAGES = [
    Command("COUNter?", _counters, help="X, Y and Z counters"),
    *(command for axis in "XYZ" for command in _axis(axis)),
]
