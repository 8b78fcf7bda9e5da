"""The serial line (house.md, protocol.md): `a7sim://` is a pyserial port like any other, for PyVISA, for `Client`."""

import re
import threading
import time

import pytest
import pyvisa
import serial

import a7sim
from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.client.client import Client, InstrumentError
from a7sim.link.clock import Clock
from a7sim.link.inprocess import InProcessSerial
from a7sim.plotters import VARIANTS
from tests.support.engine_client import MODEL_1

URL = "a7sim://scenarios/akwanga.toml?seed=7"
SHORT = 0.05
"""A timeout in s that the tests wait for."""


@pytest.fixture
def port():
    with serial.serial_for_url(URL, timeout=SHORT) as opened:
        yield opened


def answers(port, line):
    port.write(line.encode() + b"\n")
    return port.readline()


# --- a pyserial object ---------------------------------------------------------------------------------


def test_importing_a7sim_teaches_pyserial_the_url(port):
    assert isinstance(port, serial.SerialBase)
    assert port.is_open
    assert port.port == URL
    assert answers(port, "*IDN?") == f"WILD HEERBRUGG,A7,3268,{a7sim.__version__}\n".encode()


def test_a_write_says_how_many_bytes_it_took_and_takes_any_bytes(port):
    assert port.write(b"*OPC?") == 5
    assert port.write(bytearray(b";*TST?")) == 6
    assert port.write(memoryview(b"\n")) == 1
    assert port.readline() == b"1;0\n"


def test_a_write_of_text_is_refused_as_pyserial_refuses_it(port):
    with pytest.raises(TypeError, match="unicode strings are not supported"):
        port.write("*OPC?\n")


def test_bytes_wait_until_they_are_read(port):
    assert port.in_waiting == 0
    port.write(b"*OPC?;*TST?\n*OPC?\n")
    assert (port.in_waiting, port.out_waiting) == (6, 0)
    assert port.read() == b"1"
    assert port.read(3) == b";0\n"
    assert port.in_waiting == 2
    assert port.read_all() == b"1\n"
    assert port.in_waiting == 0


def test_read_until_stops_behind_what_it_expects_or_at_a_size(port):
    port.write(b"PROJ1:PHI?;OMEG?;BY?\n")
    assert port.read_until(b";") == b"100.00;"
    assert port.read_until(b";", size=3) == b"100"
    assert port.read_until() == b".00;0.00\n"


def test_readline_stops_at_a_size(port):
    port.write(b"COUN?\n")
    assert port.readline(4) == b"0.00"
    assert port.readline() == b",0.00,-300.00\n"
    port.write(b"*OPC?\n*TST?\n")
    assert (port.readline(3), port.readline(3)) == (b"1\n", b"0\n")


def test_lines_can_be_looped_over(port):
    port.write(b"*OPC?\n*TST?\n")
    assert list(port) == [b"1\n", b"0\n"]


@pytest.mark.parametrize(
    "read", [lambda port: port.read(10), lambda port: port.readline(), lambda port: port.read_until(b"x")]
)
def test_a_read_returns_what_there_is_when_its_timeout_ends(port, read):
    assert read(port) == b""
    port.write(b"*OPC?;*TS")
    port.write(b"T?\n*OPC?")
    began = time.monotonic()
    assert port.read(10) == b"1;0\n"
    assert time.monotonic() - began >= SHORT * 0.9


def test_a_timeout_of_zero_does_not_wait(port):
    port.timeout = 0
    began = time.monotonic()
    assert (port.read(10), port.readline()) == (b"", b"")
    port.write(b"*OPC?\n")
    assert port.read(10) == b"1\n"
    assert time.monotonic() - began < SHORT


@pytest.mark.parametrize(
    ("read", "expected"), [(lambda port: port.read(2), b"1\n"), (lambda port: port.readline(), b"1\n")]
)
def test_without_a_timeout_a_read_waits_for_a_write(port, read, expected):
    port.timeout = None
    got = []
    reader = threading.Thread(target=lambda: got.append(read(port)), daemon=True)
    reader.start()
    port.write(b"*O")
    reader.join(SHORT)
    assert reader.is_alive()
    port.write(b"PC?\n")
    reader.join(5.0)
    assert got == [expected]


@pytest.mark.parametrize("release", [lambda port: port.cancel_read(), lambda port: port.close()])
def test_a_waiting_read_can_be_called_off(port, release):
    port.timeout = None
    got = []
    reader = threading.Thread(target=lambda: got.append(port.readline()), daemon=True)
    reader.start()
    reader.join(SHORT)
    assert reader.is_alive()
    release(port)
    reader.join(5.0)
    assert got == [b""]


