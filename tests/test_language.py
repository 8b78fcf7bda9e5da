"""The command language by protocol.md; where it states nothing, by IEEE 488.2 and SCPI-1999."""

import re
import zlib

import pytest

import a7sim
from a7sim.instrument import Autograph
from a7sim.instrument.language import LinkEvent, SharedInstrument
from a7sim.plotters import VARIANTS
from a7sim.scenario.schema import Condition, ProjectorCondition
from tests.support.engine_client import EngineClient, with_model, with_photographs

EXAMPLES = {
    "*CLS": "",
    "*ESE": "60",
    "*ESE?": "",
    "*ESR?": "",
    "*IDN?": "",
    "*OPC": "",
    "*OPC?": "",
    "*RST": "",
    "*SRE": "32",
    "*SRE?": "",
    "*STB?": "",
    "*TST?": "",
    "*WAI": "",
    "SYSTem:ERRor[:NEXT]?": "",
    "SYSTem:ERRor:COUNt?": "",
    "SYSTem:VERSion?": "",
    "SYSTem:HELP:HEADers?": "",
    "SYSTem:LOGin": '"token"',
    "SYSTem:LOCK:REQuest?": "",
    "SYSTem:LOCK:RELease": "",
    "STATus:OPERation[:EVENt]?": "",
    "STATus:OPERation:CONDition?": "",
    "STATus:OPERation:ENABle": "1",
    "STATus:OPERation:ENABle?": "",
    "STATus:QUEStionable[:EVENt]?": "",
    "STATus:QUEStionable:CONDition?": "",
    "STATus:QUEStionable:ENABle": "1",
    "STATus:QUEStionable:ENABle?": "",
    "STATus:PRESet": "",
    "PROJector<n>:KAPPa": "1",
    "PROJector<n>:KAPPa?": "",
    "PROJector<n>:KAPPa:TURN": "0.004",
    "PROJector<n>:PHI": "101",
    "PROJector<n>:PHI?": "",
    "PROJector<n>:PHI:TURN": "-0.004",
    "PROJector<n>:OMEGa": "101",
    "PROJector<n>:OMEGa?": "",
    "PROJector<n>:OMEGa:TURN": "0.004",
    "PROJector<n>:BY": "1",
    "PROJector<n>:BY?": "",
    "PROJector<n>:BY:TURN": "0.004",
    "PROJector<n>:BZ": "1",
    "PROJector<n>:BZ?": "",
    "PROJector<n>:BZ:TURN": "0.004",
    "PROJector<n>:PDIStance": "151",
    "PROJector<n>:PDIStance?": "",
    "PROJector<n>:PDIStance:TURN": "0.004",
    "BASE:BX": "190",
    "BASE:BX?": "",
    "BASE:BX:TURN": "0.004",
    "BASE:MODE": "OUTside",
    "BASE:MODE?": "",
    "COMMon:PHI": "101",
    "COMMon:PHI?": "",
    "COMMon:PHI:TURN": "0.004",
    "FITTing:DOVE": "INside",
    "FITTing:DOVE?": "",
    "FITTing:TRIangulation": "FRONt",
    "FITTing:TRIangulation?": "",
    "FITTing:DIAPositive": "RIGHt",
    "FITTing:DIAPositive?": "",
    "FITTing:XCOLlar": "OUT",
    "FITTing:XCOLlar?": "",
    "FITTing:YCOLlar": "IN",
    "FITTing:YCOLlar?": "",
    "GEAR:HEIGht": "8",
    "GEAR:HEIGht?": "",
    "GEAR:PLAN": '"1-2-1"',
    "GEAR:PLAN?": "",
    "COUNter?": "",
    "COUNter:X?": "",
    "COUNter:Y?": "",
    "COUNter:Z?": "",
    "COUNter:X:PRESet": "5000",
    "COUNter:Y:PRESet": "5000",
    "COUNter:Z:PRESet": "5000",
    "DRIVe:X": "1",
    "DRIVe:Y": "1",
    "DRIVe:Z": "-330",
    "WHEel:X": "1",
    "WHEel:Y": "1",
    "WHEel:Z": "1",
    "PHOTo<n>:LOAD": '"103"',
    "PHOTo<n>:UNLoad": "",
    "PHOTo<n>?": "",
    "PHOTo:CATalog?": "",
    "PHOTo<n>:CENTring": "0.1,-0.2,0.3",
    "PHOTo<n>:CENTring?": "",
    "PHOTo<n>:FIDucial?": "",
    "PHOTo<n>:SKETch?": "",
    "EYEPiece<n>?": '"1011"',
    "EYEPiece<n>:PICTure?": "4,3,1",
    "EYEPiece:STEReo?": '"1011"',
    "RECord": '"1011",BY1,BX',
    "RECord?": "1",
    "RECord:LAST?": "",
    "RECord:COUNt?": "",
    "RECord:STRike": '1,"wrong point"',
    "RECord:STRike:COUNt?": "",
    "NOTE": '"coffee"',
}
"""Headers of protocol.md and later ones, with parameters that a mounted model accepts."""

NOT_ON_AN_A7 = {"COMMon:PHI", "COMMon:PHI?", "COMMon:PHI:TURN"}

ELEMENTS = {
    **{
        f"PROJ{n}:{node}": f"{name}{n}"
        for node, name in {
            "KAPP": "kappa",
            "PHI": "phi",
            "OMEG": "omega",
            "BY": "by",
            "BZ": "bz",
            "PDIS": "c",
        }.items()
        for n in (1, 2)
    },
    "BASE:BX": "bx",
}
"""Header to the element's name in the manual."""

