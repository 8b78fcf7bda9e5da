"""The instrument served over TCP: each of many clients has its own limits and none delays another (issue 5)."""

import selectors
import socket
import threading
import time
from pathlib import Path
from statistics import median

import pytest

import a7sim
from a7sim.instrument import Autograph
from a7sim.instrument.language import MAX_LINE_LENGTH, MAX_REPLY, SharedInstrument
from a7sim.instrument.language.status import QUEUE_LENGTH
from a7sim.instrument.language.syntax import MAX_NUMBER_LENGTH
from a7sim.link.server.client_session import ServerLimits
from a7sim.link.server.connections import MAX_READ, MAX_UNREAD, QUICK_ACKNOWLEDGEMENT
from a7sim.link.server.serving import MAX_REJECTION_NOTICES, Endpoints
from a7sim.plotters import VARIANTS
from tests.support.server_thread import ANY_PORT, TIMEOUT_S, ServerThread, SocketClient

IDENTITY = f"WILD HEERBRUGG,A7,0,{a7sim.__version__}"


@pytest.fixture
def served():
    with ServerThread() as opened:
        yield opened


# --- many clients, one instrument ----------------------------------------------------------------------


def test_clients_share_the_instrument_and_each_has_its_own_errors(served):
    first, second = served.line(), served.line()
    assert first.ask("DRIV:X 12.5;:FOO;*OPC?") == "1"
    assert second.ask("COUN:X?;:SYST:ERR:COUN?") == "12.50;0"
    assert first.ask("SYST:ERR:COUN?") == "1"


def test_only_the_lock_holder_moves_elements_and_its_disconnection_releases_the_lock(served):
    holder, other = served.line(), served.line()
    assert (holder.ask("SYST:LOCK:REQ?"), other.ask("SYST:LOCK:REQ?")) == ("1", "0")
    assert other.ask("DRIV:X 5;:COUN:X?;:SYST:ERR?").startswith("0.00;-203,")
    holder.close()
    assert served.until(lambda: served.server.clients == 1)
    assert other.ask("DRIV:X 5;:COUN:X?;:SYST:LOCK:REQ?") == "5.00;1"


def test_a_client_that_closes_its_sending_half_is_answered_and_disconnected(served):
    line = served.line()
    line.send(b"DRIV:X 7\n" + b"COUN:X?\n" * 2000)
    line.socket.shutdown(socket.SHUT_WR)
    assert [line.read() for _ in range(2000)] == ["7.00"] * 2000
    assert line.read() == ""


@pytest.mark.parametrize(
    ("sent", "replies"),
    [
        (b"COUN:X?\nCOUN:Y?\n", ["0.00", "0.00"]),
        (b"*TST?\r\n\r\n*OPC?\r\n", ["0", "1"]),
        (b"\n\n;;\n *TST? \n", ["0"]),
        (b"*TST?\rCOUN:X?\nSYST:ERR?\n", ['-101,"Invalid character;character number 13"']),
        (b"NOTE 'a\x00b'\nSYST:ERR?\n", ['-101,"Invalid character;character number 0"']),
        (b"\x00\x00*TST?\nSYST:ERR:COUN?\n", ["1"]),
        ("NOTE 'φ″'\nSYST:ERR:COUN?\n".encode(), ["1"]),
        (bytes(range(256)).replace(b"\n", b"") + b"\nSYST:ERR:COUN?\n", ["1"]),
        (b"\xff\xfb\x2c\xff\xfa\nSYST:ERR:COUN?\n", ["1"]),
    ],
)
def test_replies_do_not_depend_on_how_bytes_are_split(served, sent, replies):
    for size in (1, 3, len(sent)):
        line = served.line()
        for start in range(0, len(sent), size):
            line.send(sent[start : start + size])
        assert [line.read() for _ in replies] == replies
        assert line.ask("*IDN?") == IDENTITY


