"""What a person who sits down again still knows of the session: what they preset, from what was said then."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from a7sim.console.dials import Dials, question, read_dials, unquoted
from a7sim.console.reaching import Presets
from a7sim.link.replies import whole_reply
from a7sim.manual import Variant


@dataclass(frozen=True)
class Said:
    """A line as it crossed the link, to the instrument or from it."""

    text: str
    answers: bool = False


_PRESET = re.compile(r"COUN:([XYZ]):PRES ([-+.\d]+)")
_GEARED = re.compile(r"GEAR:HEIG (.+)")


def recalled(variant: Variant, past: Iterable[Said]) -> Presets:
    """Return the presets that were made before, by what this console said and what it was told of the counters."""
    presets = Presets()
    dials: Dials | None = None
    asked, asks = question(variant), False
    for said in past:
        if asks and said.answers:
            reply = whole_reply(said.text.encode() + b"\n")
            dials = read_dials(variant, reply.parts) if reply else dials
        asks = said.text == asked
        if dials is not None and not said.answers:
            _follow(presets, variant, dials, said.text)
    return presets


def _follow(presets: Presets, variant: Variant, dials: Dials, line: str) -> None:
    if preset := _PRESET.fullmatch(line):
        presets.preset(variant, dials, preset[1], float(preset[2]))
    elif geared := _GEARED.fullmatch(line):
        gear = unquoted(geared[1])
        known = variant.height_gears.get(gear)
        presets.regeared(variant, dials, known.units_per_mm if known else float(gear))
    elif line == "*RST":
        presets.origins.clear()