POSITIONS = ";:".join(
    [
        *(f"{header}?" for header in ELEMENTS),
        "BASE:MODE?;:FITT:DOVE?;TRI?;DIAP?;XCOL?;YCOL?;:GEAR:HEIG?;PLAN?;:COUN?;:PHOT1?;:PHOT2?;:REC:COUN?",
    ]
)
"""A line that queries all that can move."""


def in_full(header: str) -> str:
    return header.replace("<n>", "2").replace("[", "").replace("]", "")


def in_short(header: str) -> str:
    return re.sub("[a-z]", "", re.sub(r"\[.*\]", "", header.replace("<n>", "2")))


# --- lines, headers, levels ----------------------------------------------------------------------------


def test_help_lists_every_header_of_the_protocol_and_no_other():
    listed = EngineClient().query("SYST:HELP:HEAD?").split(",")
    assert sorted(listed) == sorted(f'"{header}"' for header in EXAMPLES)


@pytest.mark.parametrize("form", [in_short, in_full])
@pytest.mark.parametrize("header", EXAMPLES)
def test_every_header_replies_or_acts_in_both_forms(header, form):
    client = with_model()
    client.query('REC "1021"')
    reply = client.feed(f"{form(header)} {EXAMPLES[header]}\n".encode())
    if header in NOT_ON_AN_A7:
        assert (reply, client.errors()) == (b"", [-221])
    else:
        assert reply.endswith(b"\n") == header.endswith("?")
        assert client.errors() == []


@pytest.mark.parametrize(
    "line",
    [
        "PROJ1:OMEG?",
        "projector1:omega?",
        "Projector1:OMEG?",
        "pRoJ1:oMeGa?",
        ":PROJ1:OMEG?",
        "PROJ:OMEG?",
        "\tPROJ1:OMEG? ",
    ],
)
def test_forms_mix_in_any_case_and_no_suffix_means_1(line):
    client = EngineClient()
    client.query("PROJ1:OMEG 98.5")
    assert client.query(line) == "98.50"


@pytest.mark.parametrize(
    "line",
    [
        "PROJE1:KAPP?",
        "PROJ1:KAP?",
        "PROJ1:KAPPAA?",
        "PRO1:KAPPA?",
        "SYSTE:ERR?",
        "SYST:ERRO?",
        "SYST:ERR:NEX?",
        "FOO",
        "FOO 1",
        "FOO a-b",
        "*FOO",
        "*IDN",
        "*CLS?",
        "COUN:X",
        "PROJ1",
        "PROJ1?",
        "BASE1:BX?",
        "SYST:ERR2?",
        "PHOT1:CAT?",
        "EYEP1:STER? \"1011\"",
        "NOTE?",
        "PR0J1:KAPP?",
        "*IDN ?",
    ],
)  # fmt: skip
def test_anything_else_is_an_undefined_header(line):
    client = EngineClient()
    assert client.query(line) == ""
    assert client.errors() == [-113]


def test_semicolon_stays_at_the_level_and_a_colon_goes_to_the_root():
    client = EngineClient()
    client.query("PROJ2:KAPP 5;PHI 99;OMEG 98;:BASE:BX 20;MODE OUT")
    assert client.query("PROJ2:KAPP?;PHI?;OMEG?;:BASE:BX?;MODE?") == "5.00;99.00;98.00;20.00;OUT"
    assert client.query("COUN:X:PRES 7;:COUN:X?;Y?") == "7.00;0.00"
    assert client.query("SYST:ERR:COUN?;NEXT?") == '0;0,"No error"'
    assert client.errors() == []


def test_without_the_colon_the_root_is_not_seen():
    client = EngineClient()
    assert client.query("PROJ1:KAPP?;PROJ2:KAPP?") == "0.00"
    assert client.errors() == [-113]


def test_common_commands_leave_the_level_alone():
    client = EngineClient()
    assert client.query("PROJ1:KAPP 5;*ESE 1;PHI 99;*ESE?;PHI?") == "1;99.00"


@pytest.mark.parametrize("between", ["FOO", "KAPP FOO", "KAPP 1,2", "KAPP 999", "KAPP 5 MM", "KAPP 1..2", "FOO \xe9"])
def test_a_bad_unit_leaves_the_level_alone(between):
    client = EngineClient()
    assert client.query(f"PROJ2:PHI 99;{between};PHI?") == "99.00"
    assert len(client.errors()) == 1


def test_every_line_begins_at_the_root():
    client = EngineClient()
    client.query("PROJ1:KAPP?")
    assert client.query("PHI?") == ""
    assert client.errors() == [-113]


@pytest.mark.parametrize("line", ["", " ", "\t", ";", ";;", " ; ; ", "\r"])
def test_empty_units_between_semicolons_are_ignored(line):
    client = EngineClient()
    assert client.query(line) == ""
    assert client.errors() == []


def test_empty_units_do_not_disturb_their_neighbours():
    assert EngineClient().query(";;PROJ1:KAPP?; ;PHI?;;*OPC?;") == "0.00;100.00;1"


def test_there_is_no_banner_and_no_echo():
    client = EngineClient()
    assert client.feed(b"") == b""
    assert client.feed(b"*OPC?\n") == b"1\n"


def test_a_command_never_answers():
    assert EngineClient().query("*CLS;*ESE 1;:PROJ1:KAPP 5;:NOTE 'x';*OPC;*WAI") == ""


def test_a_bad_query_between_good_queries_gives_no_reply_and_queues_an_error():
    client = EngineClient()
    assert client.query("PROJ1:KAPP?;:FOO?;:PROJ1:PHI?;OMEG? 7;BY?") == "0.00;100.00;0.00"
    assert client.errors() == [-113, -104]


