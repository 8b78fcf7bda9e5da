"""The recording proxy between clients and an instrument: `a7sim record`, in this process."""

import socket
import struct
import threading
from contextlib import contextmanager

from a7sim.errors import A7SimError
from a7sim.link.client import recording_proxy
from a7sim.link.client.recording_proxy import POLL_INTERVAL_S, RecordingProxy
from a7sim.link.clock import WallClock
from tests.support.server_thread import TIMEOUT_S

AT_ONCE = struct.pack("ii", 1, 0)
"""Of SO_LINGER: a connection that is closed is reset."""


class Recorder:
    """A recording proxy that serves a socket in a thread, with its events and the error that ended it."""

    def __init__(self, listener):
        self.port = listener.getsockname()[1]
        self.heard = []
        self.error = None
        self.stop = threading.Event()
        self._is_there = threading.Condition()
        proxy = RecordingProxy("a7sim://akwanga", self._listen, WallClock(), self.stop)
        self.thread = threading.Thread(target=self._serve, args=(proxy, listener))
        self.thread.start()

    def _serve(self, proxy, listener):
        try:
            proxy.serve(listener)
        except A7SimError as error:
            self.error = str(error)

    def _listen(self, event):
        with self._is_there:
            self.heard.append((event.direction, event.text))
            self._is_there.notify_all()

    def until(self, direction, text):
        """Wait until the proxy records an event."""
        with self._is_there:
            assert self._is_there.wait_for(lambda: (direction, text) in self.heard, TIMEOUT_S), self.heard

    def client(self):
        return socket.create_connection(("127.0.0.1", self.port), timeout=TIMEOUT_S)


@contextmanager
def recording():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        recorder = Recorder(listener)
        try:
            yield recorder
        finally:
            recorder.stop.set()
            recorder.thread.join(TIMEOUT_S)
            assert not recorder.thread.is_alive()


def test_empty_input_is_passed_and_not_recorded_and_long_lines_are_not_stored():
    """A line without an end is passed in pieces, so that memory does not grow, and is recorded as one line."""
    with recording() as recorder, recorder.client() as client:
        client.sendall(b"\n \r\n*OPC?\n" + b"x" * 5000)
        recorder.until("<", "1")
        client.sendall(b"x\nSYST:ERR:NEXT?\n")
        recorder.until("<", '-363,"Input buffer overrun;expected at most 4096 bytes a line"')
    assert [each for each in recorder.heard if each[0] in ">!"] == [
        (">", "*OPC?"),
        ("!", "(a line of more than 4096 bytes)"),
        (">", "SYST:ERR:NEXT?"),
    ]
    assert recorder.error is None


def test_a_reset_client_is_recorded_as_gone_and_the_next_is_accepted():
    with recording() as recorder:
        with recorder.client() as client:
            recorder.until("+", "")
            client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, AT_ONCE)
        recorder.until("-", "")
        with recorder.client() as client:
            client.sendall(b"*OPC?\n")
            recorder.until("<", "1")
    assert recorder.error is None


class Broken:
    """A line to an instrument that breaks as soon as something is asked."""

    in_waiting = 0

    def __init__(self):
        self.asked = threading.Event()

    def write(self, data):
        self.asked.set()

    def read(self, size):
        if self.asked.wait(POLL_INTERVAL_S):
            raise OSError(5, "Input/output error")
        return b""

    def close(self):
        pass


def test_a_broken_line_to_the_instrument_ends_the_proxy_with_one_sentence(monkeypatch):
    monkeypatch.setattr(recording_proxy, "open_port", lambda *_: Broken())
    with recording() as recorder, recorder.client() as client:
        client.sendall(b"*OPC?\n")
        recorder.thread.join(TIMEOUT_S)
        assert recorder.error == "a7sim://akwanga: the line to the instrument broke"


def test_the_proxy_stops_while_a_client_is_connected():
    with recording() as recorder, recorder.client() as client:
        client.sendall(b"*OPC?\n")
        recorder.until("<", "1")
        recorder.stop.set()
        recorder.thread.join(TIMEOUT_S)
        assert recorder.heard[-1] == ("-", "")
