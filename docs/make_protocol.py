"""Write the generated parts of protocol.md: the errors and every command, from the command table and the manual.

python docs/make_protocol.py            # writes them
python docs/make_protocol.py --check    # says whether they are fresh, exit code 1 if not
"""

import re
import sys
from functools import cache
from html import escape
from itertools import groupby
from pathlib import Path

from a7sim.instrument import build_autograph
from a7sim.instrument.errors import AutographError
from a7sim.instrument.language import Engine, ErrorNumber, SharedInstrument
from a7sim.instrument.language.commands import COMMANDS
from a7sim.instrument.language.commands.carriages import MAX_READING
from a7sim.instrument.language.commands.pictures import MAX_PICTURE
from a7sim.instrument.language.table import Choice, Command, Quantity, QuotedOrNumber, short_form
from a7sim.link.client.replies import parse_reply, part_as_text
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle
from a7sim.plotters import VARIANTS
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene

PAGE = Path(__file__).parent / "protocol.md"

SCENARIOS = {"A7": "akwanga", "A8": "akwanga-a8"}

MOUNTED = {
    "A7": 'PHOT1:LOAD "101";:PHOT2:LOAD "102";:PROJ1:PDIS 152.68;:PROJ2:PDIS 152.68;:BASE:BX 194.99;:DRIV:Z -325.71',
    "A8": 'PHOT1:LOAD "101";:PHOT2:LOAD "102"',
}
"""Set-up of an example: the first model of Akwanga is mounted and the mark is in its middle."""

GROUPS = {
    "*": "Common commands of IEEE 488.2",
    "SYSTem": "System: errors, lock, login",
    "STATus": "Status registers",
    "PROJector": "Projectors",
    "BASE": "Base and common tilt",
    "FITTing": "Fittings",
    "GEAR": "Gears",
    "COUNter": "Counters, carriages and handwheels",
    "PHOTo": "Pictures",
    "EYEPiece": "Eyepieces",
    "RECord": "Recording",
}
GROUP_OF = {"COMMon": "BASE", "DRIVe": "COUNter", "WHEel": "COUNter", "NOTE": "RECord"}

GIVEN = {
    "*ESE": "60",
    "*SRE": "32",
    "SYSTem:LOGin": '"the token"',
    "STATus:OPERation:ENABle": "2",
    "STATus:QUEStionable:ENABle": "1",
    "PROJector<n>:KAPPa": "399.48",
    "PROJector<n>:KAPPa:TURN": "-0.004",
    "PROJector<n>:PHI": "100.29",
    "PROJector<n>:PHI:TURN": "0.004",
    "PROJector<n>:OMEGa": "90 DEG",
    "PROJector<n>:OMEGa:TURN": "0.004",
    "PROJector<n>:BY": "250 UM",
    "PROJector<n>:BY:TURN": "4 UM",
    "PROJector<n>:BZ": "-1.5",
    "PROJector<n>:BZ:TURN": "-0.004",
    "PROJector<n>:PDIStance": "152.67",
    "PROJector<n>:PDIStance:TURN": "0.004",
    "BASE:BX": "195.01",
    "BASE:BX:TURN": "0.004",
    "BASE:MODE": "OUTside",
    "COMMon:PHI": "100.5",
    "COMMon:PHI:TURN": "0.004",
    "FITTing:DOVE": "INside",
    "FITTing:TRIangulation": "FRONt",
    "FITTing:DIAPositive": "RIGHt",
    "FITTing:XCOLlar": "OUT",
    "FITTing:YCOLlar": "IN",
    "GEAR:HEIGht": "8",
    "GEAR:PLAN": '"1-2-1"',
    "COUNter:X:PRESet": "5000",
    "COUNter:Y:PRESet": "5000",
    "COUNter:Z:PRESet": "459.08",
    "DRIVe:X": "97.5",
    "DRIVe:Y": "-12",
    "DRIVe:Z": "-320",
    "WHEel:X": "0.25",
    "WHEel:Y": "-0.25",
    "WHEel:Z": "1",
    "PHOTo<n>:LOAD": '"103"',
    "PHOTo<n>:CENTring": "0.329,0.218,0.05",
    "EYEPiece<n>?": '"1011"',
    "EYEPiece<n>:PICTure?": "64,48,2",
    "EYEPiece:STEReo?": '"1011"',
    "RECord": '"1011",PHI1,BX',
    "RECord?": "1",
    "RECord:STRike": '1,"wrong point"',
    "NOTE": '"coffee"',
}
"""Parameters of the examples."""

PREPARATIONS = {
    "RECord?": 'REC "1011"',
    "RECord:LAST?": 'REC "1011"',
    "RECord:STRike": 'REC "1011"',
    "SYSTem:ERRor[:NEXT]?": "FOO",
}
"""Further set-up of examples."""

