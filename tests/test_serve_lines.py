"""Served serial lines (issue 5): pseudo-terminals, RFC 2217, paced lines, transmission errors on request."""

import os
import threading
import time
import tty
from pathlib import Path

import numpy as np
import pytest
import serial

import a7sim
from a7sim.errors import A7SimError
from a7sim.instrument import Autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.link.client.client import Client
from a7sim.link.server.client_session import ServerLimits
from a7sim.link.server.connections import MAX_UNREAD
from a7sim.link.server.faults import ConnectionDropped, FaultInjector, FaultRates, parse_faults
from a7sim.link.server.serving import Endpoints
from a7sim.plotters import VARIANTS
from tests.support.engine_client import with_model
from tests.support.server_thread import ANY_PORT, TIMEOUT_S, ServerThread

IDENTITY = f"WILD HEERBRUGG,A7,0,{a7sim.__version__}"


@pytest.fixture
def link(tmp_path):
    return tmp_path / "a7"


@pytest.fixture
def terminal(link):
    with ServerThread(endpoints=Endpoints(pty=[link])) as served:
        yield served


def at(served, timeout=TIMEOUT_S):
    return serial.serial_for_url(served.listening[0]["url"], timeout=timeout)


# --- pseudo-terminals ----------------------------------------------------------------------------------


def test_a_terminal_is_a_serial_port_in_raw_mode(terminal, link):
    assert str(link.readlink()) == terminal.listening[0]["device"]
    with at(terminal) as port:
        client = Client(port)
        assert client.ask("*IDN?") == IDENTITY
        port.write(b"*TST?\r*OPC?\r\n\x03\x04\x13*TST?\n*TST?\n")
        assert [port.readline() for _ in range(3)] == [b"0\n", b"1\n", b"0\n"]
        assert client.errors() == ['-101,"Invalid character;character number 3"']


def test_a_terminal_transmits_every_byte_of_a_block(link):
    model_session = with_model()
    expected = model_session.feed(b"EYEP1:PICT? 60,50,4\n").removesuffix(b"\n")[len(b"#43000") :]
    with ServerThread(model_session.instrument, endpoints=Endpoints(pty=[link])) as served, at(served) as port:
        assert Client(port).block("EYEP1:PICT? 60,50,4") == expected


def test_a_terminal_serves_several_clients_in_succession(terminal):
    for n in range(5):
        with at(terminal) as port:
            assert Client(port).ask(f"*ESE {n};*ESE?") == str(n)


def test_the_link_is_removed_with_the_server_and_an_old_one_is_replaced(link):
    near, far = os.openpty()
    link.symlink_to(os.ttyname(far))
    with ServerThread(endpoints=Endpoints(pty=[link])) as served:
        assert str(link.readlink()) == served.listening[0]["device"] != os.ttyname(far)
    assert not link.is_symlink()
    os.close(near), os.close(far)


@pytest.mark.parametrize("make", [lambda path: path.write_text("mine"), Path.mkdir, lambda path: path.symlink_to("x")])
def test_a_path_that_is_no_link_to_a_terminal_is_not_changed(link, make):
    make(link)
    with (
        pytest.raises(A7SimError, match="expected nothing there or an old link"),
        ServerThread(endpoints=Endpoints(pty=[link])),
    ):
        pass
    assert os.path.lexists(link)
    assert [path.name for path in link.parent.iterdir()] == ["a7"]


def test_a_link_with_a_new_target_is_not_removed(link):
    with ServerThread(endpoints=Endpoints(pty=[link])):
        link.unlink()
        link.symlink_to("/dev/pts/elsewhere")
    assert str(link.readlink()) == "/dev/pts/elsewhere"


def test_a_missing_folder_is_reported_and_every_other_endpoint_is_closed(tmp_path):
    first = tmp_path / "first"
    with (
        pytest.raises(A7SimError, match=r"nowhere/a7: expected a place where a link can be made"),
        ServerThread(endpoints=Endpoints(pty=[first, tmp_path / "nowhere" / "a7"])),
    ):
        pass
    assert not first.is_symlink()


