"""Stock clients run one script of more than 200 lines over every link and get the same answers (issue 5)."""

from contextlib import contextmanager

import pytest
import pyvisa
import serial

from tests.support.engine_client import MODEL_1
from tests.support.links import new_instrument, serve_on_all_links
from tests.test_language import EXAMPLES, NOT_ON_AN_A7, in_full, in_short

BLOCKS = {"EYEPiece<n>:PICTure?"}
"""Queries whose answers may contain line ends; they are sent separately."""

AFTER = {"PHOTo<n>:UNLoad": ['PHOT2:LOAD "102"', "PHOT2?"], "SYSTem:LOCK:RELease": ["SYST:LOCK:REQ?"]}
"""Lines that must follow a line so that the next ones have an answer."""

PICTURE = "EYEP1:PICT? 64,48,2"

SCRIPT = [
    "*CLS",
    *MODEL_1,
    *(
        line
        for form in (in_short, in_full)
        for header, value in EXAMPLES.items()
        if header not in NOT_ON_AN_A7 | BLOCKS
        for line in (f"{form(header)} {value}".strip(), *AFTER.get(header, ()))
    ),
    "COMM:PHI 101",
    "PROJ1:KAPP 5;PHI 99;:BASE:BX 190",
    "PROJ1:KAPP?;PHI?;OMEG?;:BASE:BX?;MODE?",
    'REC "a;b";:REC:LAST?',
    "BASE:BX 999;BX?;BX? MAX",
    "SYST:ERR:COUN?",
    "SYST:ERR?;ERR?;ERR?",
    "*ESR?;*STB?;*OPC?",
    "*RST;:COUN?",
    "DRIV:X 10;Y -10;:COUN?",
    "WHE:X 0.5;:COUN:X?",
    "STAT:OPER:COND?;EVEN?",
    "projector2:omega?",
    "*OPC;*WAI;*ESR?",
    "GEAR:HEIG 'Dc';HEIG?;:COUN:Z?",
    "FOO",
    "NOTE 'the end'",
]


@contextmanager
def by_visa(name):
    manager = pyvisa.ResourceManager("@py")
    instrument = manager.open_resource(name, read_termination="\n", write_termination="\n", timeout=3000)
    try:
        yield (
            instrument.query,
            instrument.write,
            lambda line: instrument.query_binary_values(line, datatype="B", container=bytes),
        )
    finally:
        instrument.close()
        manager.close()


@contextmanager
def by_pyserial(url):
    with serial.serial_for_url(url, timeout=3.0) as port:

        def write(line):
            port.write(line.encode() + b"\n")

        def query(line):
            write(line)
            return port.readline().decode().removesuffix("\n")

        def picture(line):
            write(line)
            digits = int(port.read(2)[1:])
            grey = port.read(int(port.read(digits)))
            assert port.read(1) == b"\n"
            return grey

        yield query, write, picture


CLIENTS = {
    "PyVISA TCPIP SOCKET": lambda urls: by_visa("TCPIP0::{}::{}::SOCKET".format(*urls["socket"][9:].split(":"))),
    "PyVISA ASRL pty": lambda urls: by_visa(f"ASRL{urls['pty']}::INSTR"),
    "PyVISA ASRL a7sim": lambda urls: by_visa("ASRLa7sim://akwanga?seed=7::INSTR"),
    "pyserial socket": lambda urls: by_pyserial(urls["socket"]),
    "pyserial tcp": lambda urls: by_pyserial(urls["tcp"]),
    "pyserial rfc2217": lambda urls: by_pyserial(urls["rfc2217"]),
    "pyserial pty": lambda urls: by_pyserial(urls["pty"]),
    "pyserial a7sim": lambda urls: by_pyserial("a7sim://akwanga?seed=7"),
}


def conversation(client):
    """Return every line of the script with its answer, and the picture after it."""
    query, write, picture = client
    answers = [(line, query(line) if is_query(line) else write(line) and None) for line in SCRIPT]
    for line in MODEL_1:
        write(line)
    return answers, picture(PICTURE), query("SYST:ERR:COUN?;NEXT?;NEXT?;NEXT?;NEXT?;NEXT?")


def is_query(line):
    return "?" in line


@pytest.fixture(scope="module")
def first():
    with CLIENTS["pyserial a7sim"]({}) as client:
        return conversation(client)


def test_the_script_has_200_lines_or_more_and_every_query_of_it_is_answered(first):
    answers, picture, errors = first
    assert len(SCRIPT) >= 200
    assert all(answer for line, answer in answers if is_query(line))
    assert len(picture) == 64 * 48
    assert errors.startswith('5;-221,"Settings conflict;')
    assert dict(answers)["PROJ1:KAPP?;PHI?;OMEG?;:BASE:BX?;MODE?"].startswith("5.00;99.00;")


@pytest.mark.parametrize("name", CLIENTS)
def test_every_client_gets_the_same_answers(first, name):
    with serve_on_all_links(new_instrument()) as urls, CLIENTS[name](urls) as client:
        assert conversation(client) == first