@pytest.mark.parametrize("end", [b"\n", b"\r\n", b"\r"])
def test_lines_end_in_lf_crlf_or_cr(end):
    client = EngineClient()
    assert client.feed(b"*OPC?" + end) + client.feed(b"*TST?" + end) == b"1\n0\n"
    assert client.errors() == []


def test_without_a_serial_line_a_cr_alone_does_not_end_a_line():
    client = EngineClient(cr_ends_line=False)
    assert client.feed(b"*OPC?\r\n") == b"1\n"
    assert client.feed(b"*OPC?\r*TST?") == b""
    assert client.feed(b"\n") == b""
    assert client.errors() == [-101]


def test_a_line_may_come_in_pieces():
    client = EngineClient()
    assert [client.feed(piece) for piece in (b"*O", b"PC?", b";*TST", b"?\n*OP", b"C?\n")] == [
        b"", b"", b"", b"1;0\n", b"1\n",
    ]  # fmt: skip


@pytest.mark.parametrize("end", [b"\n", b"\r\n"])
@pytest.mark.parametrize("cr_ends_line", [True, False])
def test_a_line_of_4096_bytes_is_obeyed_and_one_more_is_dropped_whole(end, cr_ends_line):
    client = EngineClient(cr_ends_line=cr_ends_line)
    longest = b"*OPC?".ljust(4096)
    assert client.feed(longest + end) == b"1\n"
    assert client.errors() == []
    assert client.feed(longest + b" " + end) == b""
    assert client.errors() == [-363]


def test_a_cr_that_ends_no_line_counts_as_a_byte_of_its_line():
    client = EngineClient(cr_ends_line=False)
    assert client.feed(b"*OPC?".ljust(4096) + b"\r;*OPC?\n") == b""
    assert client.errors() == [-363]


@pytest.mark.parametrize("piece", [1, 1000, 4096, 100_000])
def test_a_line_too_long_does_nothing_in_whatever_pieces_and_the_next_line_works(piece):
    client = EngineClient()
    flood = b"BASE:BX 5;" * 2000 + b"*OPC?\n"
    for start in range(0, len(flood), piece):
        assert client.feed(flood[start : start + piece]) == b""
    assert client.query("BASE:BX?") == "0.00"
    assert client.errors() == [-363]


# --- parameters ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("written", "name"),
    [
        ('"a;b,c"', '"a;b,c"'),
        ("'a;b,c'", '"a;b,c"'),
        ('"say ""P;1"", twice"', '"say ""P;1"", twice"'),
        ("'it''s; so'", '"it\'s; so"'),
        ("'\"'", '""""'),
        ('"Case  kept"', '"Case  kept"'),
    ],
)
def test_quotes_protect_and_double_themselves(written, name):
    client = EngineClient()
    assert client.query(f"REC {written},BX;:REC:LAST?") == f"1,{name},0.00,0.00,-300.00,BX,0.00"
    assert client.errors() == []


@pytest.mark.parametrize(
    "number",
    ["12", "+12", "12.", "12.000", "1.2E1", "1.2e+1", ".12E2", "1200e-2", "12MM", "12 mm", "12000 UM", "1.2E4um"],
)
def test_numbers_come_in_any_form_with_or_without_a_unit(number):
    client = EngineClient()
    assert client.query(f"PROJ1:BY {number};BY?") == "12.00"
    assert client.errors() == []


@pytest.mark.parametrize(
    ("line", "reply"),
    [
        ("PROJ1:KAPP 50 DEG;KAPP?", "55.56"),
        ("PROJ1:PHI 90DEG;PHI?", "100.00"),
        ("PROJ1:PHI 99.5 GON;PHI?", "99.50"),
        ("PROJ1:BY -.5;BY?", "-0.50"),
        ("PROJ1:BY 0.004;BY?", "0.00"),
        ("PROJ1:BY -0.004;BY?", "0.00"),
        ("PROJ1:BY 0.006;BY?", "0.01"),
        ("PROJ1:BY 1 mm;BY 250 um;BY?", "0.25"),
        ("PROJ1:KAPP 400;KAPP?", "0.00"),
        ("PROJ1:KAPP 399.996;KAPP?", "0.00"),
        ("PROJ1:KAPP 399.99;KAPP?", "399.99"),
        ("DRIV:X 12500 UM;:COUN:X?", "12.50"),
    ],
)
def test_replies_come_as_the_counter_shows_them_without_a_unit(line, reply):
    assert EngineClient().query(line) == reply


@pytest.mark.parametrize(("header", "name"), ELEMENTS.items())
def test_min_max_and_def_name_an_elements_range_and_zero(header, name):
    element = VARIANTS["A7"].elements[name]
    client = EngineClient()
    for words, value in (("MIN", element.low), ("MAXIMUM", element.high), ("default", element.zero)):
        assert client.numbers(f"{header}? {words}") == [value]
        shown = 0.0 if element.endless else value
        assert client.numbers(f"{header} {words};:{header}?") == [shown]
    assert client.errors() == []


@pytest.mark.parametrize(
    ("axis", "low", "high", "rest"), [("X", -280, 280, 0), ("Y", -420, 350, 0), ("Z", -490, -140, -300)]
)
def test_min_max_and_def_name_a_carriages_ends_and_rest(axis, low, high, rest):
    client = EngineClient()
    for word, value in (("MIN", low), ("MAX", high), ("DEF", rest)):
        assert client.numbers(f"DRIV:{axis} {word};:COUN:{axis}?") == [value]
    assert client.errors() == []