@pytest.mark.skipif(QUICK_ACKNOWLEDGEMENT is None, reason="an option of Linux")
@pytest.mark.parametrize("kind", ["tcp", "rfc2217"])
def test_a_client_with_nagles_algorithm_waits_for_no_delayed_acknowledgement(kind):
    """A command has no reply that carries the acknowledgement, and the client holds its next line until then."""
    with ServerThread(endpoints=Endpoints(**{kind: [ANY_PORT]})) as served:
        line = served.line()
        if kind == "rfc2217":
            line.socket.recv(64)
        line.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 0)
        began = time.monotonic()
        for _ in range(100):
            line.send(b"*CLS\n")
            assert line.ask("*TST?") == "0"
        assert time.monotonic() - began < 100 * 0.02


# --- movement ------------------------------------------------------------------------------------------


def test_without_real_time_waiting_takes_simulated_time_only(served):
    line = served.line()
    began = time.monotonic()
    assert line.ask("BASE:BX 200;*OPC?;BX 0;*OPC?;*WAI;BX?") == "1;1;0.00"
    assert time.monotonic() - began < 5.0
    assert served.clock.now == 200.0


def test_waiting_by_polling_the_status_ends(served):
    line = served.line()
    line.send(b"*CLS;DRIV:X 10;*OPC\n")
    looks = 1
    while line.ask("*ESR?") != "1":
        looks += 1
    assert 10 <= looks <= 12


def test_in_real_time_a_waiting_client_does_not_block_the_others():
    with ServerThread(realtime=True) as served:
        waiting, other = served.line(), served.line()
        began = time.monotonic()
        waiting.send(b"DRIV:X 4;:STAT:OPER:COND?\n")
        assert waiting.read() == "2"
        waiting.send(b"*OPC?\nCOUN:X?;:STAT:OPER:COND?\n")
        asked = 0
        while time.monotonic() - began < 0.3:
            assert other.ask("COUN:X?") == "4.00"
            asked += 1
        assert asked > 10
        assert (waiting.read(), waiting.read()) == ("1", "4.00;0")
        assert 0.4 <= time.monotonic() - began < 3.0


def test_the_server_answers_after_a_waiting_client_disconnects():
    with ServerThread(realtime=True) as served:
        waiting = served.line()
        waiting.send(b"SYST:LOCK:REQ?;:DRIV:X 200;*OPC?\n" + b"COUN:X?\n" * 10000)
        assert served.until(lambda: served.instrument.lock_holder is not None)
        waiting.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        waiting.close()
        assert served.line().ask("COUN:X?") == "200.00"


# --- login ---------------------------------------------------------------------------------------------


@pytest.fixture
def guarded():
    with ServerThread(SharedInstrument(Autograph(VARIANTS["A7"]), token="sesame 8x")) as opened:
        yield opened


@pytest.mark.parametrize("line", ["COUN:X?", "*OPC?", "SYST:ERR?", "SYST:LOCK:REQ?", "FOO?", "SYST:HELP:HEAD?"])
def test_before_the_login_only_the_identity_is_answered(guarded, line):
    client = guarded.line()
    client.send(line.encode() + b";*CLS;DRIV:X 5;:RST\n")
    assert client.ask("*IDN?") == IDENTITY
    assert guarded.instrument.autograph.counter("X") == 0.0
    assert guarded.instrument.lock_holder is None


def test_after_the_login_the_earlier_errors_are_in_the_queue(guarded):
    client = guarded.line()
    client.send(b'COUN:X?\nSYST:LOG "sesame 8"\n:FOO\n')
    client.send('SYST:LOG "sesame 8x"\n'.encode("latin-1"))
    assert client.ask("SYST:ERR:COUN?") == "3"
    assert client.ask("SYST:ERR?;:SYST:ERR?") == (
        '-203,"Command protected;expected SYSTem:LOGin first";-203,"Command protected;this is not the token"'
    )


def test_the_journal_contains_no_token_right_or_wrong():
    heard = []
    with ServerThread(SharedInstrument(Autograph(VARIANTS["A7"]), heard.append, token="sesame")) as guarded:
        client = guarded.line()
        client.send(b'SYST:LOG "sesam"\nsyst:version?;login  "sesame"\nSYST:LOGIN "sesame"\n')
        assert client.ask("COUN:X?;:SYST:ERR:COUN?") == "0.00;2"
    assert [event.text for event in heard if event.direction == ">"] == [
        'SYST:LOG "(not the token)"',
        'syst:version?;login  "(the token)"',
        'SYST:LOGIN "(the token)"',
        "COUN:X?;:SYST:ERR:COUN?",
    ]


