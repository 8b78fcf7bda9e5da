"""Recovery of counter presets from the lines of an earlier session."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from a7sim.console.actions.navigation import CounterOrigins
from a7sim.console.state.readouts import Readouts, parse_readouts, readouts_query, unquote
from a7sim.link.client.replies import parse_reply
from a7sim.plotters import Variant


@dataclass(frozen=True)
class LoggedLine:
    """Line on the link, to the instrument or from it."""

    text: str
    answers: bool = False


_PRESET = re.compile(r":?COUN(?:TER)?:([XYZ]):PRES(?:ET)? ([-+.\d]+)", re.IGNORECASE)
_GEARED = re.compile(r":?GEAR:HEIG(?:HT)? (.+)", re.IGNORECASE)


def recover_presets(variant: Variant, past: Iterable[LoggedLine], gear: str = "") -> CounterOrigins:
    """Return the presets of an earlier session, from its lines and its counter readings.

    `gear` is the engaged height gear. If no line engaged it, the Z counter is assumed at its zero then.
    """
    presets = CounterOrigins()
    dials: Readouts | None = None
    asked, asks = readouts_query(variant), False
    for exchange in past:
        if asks and exchange.answers:
            reply = parse_reply(exchange.text.encode() + b"\n")
            dials = parse_readouts(variant, reply.parts) if reply else dials
        asks = exchange.text == asked
        if dials is not None and not exchange.answers:
            update_presets(presets, variant, dials, exchange.text)
    if gear:
        presets.units.setdefault("Z", gear_units(variant, gear))
    return presets


def gear_units(variant: Variant, gear: str) -> float:
    """Return the units per mm of a height gear."""
    known = variant.height_gears.get(gear)
    return known.units_per_mm if known else float(gear)


def update_presets(presets: CounterOrigins, variant: Variant, dials: Readouts, line: str) -> None:
    """Record the effect of a line that presets a counter or engages a gear; the readouts are those before it."""
    for unit in line.split(";"):
        if preset := _PRESET.fullmatch(unit):
            presets.preset(variant, dials, preset[1].upper(), float(preset[2]))
        elif geared := _GEARED.fullmatch(unit):
            presets.regeared(variant, dials, gear_units(variant, unquote(geared[1])))
        elif unit.upper() == "*RST":
            presets.origins.clear()