REFUSED = {
    -101: ["*IDN?\x01", "*ID\xe9?", "NOTE 'caf\xe9'", "\xa0*IDN?", "*IDN?\x7f", "\x00", "PROJ1:KAPP 5\x0b"],
    -102: [
        "5",
        "!",
        "?",
        "*",
        "::SYST:ERR?",
        ":*IDN?",
        "SYST:?",
        "SYST::ERR?",
        "*IDN??",
        "*RST1",
        "*IDN?5",
        "PROJ1:KAPP=5",
        "NOTE'x'",
        'NOTE "open',
        "NOTE 'it's'",
        'NOTE "a" "b"',
        "PROJ1:KAPP 5,",
        "PROJ1:KAPP ,5",
        "REC 'P',,BY1",
    ],
    -104: [
        "PROJ1:KAPP FOO",
        "PROJ1:KAPP '5'",
        "PROJ1:KAPP 1..2",
        "PROJ1:KAPP 1 2",
        "PROJ1:KAPP #H10",
        "PROJ1:KAPP (1)",
        "PROJ1:KAPP " + "1" * 300,
        "*ESE DEF",
        "BASE:MODE 5",
        "BASE:MODE 'OUT'",
        "NOTE coffee",
        "NOTE 5",
        "PHOT1:LOAD 101",
        "EYEP1? P1",
        "GEAR:HEIG Bd",
        "REC 'P',5",
        "REC 'P','BY1'",
        "REC BY1",
        "REC:STR 'P','why'",
        "PROJ1:KAPP? 5",
    ],
    -108: [
        "*CLS 1",
        "*IDN? 1",
        "COUN? 5",
        "COUN:X? MIN",
        "PROJ1:KAPP 1,2",
        "PROJ1:KAPP? MIN,MAX",
        "NOTE 'a','b'",
        "*RST X",
    ],
    -109: [
        "PROJ1:KAPP",
        "*ESE",
        "NOTE",
        "BASE:MODE",
        "PHOT1:CENT 1,2",
        "EYEP1:PICT? 4,4",
        "REC",
        "REC:STR 1",
        "EYEP1?",
    ],
    -113: ["KAPP 5", "PROJ1:KAPA 5"],
    -114: ["PROJ0:KAPP 5", "PROJ3:KAPP?", "PHOT7?", "EYEP12? 'P'", "PROJ999999999:KAPP?"],
    -131: [
        "PROJ1:KAPP 5 MM",
        "PROJ1:BY 5 GON",
        "BASE:BX 5 KM",
        "DRIV:X 5 DEG",
        "PROJ1:KAPP 5E",
        "PHOT1:CENT 0 GON,0,0",
    ],
    -138: ["*ESE 1 MM", "WHE:Z 5 MM", "DRIV:Z 5 UM", "GEAR:HEIG 3 MM", "REC:STR 1 MM,'why'", "EYEP1:PICT? 4 MM,4,1"],
    -200: ["REC:LAST?"],
    -221: [
        "COMM:PHI 100",
        "COMM:PHI?",
        "COMM:PHI? MIN",
        "COMM:PHI MAX",
        "PHOT1:UNL",
        "PHOT1:CENT 0,0,0",
        "PHOT2:CENT?",
        "PHOT1:FID?",
        "PHOT2:SKET?",
    ],
    -222: [
        "PROJ1:KAPP -0.01",
        "PROJ1:KAPP 400.01",
        "PROJ1:PHI 69.99",
        "PROJ1:PHI 106.01",
        "PROJ2:PHI 93.99",
        "PROJ2:PHI 130.01",
        "PROJ1:OMEG 109.01",
        "PROJ2:BY -50.01",
        "PROJ1:BZ 27.01",
        "PROJ1:PDIS 97.99",
        "PROJ1:PDIS 1E400",
        "BASE:BX 280.01",
        "DRIV:X 280.01",
        "DRIV:Y -420.01",
        "DRIV:Z -139.99",
        "WHE:X 281",
        "WHE:Z -1E9",
        "COUN:X:PRES 1E12",
        "GEAR:HEIG 0",
        "GEAR:HEIG 100.1",
        "GEAR:PLAN -1",
        "GEAR:PLAN ''",
        "*ESE 256",
        "*SRE -1",
        "STAT:OPER:ENAB 65536",
        "PHOT1:CENT 15.01,0,0",
        "PHOT1:CENT 0,0,-20.01",
        "EYEP1:PICT? 0,4,1",
        "EYEP1:PICT? 4,1025,1",
        "EYEP1:PICT? 4,4,0",
        "REC ''",
        "REC:STR 1,'why'",
        "REC? 1",
        "NOTE ''",
        f"NOTE '{'x' * 1001}'",
    ],
    -224: [
        "BASE:MODE FOO",
        "BASE:MODE INSI",
        "FITT:TRI LEFT",
        "FITT:XCOL INside",
        "GEAR:HEIG 'Xx'",
        "PHOT1:LOAD '999'",
        "REC 'P',BY3",
        "REC 'P',FOO1",
        "REC 'P',BY",
        "PROJ1:KAPP? FOO",
    ],
}


@pytest.mark.parametrize(("number", "line"), [(number, line) for number, lines in REFUSED.items() for line in lines])
def test_a_refused_line_gives_no_reply_moves_nothing_and_queues_its_number(number, line):
    client = EngineClient()
    before = client.query(POSITIONS)
    assert client.query(line) == ""
    assert client.errors() == [number]
    assert client.query(POSITIONS) == before


def test_an_error_has_its_number_its_message_and_the_expected_value():
    client = EngineClient()
    client.query('PROJ1:PHI 200;:PROJ1:KAPP "5"')
    assert re.fullmatch(r'-222,"Data out of range;[^"]*expected 70\.00 to 106\.00, got 200"', client.query("SYST:ERR?"))
    assert re.fullmatch(r'-104,"Data type error;[^"]*expected a number[^"]*"', client.query("SYST:ERR:NEXT?"))
    assert client.query("SYST:ERR?") == '0,"No error"'