def test_a_terminal_whose_client_does_not_read_is_reset(link):
    with ServerThread(
        limits=ServerLimits(write_timeout=0.2), endpoints=Endpoints(pty=[link], tcp=[ANY_PORT])
    ) as served:
        first = served.server._terminals[0]._session
        far = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(far)
        os.write(far, b"SYST:LOCK:REQ?\n" + b"SYST:HELP:HEAD?\n" * 100)
        assert served.until(lambda: served.server._terminals[0]._session is not first)
        other = served.line()
        assert other.ask("SYST:LOCK:REQ?") == "1"
        os.close(far)
        with serial.Serial(str(link), timeout=TIMEOUT_S) as port:
            assert Client(port).ask("*IDN?") == IDENTITY


def test_a_terminal_whose_client_reads_late_gets_every_reply_in_order(link):
    """Above the limit of the buffer no further line is read until the client has read; nothing is lost."""
    count = 3 * MAX_UNREAD // len(IDENTITY)
    with ServerThread(endpoints=Endpoints(pty=[link])) as served, at(served) as port:
        sender = threading.Thread(target=port.write, args=(b"*IDN?\n" * count,))
        sender.start()
        assert served.until(lambda: served.server._terminals[0]._write_blocked)
        assert port.read(count * (len(IDENTITY) + 1)) == f"{IDENTITY}\n".encode() * count
        sender.join()
        assert not served.server._terminals[0]._write_blocked


def test_an_idle_terminal_releases_its_lock_and_stays_open(link):
    with ServerThread(limits=ServerLimits(idle_timeout=0.2), endpoints=Endpoints(pty=[link])) as served:
        with at(served) as port:
            assert Client(port).ask("SYST:LOCK:REQ?") == "1"
        assert served.until(lambda: served.instrument.lock_holder is None)
        with at(served) as port:
            assert Client(port).ask("*TST?") == "0"
            assert port.in_waiting == 0


# --- RFC 2217 ------------------------------------------------------------------------------------------


def test_a_port_over_rfc_2217_transmits_every_byte_and_accepts_cr_as_line_end():
    model_session = with_model()
    expected = model_session.feed(b"EYEP1:PICT? 60,50,4\n").removesuffix(b"\n")[len(b"#43000") :]
    assert expected.count(b"\xff") > 0
    with ServerThread(model_session.instrument, endpoints=Endpoints(rfc2217=[ANY_PORT])) as served, at(served) as port:
        client = Client(port)
        assert client.block("EYEP1:PICT? 60,50,4") == expected
        port.write(b"*TST?\r")
        assert port.readline() == b"0\n"
        port.baudrate = 19200
        port.dtr = False
        assert (port.cts, port.dsr, port.cd, port.ri) == (True, True, True, False)
        port.write(b"NOTE '\xff'\n")
        assert client.errors() == ['-101,"Invalid character;character number 255"']


# --- paced lines -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["tcp", "pty"])
def test_a_paced_line_needs_ten_bits_a_byte_both_ways_and_delays_no_other_client(link, kind):
    baud, asked = 2400, 3
    endpoints = Endpoints(tcp=[ANY_PORT], pty=[link])
    with ServerThread(limits=ServerLimits(baud=baud), endpoints=endpoints) as served:
        url = served.listening[0]["url"] if kind == "tcp" else str(link)
        with serial.serial_for_url(url, timeout=TIMEOUT_S) as port:
            port.write(b"*IDN?\n")
            began = time.monotonic()
            other = threading.Thread(target=served.line().ask, args=("*TST?",))
            other.start()
            assert port.readline() == f"{IDENTITY}\n".encode()
            for _ in range(asked - 1):
                port.write(b"*IDN?\n")
                assert port.readline() == f"{IDENTITY}\n".encode()
            took = time.monotonic() - began
            other.join(TIMEOUT_S)
    wire = asked * 10 * (len(b"*IDN?\n") + len(IDENTITY) + 1) / baud
    assert wire * 0.95 <= took <= wire * 1.6 + 0.3