# --- limits --------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("line", "number"),
    [
        ("NOTE '" + "x" * MAX_LINE_LENGTH + "'", -363),
        ("DRIV:X " + "0" * MAX_NUMBER_LENGTH + "1", -104),
        ("DRIV:X " + "1" * 4000 + "!", -104),
        ("DRIV:X 1E99999", -222),
        ("PROJ3:KAPP?", -114),
        ("PROJ0:KAPP?", -114),
        ("PROJ999999999:KAPP?", -114),
        ("PROJ" + "1" * 4000 + ":KAPP?", -113),
        (":".join(["SYST"] * 800) + "?", -113),
        ("DRIV:X " + "(" * 4000, -104),
        ("DRIV:X " + "(" * 2000 + "1" + ")" * 2000, -104),
        ("NOTE " + '"' * 4001, -102),
        ("DRIV:X " + "," * 4000, -102),
        ("NOTE 'open", -102),
        ("EYEP:PICT? 1025,1,1", -222),
    ],
)
def test_every_limit_of_a_line_gives_its_error_at_once_and_the_next_line_is_executed(served, line, number):
    client = served.line()
    began = time.monotonic()
    assert client.ask(f"{line}\n*CLS?\nSYST:ERR?").split(",")[0] == str(number)
    assert time.monotonic() - began < 2.0
    assert client.ask("*IDN?") == IDENTITY


def test_overflow_replaces_the_last_entry_of_the_error_queue(served):
    client = served.line()
    client.send(b"FOO\n" * 1000)
    assert client.ask("SYST:ERR:COUN?") == str(QUEUE_LENGTH)
    assert [client.ask("SYST:ERR?").split(",")[0] for _ in range(QUEUE_LENGTH)] == ["-113"] * 31 + ["-350"]


def test_the_replies_to_a_line_are_bounded(served):
    line = ";".join(["PICT? 1024,1024,1"] * 4)
    client = served.line()
    client.send(f"EYEP:{line}\n".encode())
    size = len("#71048576") + 1024 * 1024
    expected = 3 * size + 2 + 1
    assert expected < MAX_REPLY < 4 * size
    while expected:
        expected -= len(client.socket.recv(min(65536, expected)))
    assert client.ask("SYST:ERR?;*ESR?").startswith('-430,"Query DEADLOCKED;')


def test_a_client_above_the_limit_is_disconnected_without_effect_on_the_others():
    with ServerThread(limits=ServerLimits(max_clients=3)) as served:
        lines = [served.line() for _ in range(3)]
        assert [line.ask("*TST?") for line in lines] == ["0"] * 3
        for _ in range(2 * MAX_REJECTION_NOTICES):
            served.line()
        assert [line.ask("*TST?") for line in lines] == ["0"] * 3
        lines[0].close()
        assert served.until(lambda: served.server.clients == 2)
        assert served.line().ask("*TST?") == "0"


def test_the_error_message_for_a_client_above_the_limit_names_the_limit():
    with ServerThread(limits=ServerLimits(max_clients=1)) as served:
        assert served.line().ask("*TST?") == "0"
        late = served.line()
        assert late.ask("*IDN?") == '-200,"Execution error;expected at most 1 client at a time"'
        assert late.wait_closed()


def test_the_default_limit_is_64_clients(served):
    lines = [served.line() for _ in range(65)]
    assert [line.ask("*TST?") for line in lines[:64]] == ["0"] * 64
    assert lines[64].read().startswith("-200,")