# --- several clients -----------------------------------------------------------------------------------


def two_clients():
    first = EngineClient()
    return first, EngineClient(first.instrument)


def test_clients_share_the_instrument():
    first, second = two_clients()
    first.query("BASE:BX 20")
    assert second.query("BASE:BX?") == "20.00"


def test_only_the_holder_of_the_lock_moves_parts_and_other_clients_may_query():
    first, second = two_clients()
    assert (first.query("SYST:LOCK:REQ?"), second.query("SYST:LOCK:REQ?")) == ("1", "0")
    assert first.query("SYST:LOCK:REQ?") == "1"
    first.query("PROJ1:KAPP 5")
    assert second.query("PROJ1:KAPP 6;KAPP?;:NOTE 'may I?'") == "5.00"
    assert (first.errors(), second.errors()) == ([], [-203])


@pytest.mark.parametrize(
    "header",
    [
        header
        for header in EXAMPLES
        if re.match(r"\*RST|PROJ|BASE|FITT|GEAR|COUN|DRIV|WHE|PHOT", header) and not header.endswith("?")
    ],
)
def test_the_lock_protects_all_that_moves(header):
    holder = with_model()
    other = EngineClient(holder.instrument)
    holder.query("SYST:LOCK:REQ?")
    before = other.query(POSITIONS)
    other.query(f"{in_short(header)} {EXAMPLES[header]}")
    assert other.errors() == [-203]
    assert other.query(POSITIONS) == before


def test_a_lock_is_released_by_its_holder_only():
    first, second = two_clients()
    first.query("SYST:LOCK:REQ?")
    second.query("SYST:LOCK:REL")
    assert second.query("SYST:LOCK:REQ?") == "0"
    first.query("SYST:LOCK:REL")
    assert second.query("SYST:LOCK:REQ?") == "1"
    assert first.errors() + second.errors() == []


def test_a_client_that_leaves_frees_its_lock_and_no_others():
    first, second = two_clients()
    first.query("SYST:LOCK:REQ?")
    second.instrument.close(second.engine.client)
    third = EngineClient(first.instrument)
    assert third.query("SYST:LOCK:REQ?") == "0"
    first.instrument.close(first.engine.client)
    assert third.query("SYST:LOCK:REQ?;:BASE:BX 20;BX?") == "1;20.00"


def test_each_client_has_its_own_queue_and_registers():
    first, second = two_clients()
    first.query("FOO;*ESE 7")
    assert second.query("SYST:ERR:COUN?;*ESE?") == "0;0"
    assert first.errors() == [-113]


def test_the_queue_holds_32_and_overflows_into_its_last_entry():
    client = EngineClient()
    client.query(";".join(["FOO"] * 32))
    assert client.query("SYST:ERR:COUN?") == "32"
    client.query("BAR;BAZ")
    assert client.errors() == [-113] * 31 + [-350]
    client.query("FOO")
    assert client.errors() == [-113]


# --- common commands and the status model --------------------------------------------------------------


def test_the_instrument_identifies_itself():
    assert EngineClient().query("*IDN?") == f"WILD HEERBRUGG,A7,0,{a7sim.__version__}"
    assert with_photographs().query("*IDN?") == f"WILD HEERBRUGG,A7,3268,{a7sim.__version__}"
    assert EngineClient().query("SYST:VERS?;*OPC?;*TST?;*WAI") == "1999.0;1;0"


def test_the_power_on_bit_is_set_once():
    assert EngineClient().query("*ESR?;*ESR?") == "128;0"


@pytest.mark.parametrize(
    ("line", "bit"),
    [("FOO", 32), ("PROJ1:KAPP MM", 32), ("PROJ1:PHI 0", 16), ("COMM:PHI?", 16), ("REC:LAST?", 16), ("*OPC", 1),
     (" " * 4097, 8), (";".join(["FOO"] * 33), 32 + 8)],
)  # fmt: skip
def test_events_raise_their_bits(line, bit):
    client = EngineClient()
    client.query("*CLS")
    client.query(line)
    assert client.query("*ESR?;*ESR?") == f"{bit};0"


def test_the_status_byte_summarises_the_enabled_registers():
    client = EngineClient()
    assert client.query("*CLS;*STB?;FOO;*STB?") == "0;4"
    assert client.query("*ESE 32;*STB?") == str(4 + 32)
    assert client.query("*SRE 32;*STB?;*STB?") == f"{4 + 32 + 64};{4 + 32 + 64}"
    assert client.query("*ESR?;*STB?") == "32;4"


def test_enable_masks_read_back_and_bit_6_cannot_ask_for_service():
    assert EngineClient().query("*ESE 255;*ESE?;*SRE 255;*SRE?;*ESE 1.6;*ESE?") == "255;191;2"


@pytest.mark.parametrize(("node", "register", "summary"), [("OPER", "operation", 128), ("QUES", "questionable", 8)])
def test_a_register_keeps_its_bits_until_it_is_read(node, register, summary):
    client = EngineClient()
    status = getattr(client.engine.status, register)
    status.set_condition(16)
    status.set_condition(1)
    assert client.query(f"STAT:{node}:COND?;ENAB?;*STB?") == "1;0;0"
    assert client.query(f"STAT:{node}:ENAB 16;ENAB?;*STB?") == f"16;{summary}"
    assert client.query(f"STAT:{node}:EVEN?;EVEN?;COND?;*STB?") == "17;0;1;0"
    status.set_condition(1 + 4)
    assert client.query(f"STAT:{node}?") == "4"


