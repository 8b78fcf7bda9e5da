"""What a person who sits down again still knows of the session: what they preset, from what was said then."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from a7sim.console.actions.navigation import CounterOrigins
from a7sim.console.state.readouts import Readouts, parse_readouts, readouts_query, unquote
from a7sim.link.client.replies import parse_reply
from a7sim.plotters import Variant


@dataclass(frozen=True)
class LoggedLine:
    """A line as it crossed the link, to the instrument or from it."""

    text: str
    answers: bool = False


_PRESET = re.compile(r":?COUN(?:TER)?:([XYZ]):PRES(?:ET)? ([-+.\d]+)", re.IGNORECASE)
_GEARED = re.compile(r":?GEAR:HEIG(?:HT)? (.+)", re.IGNORECASE)


def recover_presets(variant: Variant, past: Iterable[LoggedLine], gear: str = "") -> CounterOrigins:
    """Return the presets that were made before, by what this console said and what it was told of the counters.

    `gear` is the height gear that is engaged now. Where nobody is known to have engaged it, the counter of Z is taken
    to have stood at its zero then.
    """
    presets = CounterOrigins()
    dials: Readouts | None = None
    asked, asks = readouts_query(variant), False
    for said in past:
        if asks and said.answers:
            reply = parse_reply(said.text.encode() + b"\n")
            dials = parse_readouts(variant, reply.parts) if reply else dials
        asks = said.text == asked
        if dials is not None and not said.answers:
            update_presets(presets, variant, dials, said.text)
    if gear:
        presets.units.setdefault("Z", gear_units(variant, gear))
    return presets


def gear_units(variant: Variant, gear: str) -> float:
    """Return the units a mm that a height gear gives."""
    known = variant.height_gears.get(gear)
    return known.units_per_mm if known else float(gear)


def update_presets(presets: CounterOrigins, variant: Variant, dials: Readouts, line: str) -> None:
    """Take note of what a line presets or engages, where that is what it does; the dials are those before it."""
    for unit in line.split(";"):
        if preset := _PRESET.fullmatch(unit):
            presets.preset(variant, dials, preset[1].upper(), float(preset[2]))
        elif geared := _GEARED.fullmatch(unit):
            presets.regeared(variant, dials, gear_units(variant, unquote(geared[1])))
        elif unit.upper() == "*RST":
            presets.origins.clear()