def test_a_read_called_off_leaves_the_next_one_alone(port):
    port.cancel_read()
    assert port.read() == b""
    began = time.monotonic()
    assert port.read() == b""
    assert time.monotonic() - began >= SHORT * 0.9


def test_line_settings_are_taken_and_change_nothing():
    with serial.serial_for_url(
        URL, baudrate=1200, bytesize=7, parity="E", stopbits=2, rtscts=True, write_timeout=SHORT, timeout=SHORT
    ) as port:
        port.baudrate = 115200
        port.write_timeout = 0
        port.rts = port.dtr = False
        port.send_break(0)
        assert (port.baudrate, port.parity, port.write_timeout) == (115200, "E", 0)
        assert (port.cts, port.dsr, port.ri, port.cd) == (True, True, False, True)
        assert answers(port, "*OPC?") == b"1\n"
        port.flush()


def test_resetting_the_input_forgets_replies_that_were_not_read(port):
    port.write(b"*OPC?\n")
    port.reset_input_buffer()
    assert port.in_waiting == 0
    port.write(b"*TS")
    port.reset_output_buffer()
    assert answers(port, "T?") == b"0\n"


@pytest.mark.parametrize(
    "use",
    [
        lambda port: port.read(),
        lambda port: port.readline(),
        lambda port: port.read_until(),
        lambda port: port.write(b"*OPC?\n"),
        lambda port: port.in_waiting,
        lambda port: port.out_waiting,
        lambda port: port.flush(),
        lambda port: port.reset_input_buffer(),
        lambda port: port.reset_output_buffer(),
    ],
)
def test_a_closed_port_is_not_open(port, use):
    port.close()
    port.close()
    assert not port.is_open
    with pytest.raises(serial.PortNotOpenError):
        use(port)


def test_a_context_closes_its_port_and_opens_it_again():
    port = serial.serial_for_url(URL, timeout=SHORT, do_not_open=True)
    assert not port.is_open
    with port:
        assert port.is_open
        assert answers(port, "*OPC?") == b"1\n"
    assert not port.is_open
    with port:
        assert answers(port, "*OPC?") == b"1\n"


def test_a_port_opened_again_finds_its_instrument_in_a_new_conversation(port):
    port.write(b"BASE:BX 20;:FOO;*OPC?\n*TS")
    port.close()
    port.open()
    assert port.in_waiting == 0
    assert answers(port, "BASE:BX?;:SYST:ERR:COUN?") == b"20.00;0\n"


def test_another_url_is_another_instrument(port):
    port.write(b"BASE:BX 20\n")
    port.port = "a7sim://akwanga?seed=8"
    assert port.is_open
    assert answers(port, "BASE:BX?") == b"0.00\n"


def test_an_open_port_cannot_be_opened_nor_one_without_a_name(port):
    with pytest.raises(serial.SerialException, match="which is open"):
        port.open()
    with pytest.raises(serial.SerialException, match="expected a port"):
        serial.serial_for_url(URL, do_not_open=True).__class__().open()


def test_two_ports_are_two_instruments(port):
    port.write(b"BASE:BX 20\n")
    with serial.serial_for_url(URL, timeout=SHORT) as other:
        assert answers(other, "BASE:BX?") == b"0.00\n"


def drawn(url):
    with serial.serial_for_url(url, timeout=SHORT) as port:
        port.write(b'PHOT1:LOAD "101"\n')
        return answers(port, "PHOT1:FID?;SKET?")


def test_the_seed_draws_the_photographs():
    assert drawn(URL) == drawn("A7SIM://akwanga?seed=7")
    assert drawn(URL) != drawn("a7sim://akwanga?seed=8")
    assert drawn("a7sim://akwanga") == drawn("a7sim://akwanga.toml?seed=1985")


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("a7sim://", "expected a URL like"),
        ("a7sim://?seed=7", "expected a URL like"),
        ("a7sim://akwanga?sed=7", "expected a URL like"),
        ("a7sim://akwanga?seed=", "expected a URL like"),
        ("a7sim://akwanga?seed=-7", "expected a URL like"),
        ("a7sim://akwanga?seed=7.5", "expected a URL like"),
        ("a7sim://akwanga?seed=" + "9" * 5000, "expected a URL like"),
        ("a7sim://akwanga?seed=7&seed=8", "expected a URL like"),
        ("a7sim://akwanga#7", "expected a URL like"),
        ("a7sim://[akwanga", "expected a scenario file"),
        ("a7sim://no/such.toml", "expected a scenario file"),
        ("a7sim://scenarios", "expected a scenario file"),
        ("a7sim://" + "a" * 5000, "File name too long"),
    ],
)
def test_a_bad_url_scenario_or_seed_is_one_clear_sentence(url, sentence):
    with pytest.raises(serial.SerialException, match=sentence) as raised:
        serial.serial_for_url(url)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("text", ["seed = = 1", "schema_version = 1\nseed = -1\ntitle = 5", "\x00"])
