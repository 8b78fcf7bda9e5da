"""The client of the link: any URL opens as a pyserial port, a client locks and waits, replies hold any byte."""

import socket
import threading

import pytest
import serial

import a7sim
from a7sim.errors import A7SimError
from a7sim.instrument.language import SharedInstrument
from a7sim.link.client.client import Client, Identity, InstrumentError
from a7sim.link.client.completion import completions
from a7sim.link.client.exchange import send_line
from a7sim.link.client.ports import open_port, port_errors
from a7sim.link.client.replies import MalformedReplyError, parse_reply
from tests.support.engine_client import MODEL_1
from tests.support.links import new_instrument, serve_on
from tests.test_language import EXAMPLES

WIRES = ("tcp", "socket", "rfc2217", "pty")
SHORT = 0.1


@pytest.fixture(scope="module")
def instrument():
    return new_instrument()


@pytest.fixture
def client(instrument):
    with serve_on("tcp", instrument) as url, Client.open(url, timeout=0.5) as opened:
        opened.send("*RST")
        yield opened


# --- opening -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", WIRES)
def test_any_url_opens_as_a_pyserial_port(instrument, kind):
    with serve_on(kind, instrument) as url, open_port(url, timeout=1.0) as port:
        assert isinstance(port, serial.SerialBase)
        port.write(b"*OPC?;*TST?\n*OPC?\n")
        assert (port.readline(), port.read(1), port.read_until(b"\n")) == (b"1;0\n", b"1", b"\n")


def test_an_in_process_instrument_opens_by_its_url():
    with Client.open("a7sim://akwanga?seed=7") as client:
        assert client.identity == Identity("WILD HEERBRUGG", "A7", "3268", a7sim.__version__)


def unused_port():
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


@pytest.mark.parametrize(
    ("url", "sentence"),
    [
        ("", "expected a7sim://SCENARIO"),
        ("tcp://", "expected a7sim://SCENARIO"),
        ("tcp://localhost", "expected a7sim://SCENARIO"),
        ("tcp://localhost:scpi", "expected a7sim://SCENARIO"),
        ("http://localhost:80", "expected a7sim://SCENARIO"),
        ("loop://", "expected a7sim://SCENARIO"),
        ("tcp://127.0.0.1:65536", "expected a7sim://SCENARIO"),
        ("no/such/device", "no such file or directory"),
        (".", "is a directory"),
        (__file__, "ioctl"),
        ("a7sim://nowhere", "expected a scenario file"),
    ],
)
def test_a_url_that_cannot_be_opened_is_reported_in_one_sentence(url, sentence):
    with pytest.raises(A7SimError, match=sentence) as raised:
        open_port(url)
    assert "\n" not in str(raised.value)
    assert url in str(raised.value)


@pytest.mark.parametrize("scheme", ["tcp", "socket", "rfc2217"])
def test_a_refused_connection_is_reported(scheme):
    with pytest.raises(
        A7SimError, match=r"127\.0\.0\.1:\d+: expected an instrument to answer there: connection refused"
    ):
        open_port(f"{scheme}://127.0.0.1:{unused_port()}")


def test_a_broken_connection_is_reported_in_one_sentence():
    with socket.create_server(("127.0.0.1", 0)) as server:
        url = f"tcp://127.0.0.1:{server.getsockname()[1]}"
        with pytest.raises(A7SimError, match=f"{url}: the line broke: the other end hung up"), port_errors(url):
            port = open_port(url)
            server.accept()[0].close()
            port.readline()


# --- the TCP port --------------------------------------------------------------------------------------