SHOWN_BY = {
    "DRIVe:X": "COUN:X?",
    "DRIVe:Y": "COUN:Y?",
    "DRIVe:Z": "COUN:Z?",
    "WHEel:X": "COUN:X?",
    "WHEel:Y": "COUN:Y?",
    "WHEel:Z": "COUN:Z?",
    "COUNter:X:PRESet": "COUN:X?",
    "COUNter:Y:PRESet": "COUN:Y?",
    "COUNter:Z:PRESet": "COUN:Z?",
    "PHOTo<n>:LOAD": "PHOT1?",
    "PHOTo<n>:UNLoad": "PHOT1?",
    "RECord": "REC:LAST?",
    "RECord:STRike": "REC:LAST?",
}
"""Queries that show the effect of commands without a query of their own."""

BOUNDS = {
    "*ESE": "0 to 255",
    "*SRE": "0 to 255",
    "STATus:OPERation:ENABle": "0 to 65535",
    "STATus:QUEStionable:ENABle": "0 to 65535",
    "GEAR:HEIGht": "more than 0 to 100",
    "GEAR:PLAN": "more than 0 to 100",
    "EYEPiece<n>:PICTure?": f"1 to {MAX_PICTURE} columns and rows, magnification 0.1 to 100",
}
"""Limits of both plotters without MIN, MAX and DEF."""

ALSO = {
    "PHOTo<n>:LOAD": (-221, -224),
    "PHOTo<n>:UNLoad": (-221,),
    "PHOTo<n>:CENTring": (-221,),
    "PHOTo<n>:CENTring?": (-221,),
    "PHOTo<n>:FIDucial?": (-221,),
    "PHOTo<n>:SKETch?": (-221,),
    "GEAR:HEIGht": (-224,),
    "RECord": (-221, -222, -224),
    "RECord?": (-222,),
    "RECord:LAST?": (-200,),
    "RECord:STRike": (-221, -222),
    "NOTE": (-222,),
    "SYSTem:LOGin": (-203,),
    "EYEPiece<n>:PICTure?": (-430,),
}
"""Errors that do not follow from the parameters."""

WHEN = {
    -101: "a byte that is no printable ASCII",
    -102: "no header, no blank behind it, quotes that do not close, nothing between two commas",
    -104: "a word where a number belongs, a number where quotes belong",
    -108: "more parameters than the command takes",
    -109: "fewer parameters than the command needs",
    -113: "a header that is neither the short nor the long form of any",
    -114: "a number behind a header that is neither 1 nor 2",
    -131: "a unit of another kind: `MM` for an angle",
    -138: "a unit where none belongs",
    -200: "it cannot be done now: nothing is registered yet",
    -203: "another client holds the lock, or the server asks for `SYSTem:LOGin` first",
    -221: "the plotter, the fittings or the base do not allow it; no picture lies there",
    -222: "outside the range; nothing moves",
    -224: "a word or a name that is none of those possible",
    -350: "more than 32 errors waited; the last of them is this one",
    -363: "a line of more than 4096 bytes, dropped whole",
    -365: "nothing came for too long, and the server hangs up",
    -430: "the replies to one line would be larger than the instrument keeps",
}
"""Cause of each error."""

MAX_SHOWN = 56


@cache
def _equipment(variant):
    scenario = load_scenario(SCENARIOS[variant])
    return scenario, build_scene(scenario, 7).mountable


class Instrument:
    """New plotter with its first model mounted."""

    def __init__(self, variant):
        scenario, drawer = _equipment(variant)
        self.engine: Engine = SharedInstrument(build_autograph(scenario.instrument, drawer, 7)).open()
        self._clock = Clock()
        self.send(MOUNTED[variant])

    def send(self, line):
        reply = feed_until_idle(self.engine, line.encode() + b"\n", self._clock)
        taken = parse_reply(reply)
        return ";".join(map(part_as_text, taken.parts)) if taken else ""

    def errors(self):
        count = int(self.send("SYST:ERR:COUN?"))
        return [int(self.send("SYST:ERR?").split(",")[0]) for _ in range(count)]


def example_of(command):
    """Return the line of an example and the instrument's answer."""
    variant = "A8" if command.header.startswith("COMMon") else "A7"
    instrument = Instrument(variant)
    instrument.send(PREPARATIONS.get(command.header, ""))
    line = _description(command)
    if not command.query:
        own = next((each for each in COMMANDS.commands if each.header == f"{command.header}?"), None)
        shown = SHOWN_BY.get(command.header) or (own and _description(own))
        line = f"{line};{'' if shown is None or shown.startswith('*') else ':'}{shown}" if shown else line
    return line, instrument.send(line)


def _description(command):
    header = re.sub(r"\[[^\]]*\]", "", command.header).replace("<n>", "1")
    return f"{short_form(header)} {GIVEN.get(command.header, '')}".strip()


