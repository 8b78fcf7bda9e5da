"""Proxy between a client and an instrument that reports each line and reply to a listener before it is passed on."""

import socket
import threading
from collections.abc import Callable
from typing import Any

from a7sim.errors import A7SimError
from a7sim.instrument.language import MAX_LINE_LENGTH, LinkEvent, Listener, loggable_reply, redact_token
from a7sim.link.client.ports import open_port, port_errors
from a7sim.link.client.replies import MalformedReplyError, Part, parse_reply
from a7sim.link.clock import WallClock

POLL_INTERVAL_S = 0.1
"""Interval in s at which a waiting thread checks whether to stop."""

_MAX_READ = 65536


class RecordingProxy:
    """Endpoint in front of an instrument, for one client at a time.

    An exception of the listener ends it: no line or reply is passed on that was not recorded.
    """

    def __init__(self, url: str, listener: Listener, clock: WallClock, stop: threading.Event) -> None:
        self._url = url
        self._listener = listener
        self._clock = clock
        self._stop = stop
        self._lock = threading.Lock()
        self._clients = 0
        self._error: A7SimError | None = None

    def serve(self, server_socket: socket.socket) -> None:
        """Serve clients until stopped. Raises A7SimError if the instrument or the listener fails."""
        server_socket.settimeout(POLL_INTERVAL_S)
        while not self._stop.is_set():
            try:
                client, _ = server_socket.accept()
            except TimeoutError:
                continue
            with client:
                self._serve_client(client)
            if self._error is not None:
                raise self._error

    def _serve_client(self, client: socket.socket) -> None:
        self._clients += 1
        name = f"client{self._clients}"
        client.settimeout(POLL_INTERVAL_S)
        gone = threading.Event()
        with port_errors(self._url):
            port = open_port(self._url, POLL_INTERVAL_S)
            try:
                self._report(name, "+", "")
                replies = threading.Thread(
                    target=self._run_until_gone, args=(gone, self._replies, port, client, name, gone), daemon=True
                )
                replies.start()
                self._run_until_gone(gone, self._lines, client, port, name, gone)
                replies.join()
                self._report(name, "-", "")
            finally:
                gone.set()
                port.close()

    def _run_until_gone(self, gone: threading.Event, carry: Callable[..., None], *between: Any) -> None:
        try:
            carry(*between)
        except A7SimError as error:
            self._error = error
        except OSError:
            if not gone.is_set() and carry == self._replies:
                self._error = A7SimError(f"{self._url}: the line to the instrument broke")
        finally:
            gone.set()

    def _lines(self, client: socket.socket, port: Any, name: str, gone: threading.Event) -> None:
        come, too_long = b"", False
        while not gone.is_set() and not self._stop.is_set():
            try:
                more = client.recv(_MAX_READ)
            except TimeoutError:
                continue
            if not more:
                return
            *lines, come = (come + more).split(b"\n")
            for line in lines:
                if too_long or len(line.removesuffix(b"\r")) > MAX_LINE_LENGTH:
                    self._report(name, "!", f"(a line of more than {MAX_LINE_LENGTH} bytes)")
                elif line.strip(b" \t\r"):
                    self._report(name, ">", redact_token(line.removesuffix(b"\r").decode("latin-1"), None))
                port.write(line + b"\n")
                too_long = False
            if len(come) > MAX_LINE_LENGTH + 1:
                port.write(come)
                come, too_long = b"", True

    def _replies(self, port: Any, client: socket.socket, name: str, gone: threading.Event) -> None:
        come = bytearray()
        while True:
            more = port.read(max(1, port.in_waiting))
            come += more
            while (taken := _first_reply(come)) is not None:
                text, length = taken
                self._report(name, "<", text)
                try:
                    client.sendall(bytes(come[:length]))
                except OSError:  # the client is gone; the line to the instrument is not broken
                    return
                del come[:length]
            if not more and (gone.is_set() or self._stop.is_set()):
                return

    def _report(self, client: str, direction: str, text: str) -> None:
        with self._lock:
            self._listener(LinkEvent(self._clock.now, client, direction, text))


def _first_reply(come: bytearray) -> tuple[str, int] | None:
    """Return the text of the first complete reply and its length in bytes."""
    try:
        taken = parse_reply(come)
    except MalformedReplyError:
        end = come.find(b"\n") + 1
        return (come[: end - 1].decode("latin-1"), end) if end else None
    return None if taken is None else (";".join(map(_recorded_text, taken.parts)), taken.length)


def _recorded_text(part: Part) -> str:
    if isinstance(part, str):
        return part
    length = str(len(part))
    return loggable_reply(f"#{len(length)}{length}".encode("ascii") + part)