def test_a_bad_scenario_file_is_one_line_that_names_it(tmp_path, text):
    path = tmp_path / "bad%20.toml"
    path.write_text(text)
    with pytest.raises(serial.SerialException, match=re.escape(str(path))) as raised:
        serial.serial_for_url(f"a7sim://{str(path).replace('%', '%25')}?seed=1")
    assert "\n" not in str(raised.value)


# --- several ports at one instrument -------------------------------------------------------------------------


def test_ports_at_one_instrument_share_it_and_its_lock_and_a_closed_port_frees_the_lock():
    instrument = SharedInstrument(Autograph(VARIANTS["A7"]))
    first, second = (
        InProcessSerial(instrument=instrument, timeout=SHORT),
        InProcessSerial(instrument=instrument, timeout=SHORT),
    )
    assert answers(first, "BASE:BX 20;:SYST:LOCK:REQ?") == b"1\n"
    assert answers(second, "BASE:BX?;:SYST:LOCK:REQ?") == b"20.00;0\n"
    first.close()
    assert answers(second, "SYST:LOCK:REQ?") == b"1\n"


def test_lines_cross_at_the_time_of_the_clock():
    heard = []
    clock = Clock()
    port = InProcessSerial(
        instrument=SharedInstrument(Autograph(VARIANTS["A7"]), heard.append), clock=clock, timeout=SHORT
    )
    clock.advance(12.5)
    answers(port, "*OPC?")
    assert [(event.time, event.direction, event.text) for event in heard] == [
        (0.0, "+", ""),
        (12.5, ">", "*OPC?"),
        (12.5, "<", "1"),
    ]


def test_a_port_without_an_instrument_cannot_be_opened():
    with pytest.raises(serial.SerialException, match="expected an instrument"):
        InProcessSerial("anywhere")


# --- PyVISA --------------------------------------------------------------------------------------------


@pytest.fixture
def resource():
    manager = pyvisa.ResourceManager("@py")
    opened = manager.open_resource("ASRLa7sim://akwanga?seed=7::INSTR", read_termination="\n", timeout=1000)
    yield opened
    opened.close()
    manager.close()


def test_pyvisa_writes_and_queries(resource):
    resource.write("PROJ1:KAPP 5")
    assert resource.query("PROJ1:KAPP?") == "5.00"
    assert resource.query("*IDN?").startswith("WILD HEERBRUGG,A7,")
    assert resource.query_ascii_values("COUN?") == [0.0, 0.0, -300.0]
    assert resource.query("SYST:ERR?") == '0,"No error"'


def test_pyvisa_times_out_where_nothing_answers(resource):
    resource.timeout = 1000 * SHORT
    with pytest.raises(pyvisa.VisaIOError, match="VI_ERROR_TMO"):
        resource.query("FOO?")
    assert resource.query("SYST:ERR?").startswith("-113,")


def test_pyvisa_reads_a_picture(resource):
    for line in MODEL_1:
        resource.write(line)
    grey = resource.query_binary_values("EYEP1:PICT? 65,49,1", datatype="B", container=bytes)
    assert len(grey) == 65 * 49
    assert grey[65 * 24 + 32] == 255
    assert len(set(grey)) > 20
    assert resource.query("*OPC?") == "1"


# --- the client ----------------------------------------------------------------------------------------


@pytest.fixture
def client(port):
    return Client(port)


def test_a_client_sends_asks_and_reads_numbers(client):
    client.send("BASE:BX 194.99")
    assert client.ask("BASE:BX?;MODE?") == "194.99;IN"
    assert client.numbers("BASE:BX?;:PROJ1:KAPP?;:COUN?") == [194.99, 0.0, 0.0, 0.0, -300.0]
    assert client.numbers('EYEP1? "1011"') == [9.91e37, 9.91e37]
    assert client.errors() == []


def test_a_client_that_gets_no_answer_says_what_the_instrument_reported(client):
    with pytest.raises(InstrumentError, match="Undefined header") as raised:
        client.ask("FOO?")
    assert raised.value.line == "FOO?"
    assert [each.split(",")[0] for each in raised.value.errors] == ["-113"]
    assert client.errors() == []


def test_a_client_that_asks_nothing_gets_no_answer(client):
    with pytest.raises(InstrumentError, match="no answer"):
        client.ask("BASE:BX 5")


def test_a_client_checks_that_all_was_obeyed(client):
    client.check("before")
    client.send("BASE:BX 999;:FOO")
    with pytest.raises(InstrumentError, match="setting the base") as raised:
        client.check("setting the base")
    assert [each.split(",")[0] for each in raised.value.errors] == ["-222", "-113"]
    client.check("after")
