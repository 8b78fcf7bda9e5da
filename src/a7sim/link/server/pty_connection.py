"""Pseudo-terminal transport: a serial port of this machine under a chosen name."""

import asyncio
import fcntl
import os
import termios
import tty
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.link.server.client_session import ClientSession
from a7sim.link.server.connections import MAX_UNREAD, Host
from a7sim.link.server.cpu_yield import YieldPolicy

POLLS_BEFORE_SLEEP = 8
"""Number of polls after a reply before the transport sleeps: a client usually asks again at once."""

MAX_READ = 4096
"""Bytes in the buffer of a terminal of Linux."""

PTY_DIRECTORY = "/dev/pts/"
"""Directory of the targets of links that may be replaced."""


class PtyConnection:
    """Instrument's end of a pseudo-terminal, and the link to the other end.

    It keeps the other end open, so that clients may come and go. Like a cable of three wires it cannot distinguish
    clients; a dropped client leaves an empty line, on which a new session starts.
    """

    def __init__(self, host: Host, link: Path) -> None:
        """Create the terminal and the link. Raises A7SimError if another file has the link's path."""
        self._host = host
        self._link = link
        self._unsent = bytearray()
        self._write_blocked = False
        self._reading = False
        self._yield_policy = YieldPolicy()
        self._loop = asyncio.get_running_loop()
        self._near, self._far = os.openpty()
        tty.setraw(self._far)
        os.set_blocking(self._near, False)
        self.device = os.ttyname(self._far)
        try:
            fcntl.lockf(self._far, fcntl.LOCK_EX | fcntl.LOCK_NB)
            _make_link(link, self.device)
        except BaseException:
            self._close_ends()
            raise
        self._session = self._start_session()
        self.resume_reading()

    def _start_session(self) -> ClientSession:
        accepted = self._host.accept(self, serial=True)
        if isinstance(accepted, bytes):
            raise A7SimError(
                f"--pty: expected fewer lines than clients are allowed: {accepted.decode('ascii').strip()}"
            )
        return accepted

    def remove(self) -> None:
        """Remove link and terminal."""
        self._session.connection_lost()
        self.pause_reading()
        self._loop.remove_writer(self._near)
        if self._link.is_symlink() and str(self._link.readlink()) == self.device:
            self._link.unlink()
        self._close_ends()

    def _close_ends(self) -> None:
        os.close(self._near)
        os.close(self._far)

    def _readable(self) -> None:
        near, received = self._near, self._session.data_received
        for _ in range(POLLS_BEFORE_SLEEP):
            try:
                data = os.read(near, MAX_READ)
            except (BlockingIOError, InterruptedError):
                if not self._yield_policy.yield_cpu():
                    return
            else:
                received(data)
                if not self._reading:
                    return

    def _writable(self) -> None:
        self._unsent = self._unsent[self._send(self._unsent) :]
        if not self._unsent:
            self._loop.remove_writer(self._near)
        if self._write_blocked and len(self._unsent) <= MAX_UNREAD // 4:
            self._write_blocked = False
            self._session.resume_writing()

    def _send(self, data: bytes | bytearray) -> int:
        try:
            return os.write(self._near, data)
        except (BlockingIOError, InterruptedError):
            return 0

    # --- requests of the session ----------------------------------------------------------------------

    def write(self, data: bytes) -> None:
        """Send bytes, now or as soon as possible."""
        if not self._unsent:
            sent = self._send(data)
            if sent == len(data):
                return
            data = data[sent:]
            self._loop.add_writer(self._near, self._writable)
        self._unsent += data
        if not self._write_blocked and len(self._unsent) > MAX_UNREAD:
            self._write_blocked = True
            self._session.pause_writing()

    def pause_reading(self) -> None:
        """Stop receiving."""
        self._reading = False
        self._loop.remove_reader(self._near)

    def resume_reading(self) -> None:
        """Continue receiving."""
        if not self._reading:
            self._reading = True
            self._loop.add_reader(self._near, self._readable)

    def close(self, farewell: bytes = b"") -> None:
        """Start a new session; no client can receive a farewell."""
        self.abort()

    def abort(self) -> None:
        """Discard the client and all bytes on the line, and start a new session."""
        self._session.connection_lost()
        self._host.release(self)
        self._loop.remove_writer(self._near)
        self._unsent.clear()
        self._write_blocked = False
        termios.tcflush(self._far, termios.TCIOFLUSH)
        self._session = self._start_session()
        self.resume_reading()


def _make_link(link: Path, device: str) -> None:
    temporary = link.with_name(f".{link.name}.{os.getpid()}")
    try:
        if os.path.lexists(link) and not (link.is_symlink() and str(link.readlink()).startswith(PTY_DIRECTORY)):
            raise A7SimError(f"--pty {link}: expected nothing there or an old link to a terminal, got something else")
        if _is_served(link):
            raise A7SimError(
                f"--pty {link}: expected a path of its own, got that of another instrument, which is served"
            )
        temporary.unlink(missing_ok=True)
        temporary.symlink_to(device)
        temporary.replace(link)
    except OSError as error:
        temporary.unlink(missing_ok=True)
        raise A7SimError(f"--pty {link}: expected a place where a link can be made: {error.strerror}") from error


def _is_served(link: Path) -> bool:
    """Return whether a server holds the lock of its terminal; `flock` is left to clients."""
    try:
        terminal = os.open(link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        fcntl.lockf(terminal, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return True
    finally:
        os.close(terminal)
    return False