@pytest.fixture
def pair():
    """Yield a port and the socket at its other end."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = open_port(f"tcp://127.0.0.1:{server.getsockname()[1]}", timeout=SHORT)
        with server.accept()[0] as far_end, port:
            yield port, far_end


def test_short_lines_are_sent_at_once(pair):
    port, _ = pair
    assert port._socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)


def test_a_port_reads_lines_however_they_arrive(pair):
    port, other = pair
    other.sendall(b"one\ntwo\nth")
    assert (port.readline(), port.readline(2), port.readline()) == (b"one\n", b"tw", b"o\n")
    threading.Timer(SHORT / 4, other.sendall, [b"ree\n"]).start()
    assert port.readline() == b"three\n"
    assert port.readline() == b""
    other.sendall(b"half")
    assert (port.readline(), port.in_waiting) == (b"half", 0)


def test_a_port_drops_waiting_bytes_when_its_input_is_reset(pair):
    port, other = pair
    other.sendall(b"one\ntwo\n")
    assert port.readline() == b"one\n"
    assert port.in_waiting >= 4
    port.reset_input_buffer()
    assert (port.in_waiting, port.readline()) == (0, b"")


def test_a_closed_port_disconnects_and_raises_when_read(pair):
    port, other = pair
    port.close()
    port.close()
    assert other.recv(10) == b""
    with pytest.raises(serial.PortNotOpenError):
        port.readline()


# --- the client ----------------------------------------------------------------------------------------


def test_a_client_holds_the_lock_within_a_block_and_releases_it(client, instrument):
    with Client.open("a7sim://akwanga") as alone, alone.lock() as same:
        assert same is alone
    with client.lock():
        other = instrument.open()
        other.feed(b"BASE:BX 10\n", 0.0)
        assert other.feed(b"SYST:ERR?\n", 0.0).startswith(b"-203")
        client.send("BASE:BX 20")
    assert client.ask("BASE:BX?") == "20.00"
    other.feed(b"BASE:BX 30\n", 0.0)
    assert client.ask("BASE:BX?") == "30.00"


def test_a_lock_held_by_another_client_raises_an_error(client, instrument):
    other = instrument.open()
    other.feed(b"SYST:LOCK:REQ?\n", 0.0)
    with pytest.raises(InstrumentError, match="another client holds the lock"), client.lock():
        pytest.fail("the lock was given twice")
    instrument.close(other.client)


def test_a_lock_is_released_when_its_block_fails(client, instrument):
    with pytest.raises(ZeroDivisionError), client.lock():
        raise ZeroDivisionError
    assert client.ask("*OPC?") == "1"
    assert instrument.lock_holder is None


def test_a_client_waits_for_movement(client):
    client.send("DRIV:X 10")
    client.wait()
    assert client.ask("COUN:X?") == "10.00"


def test_a_closed_client_cannot_send(client):
    client.close()
    with pytest.raises(serial.PortNotOpenError):
        client.ask("*OPC?")


def test_the_quotes_of_a_token_are_doubled_at_the_login():
    sent = []

    class WriteOnlyPort:
        def write(self, data):
            sent.append(data)

    Client(WriteOnlyPort()).log_in('a "token"')
    assert sent == [b'SYST:LOG "a ""token"""\n']


# --- replies -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("received", "parts", "rest"),
    [
        (b"1\n", ("1",), b""),
        (b"\n", ("",), b""),
        (b"1;0\n2\n", ("1", "0"), b"2\n"),
        (b"1\r\n", ("1",), b""),
        (b'0,"a;b";"say ""x;""";3\n', ('0,"a;b"', '"say ""x;"""', "3"), b""),
        (b"#15ab\n;c\n", (b"ab\n;c",), b""),
        (b"1;#212" + b"\n" * 12 + b";2\nx", ("1", b"\n" * 12, "2"), b"x"),
        (b"#10\n", (b"",), b""),
    ],
)
def test_a_reply_is_parsed_only_when_it_is_complete(received, parts, rest):
    taken = parse_reply(received)
    assert taken.parts == parts
    assert received[taken.length :] == rest
    for length in range(taken.length):
        assert parse_reply(received[:length]) is None


@pytest.mark.parametrize("received", [b"#0abc\n", b"#x\n", b"#2ab1\n", b"#11ab\n"])
def test_bytes_that_are_no_reply_raise_an_error(received):
    with pytest.raises(MalformedReplyError):
        parse_reply(received)


def test_a_client_reads_a_picture_after_other_replies(client):
    for line in MODEL_1:
        client.send(line)
    client.send("*OPC?;:EYEP1:PICT? 200,100,1;:BASE:BX?")
    done, grey, base = client.reply()
    assert (done, len(grey), base) == ("1", 20000, "194.99")
    assert client.block("EYEP1:PICT? 200,100,1") == grey
    with pytest.raises(InstrumentError):
        client.block("*OPC?")
    client.send("PHOT1:UNL;:PHOT2:UNL")
    assert client.errors() == []


