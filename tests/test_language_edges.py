"""Edges of SCPI's grammar as a table, of the kind that scpi-parser tests: a line, its reply, its errors."""

import re

import pytest

from a7sim.instrument.language.commands import COMMANDS
from tests.support.engine_client import EngineClient, with_model, with_photographs

HEADERS = [
    ("SYST:ERR?;VERS?", '0,"No error";1999.0', []),
    ("SYST:ERR?;COUN?", '0,"No error"', [-113]),
    ("SYST:ERR:NEXT?;COUN?", '0,"No error";0', []),
    ("STAT:OPER:ENAB 3;ENAB?;COND?;:STAT:QUES:ENAB?", "3;2;0", []),
    ("STAT:OPER?;QUES?;PRES;OPER:ENAB?;COND?", "2;0;0;2", []),
    ("PROJ2:KAPP 5; PHI 99 ;\tOMEG 98;KAPP?; PHI?;OMEG?", "5.00;99.00;98.00", []),
    ("PROJ2:KAPP 5; :BASE:BX? ; :PROJ2:KAPP?", "194.99;5.00", []),
    ("PROJ2:KAPP 5;PROJ1:KAPP?", "", [-113]),
    ("BASE:BX?;:MODE?", "194.99", [-113]),
    (";BASE:BX?", "194.99", []),
    (";;:BASE:BX?;;MODE?;", "194.99;IN", []),
    ("BASE:BX?;*OPC?;MODE?;*TST?;:BASE:BX?", "194.99;1;IN;0;194.99", []),
    ("FOO:BAR?;BX?;:BASE:BX?", "194.99", [-113, -113]),
    ("BASE :BX?", "", [-113]),
    ("BASE: BX?", "", [-102]),
    ("BASE:BX ?", "", [-104]),
    ("BASE:BX?;:", "194.99", [-102]),
    (":", "", [-102]),
    ("PROJ01:KAPP?", "0.00", []),
    ("PROJ1:KAPP1?", "", [-113]),
    ("PROJ1KAPP?", "", [-113]),
    ("PROJ-1:KAPP?", "", [-102]),
    ("PROJ 1:KAPP?", "", [-113]),
    ("PROJ<n>:KAPP?", "", [-102]),
    ("PROJ12345678901234567890:KAPP?", "", [-113]),
    ("_BASE:BX?", "", [-102]),
    ("*opc?;*Tst?", "1;0", []),
]

QUOTES = [
    ('NOTE "a;b";:BASE:BX?', "194.99", []),
    ("NOTE 'a;\"b;';:BASE:BX?", "194.99", []),
    ('NOTE "a;*OPC?', "", [-102]),
    ('NOTE "a"";*OPC?";*TST?', "0", []),
    ("NOTE \"a';*OPC?", "", [-102]),
    ('NOTE "a", "b"', "", [-108]),
    ('NOTE""', "", [-102]),
    ('EYEP1? "x;y";:BASE:BX?', "9.91E37,9.91E37;194.99", []),
    ("REC:STR 1 , 'a, b'", "", [-222]),
]

NUMBERS = [
    ("PROJ1:BY +.5E+1MM;BY?", "5.00", []),
    ("PROJ1:BY\t5\tmM;BY?", "5.00", []),
    ("PROJ1:BY 1e3 um;BY?", "1.00", []),
    ("PROJ1:BY -0;BY?", "0.00", []),
    ("PROJ1:BY 00005;BY?", "5.00", []),
    ("PHOT1:CENT 0.1 , 0.2\t,0.3;CENT?", "0.100,0.200,0.300", []),
    ("PROJ1:BY 1,5", "", [-108]),
    ("PROJ1:BY 1e", "", [-131]),
    ("PROJ1:BY 1e+", "", [-104]),
    ("PROJ1:BY --5", "", [-104]),
    ("PROJ1:BY 5-", "", [-104]),
    ("PROJ1:BY 0x10", "", [-104]),
    ("PROJ1:BY 1_000", "", [-104]),
    ("PROJ1:BY .", "", [-104]),
    ("PROJ1:BY INF", "", [-104]),
    ("PROJ1:BY NAN", "", [-104]),
    ("PROJ1:BY 9.91E37", "", [-222]),
    ("PROJ1:BY 5 MM MM", "", [-104]),
    ("PROJ1:BY 5 M", "", [-131]),
    ("*ESE 60.4;*ESE?", "60", []),
    ("*ESE 1E1;*ESE?", "10", []),
]

WORDS = [
    ("PROJ1:PHI MIN;PHI?;PHI mAx;PHI?;PHI default;PHI?", "70.00;106.00;100.00", []),
    ("PROJ1:PHI? MIN;PHI? maximum;PHI? DEF;PHI?", "70.00;106.00;100.00;100.00", []),
    ("PROJ1:PHI minimum;PHI?;PHI MAXIMUM;PHI?;PHI Default;PHI?", "70.00;106.00;100.00", []),
    ("PROJ1:PHI MINI", "", [-104]),
    ("PROJ1:PHI? MINI", "", [-224]),
    ("PROJ1:PHI 'MIN'", "", [-104]),
    ("PROJ1:PHI MIN MAX", "", [-104]),
    ("PROJ1:PHI MIN GON", "", [-104]),
    ("PROJ2:PHI? MIN;:PROJ1:PHI? MIN", "94.00;70.00", []),
    ("DRIV:X? MIN", "", [-113]),
    ("*SRE MAX", "", [-104]),
    ("EYEP1:PICT? MIN,4,1", "", [-104]),
    ("BASE:MODE outside;MODE?;MODE in;MODE?", "OUT;IN", []),
    ("BASE:MODE OUTS", "", [-224]),
    ("BASE:MODE IN OUT", "", [-104]),
]


@pytest.mark.parametrize(("line", "reply", "errors"), HEADERS + QUOTES + NUMBERS + WORDS)
def test_a_line_at_the_edge_of_the_grammar(line, reply, errors):
    client = with_model()
    assert client.query(line) == reply
    assert client.errors() == errors


def test_a_plain_query_has_the_same_reply_with_and_without_a_listener():
    """The fast path of one plain query without a listener gives the replies of the general path."""
    for new in (with_photographs, with_model, guarded):
        quick, heard = new(), new()
        heard.instrument.listener = [].append
        for header in COMMANDS.headers():
            query = re.sub(r"\[[^]]*\]", "", header.replace("<n>", "2"))
            if query.endswith("?"):
                assert (query, quick.query(query)) == (query, heard.query(query))
                assert queue(quick) == queue(heard)


def test_a_listener_gets_a_whole_line_except_for_a_token():
    client = guarded()
    client.instrument.listener = (heard := []).append
    client.query("""SYST:LOG "ours""; yours";*OPC?;:SYST:LOGIN 'heerbrugg';*OPC?""")
    client.query("SYST:LOG heerbrugg")
    assert [event.text for event in heard if event.direction == ">"] == [
        'SYST:LOG "(not the token)";*OPC?;:SYST:LOGIN "(the token)";*OPC?',
        "SYST:LOG (kept secret)",
    ]
    assert [event.text for event in heard if event.direction == "<"] == ["1"]


def guarded() -> EngineClient:
    client = with_photographs()
    client.instrument.token = "heerbrugg"
    return EngineClient(client.instrument)


def queue(client):
    return list(client.engine.status.errors)