def test_the_top_bit_of_a_register_is_not_used():
    assert EngineClient().query("STAT:OPER:ENAB 65535;ENAB?") == "32767"


def test_preset_reports_nothing_of_the_two_registers_and_leaves_the_rest():
    client = EngineClient()
    assert (
        client.query("*ESE 5;:STAT:OPER:ENAB 3;:STAT:QUES:ENAB 3;:STAT:PRES;OPER:ENAB?;:STAT:QUES:ENAB?;*ESE?")
        == "0;0;5"
    )


def test_cls_clears_events_and_errors_and_leaves_the_enables():
    client = EngineClient()
    client.engine.status.operation.set_condition(1)
    client.engine.status.questionable.set_condition(1)
    client.query("*ESE 60;*SRE 32;:STAT:OPER:ENAB 1;:FOO")
    assert client.query("*CLS;*ESR?;:STAT:OPER?;:STAT:QUES?;:SYST:ERR:COUN?;*STB?") == "0;0;0;0;0"
    assert client.query("*ESE?;*SRE?;:STAT:OPER:ENAB?;COND?") == "60;32;1;1"


def test_rst_runs_all_to_zero_and_presets_and_fittings_to_rest():
    client = EngineClient()
    at_rest = client.query(POSITIONS)
    client.query(
        "PROJ1:KAPP 390;PHI 90;OMEG 90;BY 9;BZ 8;:PROJ2:KAPP 5;PHI 110;OMEG 90;BY 9;BZ 8;:BASE:BX -20;MODE OUT"
    )
    client.query("FITT:DOVE IN;TRI FRON;DIAP RIGH;XCOL OUT;YCOL IN;:COUN:X:PRES 5;:COUN:Y:PRES 6;:COUN:Z:PRES 7")
    client.query("*RST")
    assert client.query(POSITIONS) == at_rest
    assert client.errors() == []


def test_rst_puts_on_the_fittings_for_a_positive_with_base_in():
    client = EngineClient()
    client.query("*RST")
    assert client.query("FITT:DOVE?;TRI?;DIAP?;XCOL?;YCOL?;:BASE:MODE?") == "OUT;BACK;LEFT;IN;OUT;IN"


def test_rst_leaves_photographs_principal_distance_carriages_queue_and_registers():
    client = with_model()
    client.query("PROJ1:PDIS 153;:PHOT1:CENT 0.1,0.2,0.3;:DRIV:X 10;:REC '1011';*ESE 60;*SRE 4;FOO")
    client.query("*RST")
    assert client.query("PHOT1?;:PHOT2?;:PHOT1:CENT?") == '"101";"102";0.100,0.200,0.300'
    assert client.query("PROJ1:PDIS?;:PROJ2:PDIS?;:COUN:X?;Z?") == "153.00;152.68;10.00;-325.71"
    assert client.query("*ESE?;*SRE?;:REC:COUN?") == "60;4;1"
    assert client.errors() == [-113]


# --- fittings, gears, counters, carriages --------------------------------------------------------------


@pytest.mark.parametrize(
    ("node", "words"),
    [
        ("DOVE", ("INside", "OUTside")),
        ("TRI", ("BACK", "FRONt")),
        ("DIAP", ("RIGHt", "LEFT")),
        ("XCOL", ("IN", "OUT")),
        ("YCOL", ("IN", "OUT")),
    ],
)
def test_fittings_take_both_forms_and_answer_the_short_one(node, words):
    client = EngineClient()
    for word in words:
        for written in (word.upper(), in_short(word), word.lower()):
            assert client.query(f"FITT:{node} {written};{node}?") == in_short(word)
    assert client.errors() == []


def test_counters_show_where_the_carriages_stand():
    client = EngineClient()
    assert client.query("COUN?") == "0.00,0.00,-300.00"
    client.query("DRIV:X 10.5;Y -20.25;Z -310")
    assert client.query("COUN?;:COUN:X?;Y?;Z?") == "10.50,-20.25,-310.00;10.50;-20.25;-310.00"


def test_a_preset_is_what_the_counter_shows_here_and_moves_nothing():
    client = EngineClient()
    client.query("DRIV:X 10;:COUN:X:PRES 5000;:COUN:Z:PRES 459.08;:DRIV:X 5001.5")
    assert client.query("COUN?") == "5001.50,0.00,459.08"
    assert client.query("*RST;:COUN?") == "11.50,0.00,-300.00"


def test_limits_hold_behind_a_preset():
    client = EngineClient()
    client.query("COUN:X:PRES 5000;:DRIV:X 5280")
    assert client.query("COUN:X?;:DRIV:X 5280.01;:COUN:X?") == "5280.00;5280.00"
    assert client.errors() == [-222]


@pytest.mark.parametrize(
    ("gear", "shown", "turned", "carriage"),
    [
        ('"Bd"', "-300.00", "-270.00", "-290.00"),
        ('"Dc"', "-300.0", "-270.0", "-291.00"),
        ("'Cd'", "-300.00", "-270.00", "-292.00"),
        ("8", "-300.00", "-270.00", "-296.25"),
        ("0.5", "-300.00", "-270.00", "-240.00"),
    ],
)
def test_a_height_gear_continues_from_the_counter_reading_with_its_own_decimals(gear, shown, turned, carriage):
    client = EngineClient()
    assert client.query(f"GEAR:HEIG {gear};:COUN:Z?;:WHE:Z 30;:COUN:Z?") == f"{shown};{turned}"
    assert client.query("GEAR:HEIG?") == gear.replace("'", '"')
    assert client.query("GEAR:HEIG 1;*RST;:COUN:Z?") == carriage
    assert client.errors() == []