def test_a_paced_line_loses_no_reply():
    with ServerThread(limits=ServerLimits(baud=2_000_000)) as served:
        line = served.line()
        sender = threading.Thread(target=line.send, args=(b"COUN:X?\n" * 5000,))
        sender.start()
        assert all(line.read() == "0.00" for _ in range(5000))
        sender.join()


def test_a_paced_client_that_closes_its_sending_half_gets_all_replies():
    with ServerThread(limits=ServerLimits(baud=19200)) as served:
        line = served.line()
        line.send(b"*TST?\n" * 50)
        line.socket.shutdown(1)
        assert [line.read() for _ in range(51)] == ["0"] * 50 + [""]


# --- faults on request ---------------------------------------------------------------------------------


def faulty(spec, seed=1, baud=None):
    return ServerThread(
        SharedInstrument(Autograph(VARIANTS["A7"])),
        ServerLimits(faults=parse_faults(spec), fault_seed=seed, baud=baud, max_clients=200),
    )


def remaining_replies(seed, count=400):
    with faulty("drop-reply:0.25", seed) as served:
        line = served.line()
        for n in range(count):
            line.send(f"*ESE {n % 256};*ESE?\n".encode())
        line.socket.shutdown(1)
        received = []
        while reply := line.read():
            received.append(int(reply))
    return received


def test_replies_are_dropped_at_the_given_rate_and_a_seed_drops_the_same_ones():
    received = remaining_replies(seed=1)
    assert 0.65 < len(received) / 400 < 0.85
    assert received == remaining_replies(seed=1)
    assert received != remaining_replies(seed=2)


def test_replies_are_delayed_and_stay_in_order():
    with faulty("delay:80ms") as served:
        line = served.line()
        began = time.monotonic()
        line.send(b"*TST?\n*OPC?\nCOUN:X?\n")
        assert [line.read() for _ in range(3)] == ["0", "1", "0.00"]
        assert 0.08 <= time.monotonic() - began < 2.0


def test_bytes_are_garbled_at_the_given_rate_and_line_ends_are_not():
    reply = bytes(range(32, 127)) * 100 + b"\n"
    noise = FaultInjector(FaultRates(garble=0.02), np.random.default_rng(3))
    received = [noise.apply(reply) for _ in range(10)]
    wrong = sum(a != b for each in received for a, b in zip(each, reply, strict=True))
    assert 0.015 < wrong / (10 * len(reply)) < 0.025
    assert all(each[-1:] == b"\n" for each in received)


def test_a_disconnection_affects_only_its_client():
    with faulty("disconnect:0.2") as served:
        answered = []
        for _ in range(100):
            line = served.line()
            line.send(b"*TST?\n")
            answered.append(line.read() == "0")
        assert 0.65 < sum(answered) / 100 < 0.93
        assert served.until(lambda: served.server.clients == sum(answered))


def test_a_disconnection_gives_an_error_and_no_reply():
    with pytest.raises(ConnectionDropped):
        FaultInjector(FaultRates(disconnect=1.0), np.random.default_rng(0)).apply(b"0\n")


def test_faults_are_parsed():
    assert parse_faults("drop-reply:0.01,delay:50ms,garble:0.001,disconnect:0.0005") == FaultRates(
        0.01, 0.001, 0.0005, 0.05
    )
    assert parse_faults("delay:1.5s") == FaultRates(delay=1.5)


@pytest.mark.parametrize(
    ("spec", "sentence"),
    [
        ("", "expected drop-reply, delay, garble or disconnect"),
        ("lose:0.1", "expected drop-reply, delay, garble or disconnect"),
        ("garble:2", "garble: expected a probability from 0 to 1, got '2'"),
        ("garble:nan", "expected a probability from 0 to 1"),
        ("drop-reply", "expected a probability from 0 to 1, got ''"),
        ("delay:50", "expected up to 60s, such as 50ms or 1.5s, got '50'"),
        ("delay:2000s", "expected up to 60s"),
        ("garble:0.1,garble:0.2", "expected garble once"),
    ],
)
def test_the_error_message_for_wrong_faults_names_the_expected_form(spec, sentence):
    with pytest.raises(A7SimError, match=sentence.replace("(", r"\(")):
        parse_faults(spec)