def test_only_the_client_that_does_not_read_is_disconnected_and_its_buffer_is_bounded():
    with ServerThread(limits=ServerLimits(write_timeout=0.5)) as served:
        other = served.line()
        assert other.ask("*TST?") == "0"
        slow = served.line()
        slow.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        slow.socket.setblocking(False)
        flood = b"SYST:HELP:HEAD?\n" * 10_000
        kept = [(0, 0)]
        gone = False
        until = time.monotonic() + TIMEOUT_S
        while not gone:
            assert time.monotonic() < until
            try:
                slow.socket.send(flood)
            except BlockingIOError:
                kept += served.call(lambda: [_buffer_sizes(wire) for wire in served.server._wires])
                assert other.ask("COUN:X?") == "0.00"
                gone = served.call(lambda: served.server.clients) == 1
            except ConnectionError:
                gone = True
        assert other.ask("*IDN?") == IDENTITY
        unread, unprocessed = map(max, zip(*kept, strict=True))
        assert MAX_UNREAD < unread < 2 * MAX_UNREAD
        assert unprocessed <= MAX_READ


def _buffer_sizes(wire):
    return wire._transport.get_write_buffer_size(), len(wire._session._backlog)


def test_a_client_that_reads_late_gets_every_reply_in_order(served):
    count = 20 * MAX_UNREAD // len(IDENTITY)
    line = served.line()
    sender = threading.Thread(target=line.send, args=(b"*IDN?\n" * count,))
    sender.start()
    time.sleep(0.2)
    assert all(line.read() == IDENTITY for _ in range(count))
    sender.join()


def test_a_silent_client_is_disconnected_with_an_error_and_an_active_one_is_not():
    with ServerThread(limits=ServerLimits(idle_timeout=0.4)) as served:
        silent, speaking = served.line(), served.line()
        assert silent.ask("SYST:LOCK:REQ?") == "1"
        until = time.monotonic() + 0.8
        while time.monotonic() < until:
            assert speaking.ask("*TST?") == "0"
            time.sleep(0.02)
        assert silent.read() == '-365,"Time out error;expected something to do within 0.4 s"'
        assert silent.read() == ""
        assert speaking.ask("SYST:LOCK:REQ?") == "1"


@pytest.mark.slow
def test_ten_thousand_closed_connections_leave_no_open_descriptor(served):
    steady = served.line()
    assert steady.ask("*TST?") == "0"
    descriptors = Path("/proc/self/fd")
    before = len(list(descriptors.iterdir()))
    for i in range(10_000):
        line = SocketClient(served.port)
        if i % 4 == 0:
            line.send(b"SYST:LOCK:REQ?\n*OP")
        if i % 10:
            line.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        line.close()
    assert served.until(lambda: served.server.clients == 1)
    assert served.until(lambda: len(list(descriptors.iterdir())) <= before)
    assert steady.ask("SYST:LOCK:REQ?") == "1"


# --- fairness ------------------------------------------------------------------------------------------


def test_a_burst_of_one_client_does_not_delay_another(served):
    bursting, other = served.line(), served.line()
    burst = (b"*RST;" * 100 + b":COUN:X?\n") * 150
    stop = threading.Event()

    def drain():
        left = 150
        while left:
            left -= bursting.socket.recv(1 << 20).count(b"\n")
        stop.set()

    threading.Thread(target=drain, daemon=True).start()
    threading.Thread(target=bursting.send, args=(burst,), daemon=True).start()
    took = []
    while not stop.is_set():
        began = time.monotonic()
        assert other.ask("*TST?") == "0"
        took.append(time.monotonic() - began)
    assert len(took) > 20
    assert median(took) < 0.1


def test_a_hundred_polling_clients_get_similar_shares():
    with ServerThread(limits=ServerLimits(max_clients=100)) as served:
        lines = [served.line() for _ in range(100)]
        for n, line in enumerate(lines):
            assert line.ask(f"*ESE {n};*ESE?") == str(n)
        for line in lines:
            line.socket.setblocking(False)
        counts = _polled(lines, seconds=2.0)
    assert min(counts) >= 0.2 * median(counts) > 1


def _polled(lines, seconds):
    """Send the next query of each client after its reply; return the number of replies of each."""
    waiting = selectors.DefaultSelector()
    counts = [0] * len(lines)
    for n, line in enumerate(lines):
        waiting.register(line.socket, selectors.EVENT_READ, n)
        line.send(b"*ESE?\n")
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        for key, _ in waiting.select(1.0):
            assert key.fileobj.recv(4096) == f"{key.data}\n".encode()
            counts[key.data] += 1
            key.fileobj.send(b"*ESE?\n")
    return counts