def test_the_last_decimal_of_dc_is_a_tenth():
    client = EngineClient()
    assert client.query('GEAR:HEIG "Dc";:COUN:Z:PRES 459.08;:COUN?') == "0.00,0.00,459.1"
    assert client.query("DRIV:Z 470.44;:COUN:Z?") == "470.4"


@pytest.mark.parametrize(
    ("gear", "answer"), [('"1-2-1"', '"1-2-1"'), ("1.5", "1.5"), ("'a ''quote'''", "\"a 'quote'\""), ("'.'", '"."')]
)
def test_the_plan_gear_is_a_combination_or_a_number(gear, answer):
    assert EngineClient().query(f"GEAR:PLAN {gear};PLAN?") == answer


def test_handwheels_turn_by_units_of_the_counter():
    client = EngineClient()
    assert client.query("WHE:X 5;Y 6;Z 7;X -2;:COUN?") == "3.00,6.00,-293.00"


@pytest.mark.parametrize(
    ("collar", "counters"), [("XCOL OUT", "-5.00,6.00,-293.00"), ("YCOL IN", "5.00,-6.00,-293.00")]
)
def test_a_collar_that_does_not_belong_to_the_picture_reverses_its_handwheel(collar, counters):
    assert EngineClient().query(f"FITT:{collar};:WHE:X 5;Y 6;Z 7;:COUN?") == counters


@pytest.mark.parametrize(
    ("before", "line"),
    [
        ("DRIV:Z -140", "DRIV:X 207"),
        ("DRIV:Z -140", "WHE:Y -207"),
        ("DRIV:X 207", "DRIV:Z -140"),
        ("DRIV:Z -140", "BASE:BX 207"),
        ("DRIV:Z -140;Y 200", "PROJ2:BY 10"),
        ("DRIV:Z -140;Y 200", "PROJ1:BZ -10"),
    ],
)
def test_nothing_moves_beyond_the_range_of_the_rods(before, line):
    client = EngineClient()
    client.query(before)
    assert client.errors() == []
    positions = client.query(POSITIONS)
    client.query(line)
    assert client.errors() == [-222]
    assert client.query(POSITIONS) == positions


def test_the_rods_reach_62_gon_from_the_plumb_line():
    client = EngineClient()
    assert client.query("DRIV:Z -140;X 205;:COUN?") == "205.00,0.00,-140.00"
    assert client.errors() == []


# --- pictures and eyepieces ----------------------------------------------------------------------------


def test_pictures_are_taken_from_the_drawer_and_laid_on_a_carrier():
    client = with_photographs()
    assert client.query("PHOT:CAT?;:PHOT1?;:PHOT2?") == '"101","102","103";"";""'
    assert client.query('PHOT1:LOAD "101";:PHOT2:LOAD "102";:PHOT1?;:PHOT2?') == '"101";"102"'
    assert client.query("PHOT1:LOAD '103';:PHOT1?;:PHOT1:UNL;:PHOT1?;:PHOT:CAT?") == '"103";"";"101","102","103"'
    assert client.errors() == []


def test_an_empty_drawer_has_an_empty_catalogue():
    assert EngineClient().query("PHOT:CAT?") == '""'


def test_a_picture_lies_on_one_carrier_at_a_time():
    client = with_model()
    assert client.query('PHOT2:LOAD "101";:PHOT2?') == '"102"'
    assert client.errors() == [-221]


def listed(reply):
    """Return name,x,y,... as a dictionary."""
    cells = reply.split(",")
    return {name.strip('"'): (float(x), float(y)) for name, x, y in zip(*[iter(cells)] * 3, strict=True)}


def test_centring_shifts_the_fiducials_on_their_carrier():
    client = with_model()
    assert client.query("PHOT1:CENT?") == "0.000,0.000,0.000"
    before = listed(client.query("PHOT1:FID?"))
    assert client.query("PHOT1:CENT 0.3 MM,-200 UM,0;CENT?") == "0.300,-0.200,0.000"
    after = listed(client.query("PHOT1:FID?"))
    assert list(before) == ["1", "2", "3", "4"]
    for name, (dx, dy) in before.items():
        assert after[name] == pytest.approx((dx + 0.3, dy - 0.2), abs=0.0011)


def test_the_sketch_is_good_to_half_a_millimetre():
    client = with_model()
    sketch = listed(client.query("PHOT1:SKET?"))
    true = client.instrument.autograph.carrier(1).photograph.points
    errors = [each - place for name in sketch for each, place in zip(sketch[name], true.get(name), strict=True)]
    assert set(sketch) == set(true.names)
    assert 0.1 < (sum(error**2 for error in errors) / len(errors)) ** 0.5 < 0.5


def test_an_eyepiece_shows_the_image_from_the_mark_and_stereo_their_difference():
    client = with_model()
    left, right = client.numbers('EYEP1? "1011"'), client.numbers('EYEP2? "1011"')
    seen = client.numbers('EYEP:STER? "1011"')
    assert all(0.0 < abs(each) < 10_000.0 for each in left + right)
    assert seen == pytest.approx([left[0] - right[0], left[1] - right[1]], abs=0.011)


def test_a_mark_driven_to_the_right_leaves_the_image_to_the_left():
    client = with_model()
    before = client.numbers('EYEP1? "1011"')
    after = client.numbers('DRIV:X 1;:EYEP1? "1011"')
    assert after[0] - before[0] == pytest.approx(-1000.0 * 152.68 / 325.71, abs=0.02)
    assert after[1] == pytest.approx(before[1], abs=0.02)


def test_the_triangulation_lever_exchanges_the_eyepieces():
    client = with_model()
    straight = client.query('EYEP1? "1011";:EYEP2? "1011"').split(";")
    assert client.query('FITT:TRI FRON;:EYEP1? "1011";:EYEP2? "1011"').split(";") == straight[::-1]


