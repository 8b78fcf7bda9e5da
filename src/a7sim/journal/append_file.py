"""Append-only file of whole lines with controlled flushing to disk."""

import fcntl
import os
import threading
from contextlib import suppress
from pathlib import Path
from typing import Literal, get_args

from a7sim.errors import A7SimError

Durability = Literal["always", "records", "none"]
"""Time of flushing a line to disk: always, for registrations only, or when the operating system does it."""

DURABILITIES: tuple[Durability, ...] = get_args(Durability)

SYNCED_WITHIN_S = 0.2
"""Wall-clock s within which all lines are on disk, except for 'none'."""

_flush = getattr(os, "fdatasync", os.fsync)


class JournalWriteError(A7SimError):
    """Journal that can no longer be written while its session runs."""


class AppendOnlyFile:
    """File of lines. When `add` returns, the operating system has the line: no end of this process loses it."""

    def __init__(self, path: Path, durability: Durability = "records", size: int = 0) -> None:
        """Open a file, new or to continue behind its first `size` bytes. Raises A7SimError if it cannot be written."""
        self._path = path
        self._durability = durability
        self._size = size
        self._error: JournalWriteError | None = None
        self._pending = threading.Event()
        self._closing = threading.Event()
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_CLOEXEC, 0o666)
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            os.ftruncate(self._file, size)
            _sync_folder(path.parent)
        except BlockingIOError as error:
            raise A7SimError(f"{path}: expected a session that is over, got one that is being written") from error
        except OSError as error:
            raise A7SimError(f"{path}: expected a journal that can be written: {error.strerror}") from error
        self._syncing = threading.Thread(target=self._sync_periodically, name="journal", daemon=True)
        if durability == "records":
            self._syncing.start()

    def add(self, line: bytes, at_once: bool = False) -> None:
        """Add a line, with its end; `at_once` flushes it to disk before this returns.

        Raises JournalWriteError if that fails: then the line is not in the file, and no other can be added.
        """
        if self._error is not None:
            raise self._error
        try:
            written = os.write(self._file, line)
            while written < len(line):
                written += os.write(self._file, line[written:])
            self._size += written
            if self._durability == "always" or (at_once and self._durability == "records"):
                _flush(self._file)
            elif not self._pending.is_set():
                self._pending.set()
        except OSError as error:
            raise self._fail(error) from error

    def close(self) -> None:
        """Flush everything to disk and close the file."""
        self._closing.set()
        self._pending.set()
        if self._syncing.is_alive():
            self._syncing.join()
        if self._durability != "none" and self._error is None:
            self._sync()
        os.close(self._file)
        if self._error is not None:
            raise self._error

    def _sync_periodically(self) -> None:
        while not self._closing.is_set():
            self._pending.wait()
            self._closing.wait(SYNCED_WITHIN_S / 2.0)
            self._pending.clear()
            self._sync()

    def _sync(self) -> None:
        try:
            _flush(self._file)
        except OSError as error:
            self._fail(error)

    def _fail(self, error: OSError) -> JournalWriteError:
        self._error = write_failure_message(self._path, error)
        with suppress(OSError):
            os.ftruncate(self._file, self._size)
        return self._error


def is_being_written(path: Path) -> bool:
    """Return whether a process is writing a file of lines."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    except OSError:
        return False
    try:
        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(file)
    return False


def write_failure_message(path: Path, error: OSError) -> JournalWriteError:
    """Return the error for a file of a journal that can no longer be written."""
    return JournalWriteError(f"{path}: it can no longer be written, so the session stops here: {error.strerror}")


def _sync_folder(folder: Path) -> None:
    """Flush the name of a new file to disk."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
