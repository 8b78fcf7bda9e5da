"""The journal of a session: every line that crossed the link, in order, with its simulated time."""

from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

import msgspec

import a7sim
from a7sim.instrument.language import LinkEvent

SCHEMA_VERSION = 1


class Journal:
    """A file of JSON lines: a header, then an event a line, each whole on disk before the next.

    It counts from the beginning what it hears, and writes from when it is opened, as a context.
    """

    def __init__(self) -> None:
        self._file: TextIO | None = None
        self.events = 0

    def opened(self, path: Path | None, header: dict[str, Any]) -> "Journal":
        """Begin to write, where there is a path; nothing must have been heard before."""
        if path is not None:
            self._file = path.open("w", encoding="utf-8", buffering=1)
            self._write({"schema_version": SCHEMA_VERSION, "software": f"a7sim {a7sim.__version__}", **header})
        return self

    def heard(self, event: LinkEvent) -> None:
        """Write an event."""
        self.events += 1
        self._write({"t": round(event.time, 2), "client": event.client, "dir": event.direction, "text": event.text})

    def _write(self, line: dict[str, Any]) -> None:
        if self._file is not None:
            self._file.write(msgspec.json.encode(line).decode() + "\n")

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()