# --- exchanges -----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "shown", "numbers"),
    [
        ("BASE:BX 20", None, []),
        ("BASE:BX 20;BX?", "20.00", []),
        ("FOO?", None, [-113]),
        ("*OPC?;FOO?;:BASE:BX 999;*TST?", "1;0", [-113, -222]),
        ("SYST:VERS?", "1999.0", []),
        ("SYST:ERR:COUN?;:SYST:VERS?", "0;1999.0", []),
        ("SYST:VERS 5", None, [-113]),
        ("EYEP1:PICT? 8,4,1", "#block of 32 bytes", []),
        ('NOTE "open', None, [-102]),
        ("NOTE 'caf\xe9'", None, [-101]),
        (";;", None, []),
        ("BASE:BX?" + " " * 5000, None, [-363]),
    ],
)
def test_an_exchange_contains_the_reply_and_the_errors_of_a_line(client, line, shown, numbers):
    exchange = send_line(client, line)
    assert exchange.shown == shown
    assert [int(error.split(",")[0]) for error in exchange.errors] == numbers
    assert client.ask("*OPC?") == "1"


def test_a_line_without_an_answer_is_reported_in_one_sentence(pair):
    port, _ = pair
    with pytest.raises(A7SimError, match=r"\*OPC\?: expected an answer in time, got none"):
        send_line(Client(port), "*OPC?")


# --- completion ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("typed", "found"),
    [
        ("BASE:M", ["BASE:MODE", "BASE:MODE?"]),
        ("base:m", ["base:MODE", "base:MODE?"]),
        ("proj2:ka", ["proj2:KAPPa", "proj2:KAPPa?", "proj2:KAPPa:TURN"]),
        ("PROJ:KAP", ["PROJ:KAPPa", "PROJ:KAPPa?", "PROJ:KAPPa:TURN"]),
        ("PROJector1:OMEGa", ["PROJector1:OMEGa", "PROJector1:OMEGa?", "PROJector1:OMEGa:TURN"]),
        ("SYST:ERR:N", ["SYST:ERR:NEXT?"]),
        ("syst:ver", ["syst:VERSion?"]),
        (":SYST:VER", [":SYST:VERSion?"]),
        ("*ID", ["*IDN?"]),
        ("PHOT2:UN", ["PHOT2:UNLoad"]),
        ("PROJ1:KAPP 5;OM", ["OMEGa", "OMEGa?", "OMEGa:TURN"]),
        ("PROJ1:KAPP 5;*ESE 1;OM", ["OMEGa", "OMEGa?", "OMEGa:TURN"]),
        ("PROJ1:KAPP 5;:BASE:B", [":BASE:BX", ":BASE:BX?", ":BASE:BX:TURN"]),
        ("NOTE 'a;b';REC:CO", ["REC:COUNt?"]),
        ("PROJ3:KA", []),
        ("PRO1:KA", []),
        ("BASE1:B", []),
        ("BASE:BX 19", []),
        ("NOTE 'a;BASE:B", []),
        ("FOO", []),
    ],
)
def test_headers_are_completed_only_where_a_header_is_allowed(typed, found):
    assert completions(typed, list(EXAMPLES)) == found


def test_an_empty_line_is_completed_to_every_header():
    found = completions("", list(EXAMPLES))
    assert {"*IDN?", "PROJector1:KAPPa", "PROJector2:KAPPa?", "SYSTem:ERRor?", "SYSTem:ERRor:NEXT?"} <= set(found)
    assert len(found) == len(set(found)) > len(EXAMPLES)


def test_the_instrument_knows_every_completed_header(client):
    for header in completions("", list(EXAMPLES)):
        client.send(header)
    assert not [error for error in client.errors() if error.startswith("-113")]


def test_without_a_login_the_error_message_asks_for_a_token(instrument):
    guarded = SharedInstrument(instrument.autograph)
    guarded.token = "secret"
    with serve_on("tcp", guarded) as url:
        with Client.open(url, timeout=SHORT) as without_token, pytest.raises(A7SimError, match="asks for a token"):
            send_line(without_token, "BASE:BX?")
        with Client.open(url, timeout=SHORT, token="secret") as with_token:
            assert send_line(with_token, "BASE:BX?").shown == "0.00"