def ranges_of(command, variant):
    """Return the ranges of a command at a plotter, '' without limits."""
    if command.header == "BASE:MODE":
        return " or ".join(VARIANTS[variant].base_modes)
    instrument = Instrument(variant)
    instrument.send(PREPARATIONS.get(command.header, ""))
    instrument.errors()
    instrument.send(_description(command))
    if -221 in instrument.errors():
        return "not on it"
    if command.header == "GEAR:HEIGht":
        return f"{', '.join(VARIANTS[variant].height_gears)}; {BOUNDS[command.header]}"
    if command.header in BOUNDS:
        return BOUNDS[command.header]
    limited = [each for each in command.parameters if isinstance(each, Quantity) and each.limits]
    texts = [_of_both(each, Instrument(variant).engine, command) for each in limited]
    return "; ".join(dict.fromkeys(texts))


def _of_both(quantity, engine, command):
    numbers = command.suffixes if "<n>" in command.header else (1,)
    texts = {n: _limits(quantity, engine, n) for n in numbers}
    if len(set(texts.values())) == 1:
        return texts[1]
    return "; ".join(f"n = {n}: {text}" for n, text in texts.items())


def _limits(quantity, engine, number):
    try:
        low, high, default = quantity.limits(engine, number)
    except AutographError:
        return "not on it"
    unit = quantity.instrument_unit(engine) if quantity.instrument_unit else quantity.unit
    if high == MAX_READING:
        return f"±{high:.2f} {unit}".strip()
    return f"{low:.10g} to {high:.10g} {unit}".strip() + f" ({default:.10g})"


def errors_of(command):
    """Return the errors specific to a command; -101, -102, -108 and -113 apply to all."""
    errors = set(ALSO.get(command.header, ()))
    kinds = [*command.parameters, *([command.repeated_parameter] if command.repeated_parameter else [])]
    if any(not kind.optional for kind in command.parameters):
        errors.add(-109)
    if kinds:
        errors.add(-104)
    for kind in kinds:
        if isinstance(kind, Choice):
            errors.add(-224)
        if isinstance(kind, Quantity | QuotedOrNumber):
            errors |= {-222} | _unit_errors(kind)
    if "<n>" in command.header:
        errors.add(-114)
    if command.moves:
        errors.add(-203)
    if any("not on it" in ranges_of(command, variant) for variant in SCENARIOS) or command.header == "BASE:MODE":
        errors.add(-221)
    return sorted(errors, reverse=True)


def _unit_errors(kind):
    if getattr(kind, "instrument_unit", None):
        return {-131, -138}
    return {-131} if getattr(kind, "unit", "") else {-138}


def _errors_table():
    yield "| number | message | when |"
    yield "| --- | --- | --- |"
    for number in ErrorNumber:
        if number:
            yield f"| {int(number)} | {number.message} | {WHEN[int(number)]} |"


def _commands():
    grouped = sorted(COMMANDS.commands, key=lambda command: list(GROUPS).index(_group(command)))
    for group, commands in groupby(grouped, _group):
        yield f"### {GROUPS[group]}"
        yield ""
        yield "| command | | A7 | A8 | example | errors |"
        yield "| --- | --- | --- | --- | --- | --- |"
        yield from map(_row, commands)
        yield ""


def _group(command):
    first = "*" if command.header.startswith("*") else re.split(r"[:<?]", command.header)[0]
    return GROUP_OF.get(first, first)


def _row(command: Command):
    line, reply = example_of(command)
    shown = reply if len(reply) <= MAX_SHOWN else reply[:MAX_SHOWN] + " ..."
    example = f"`{line}`" + (f" gives `{shown}`" if reply else "")
    cells = (
        _code(command.syntax()),
        _about(command),
        *(ranges_of(command, variant) for variant in SCENARIOS),
        example,
        " ".join(map(str, errors_of(command))),
    )
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _code(text):
    """Return code for a cell of a table; not all Markdown readers escape a bar in backticks."""
    return f"<code>{escape(text, quote=False).replace('|', '&#124;')}</code>" if "|" in text else f"`{text}`"


def _about(command):
    if command.help:
        return command.help
    setter = next((each.help for each in COMMANDS.commands if f"{each.header}?" == command.header), "")
    return f"asks for it: {setter}" if setter else ""


def page(text):
    """Return a page with its generated parts made anew."""
    for name, lines in {"errors": _errors_table(), "commands": _commands()}.items():
        begin, end = f"<!-- {name}: written by make_protocol.py -->", f"<!-- end of {name} -->"
        before, rest = text.split(begin)
        made = "\n".join(lines).rstrip()
        text = f"{before}{begin}\n{made}\n{end}{rest.split(end)[1]}"
    return text


def main():
    text = PAGE.read_text(encoding="utf-8")
    fresh = page(text)
    if "--check" in sys.argv[1:]:
        sys.exit(0 if fresh == text else "protocol.md is not fresh: run python docs/make_protocol.py")
    PAGE.write_text(fresh, encoding="utf-8")


if __name__ == "__main__":
    main()