@pytest.mark.parametrize("query", ["EYEP1?", "EYEP2?", "EYEP:STER?"])
def test_a_point_outside_the_field_or_missing_is_not_visible(query):
    nothing = "9.91E37,9.91E37"
    client = with_model()
    assert client.query(f'{query} "C2"') == nothing
    assert client.query(f'{query} "no such point"') == nothing
    assert client.query(f'PHOT1:UNL;:PHOT2:UNL;:{query} "1011"') == nothing
    assert client.errors() == []


@pytest.mark.parametrize(("columns", "rows"), [(1, 1), (8, 3), (64, 48), (1024, 1)])
def test_a_picture_is_a_block_of_columns_times_rows_bytes(columns, rows):
    reply = with_model().feed(f"EYEP1:PICT? {columns},{rows},2\n".encode())
    digits = int(reply[1:2])
    assert reply[:1] == b"#"
    assert int(reply[2 : 2 + digits]) == columns * rows
    assert len(reply) == 2 + digits + columns * rows + 1
    assert reply.endswith(b"\n")


def test_a_picture_has_the_mark_in_its_middle_and_is_dark_outside_the_field():
    block = with_model().feed(b"EYEP1:PICT? 33,33,0.5\n")[6:-1]
    assert block[33 * 16 + 16] == 255
    assert {block[0], block[32], block[33 * 32], block[33 * 33 - 1]} == {0}


def test_the_journal_keeps_size_and_checksum_of_a_picture_only():
    heard: list[LinkEvent] = []
    client = with_model(heard.append)
    heard.clear()
    reply = client.feed(b"*OPC?;:EYEP1:PICT? 16,16,1\n")
    block = reply.removeprefix(b"1;").removesuffix(b"\n")
    assert [event.direction for event in heard] == [">", "~", "<"]
    assert heard[2].text == f"1;#block of {len(block)} bytes, crc32 {zlib.crc32(block):08x}"


def test_no_query_discloses_a_fault_of_the_instrument():
    faulty = ProjectorCondition(phi_zero_gon=0.5, kappa_zero_gon=0.3, by_zero_mm=0.2, principal_distance_mm=0.1)
    condition = Condition(left=faulty, right=faulty, bx_zero_mm=0.4, setting_sigma_mm=0.1, backlash_mm=0.1)
    line = f"PROJ1:PHI 99;KAPP 5;BY 3;:BASE:BX 20;:DRIV:X 10;:{POSITIONS}"
    assert EngineClient(SharedInstrument(Autograph(VARIANTS["A7"], condition))).query(line) == EngineClient().query(
        line
    )


# --- recording -----------------------------------------------------------------------------------------


def test_a_registration_holds_the_counters_and_the_named_elements():
    client = EngineClient()
    client.query("PROJ1:BY 1.5;:PROJ2:KAPP 5;:DRIV:X 10;:REC 'P1';:REC 'P2',BY1,kappa2,BX,PDISTANCE1")
    assert (
        client.query("REC:LAST?;COUN?") == '2,"P2",10.00,0.00,-300.00,BY1,1.50,KAPPA2,5.00,BX,0.00,PDISTANCE1,150.00;2'
    )
    assert client.errors() == []


def test_a_registration_shows_the_decimals_of_the_gear():
    assert EngineClient().query("GEAR:HEIG 'Dc';:REC 'P';:REC:LAST?") == '1,"P",0.00,0.00,-300.0'


def test_struck_entries_stay_marked():
    client = EngineClient()
    client.query("REC 'P1';:REC 'P2';:REC:STR 2,'wrong, point'")
    assert client.query("REC:LAST?;COUN?") == '2,"P2",0.00,0.00,-300.00,"struck: wrong, point";2'
    assert client.query("REC? 1;REC? 2;REC:STR:COUN?") == (
        '1,"P1",0.00,0.00,-300.00;2,"P2",0.00,0.00,-300.00,"struck: wrong, point";1'
    )
    client.query("REC:STR 0,'x';STR 3,'x'")
    assert client.errors() == [-222, -222]


def test_the_listener_gets_all_lines_of_the_link_in_order_with_their_times():
    heard: list[LinkEvent] = []
    instrument = SharedInstrument(Autograph(VARIANTS["A7"]), heard.append)
    engine = instrument.open()
    engine.feed(b"NOTE 'coffee'\n*OPC?;FOO?;*TST?\n", 12.5)
    engine.feed(b"\n" + b" " * 5000 + b"\n", 13.0)
    instrument.close(engine.client, 14.0)
    assert [(event.time, event.direction) for event in heard] == [
        *[(0.0, "+"), (12.5, ">"), (12.5, ">"), (12.5, "<"), (13.0, "!"), (14.0, "-")]
    ]
    assert [event.text for event in heard[1:4]] == ["NOTE 'coffee'", "*OPC?;FOO?;*TST?", "1;0"]
    assert len(heard[4].text) < 100
    assert {event.client for event in heard} == {engine.client}


def test_wheels_presets_and_centring_know_min_max_and_def():
    client = EngineClient()
    client.query("WHE:Y MIN")
    assert client.query("COUN:Y?") == "-420.00"
    client.query("WHE:Y 420;X MAX")
    assert client.query("COUN:X?;Y?") == "280.00;0.00"
    client.query("WHE:X DEF")
    assert client.query("COUN:X?") == "280.00"
    client.query("COUN:X:PRES MAX")
    assert client.query("COUN:X?") == "999999.99"
    client.query("COUN:X:PRES 1E6")
    assert client.errors() == [-222]
