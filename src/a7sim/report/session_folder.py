"""Folder of a finished session."""

import csv
import io
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import msgspec

from a7sim.errors import A7SimError
from a7sim.journal.session_files import BOOK, JOURNAL, RESULTS
from a7sim.operator.people.observation_book import COLUMNS, BookEntry
from a7sim.result_documents import SCHEMA_VERSION, Document
from a7sim.table_files import read_text

COMMANDS = ("run", "calibrate", "compile", "bridge")
"""Commands whose results a session's folder contains."""


@dataclass(frozen=True)
class SessionFolder:
    """Folder and its results."""

    folder: Path
    document: Document

    @property
    def command(self) -> str:
        """Command that wrote the folder: one of COMMANDS."""
        return str(self.document["command"])

    def text(self, name: str) -> str:
        """Return the text of a file of the folder, '' if there is none. Raises A7SimError if it cannot be read."""
        path = self.folder / name
        return read_text(path) if path.is_file() else ""

    def rows(self, name: str) -> list[dict[str, str]]:
        """Return the rows of a CSV file of the folder, empty if there is none."""
        lines = [line for line in self.text(name).splitlines(keepends=True) if not line.startswith("#")]
        return list(csv.DictReader(io.StringIO("".join(lines))))

    @cached_property
    def book(self) -> list[BookEntry]:
        """Entries of the observation book, empty without a book. Raises A7SimError."""
        path = self.folder / BOOK
        rows = self.rows(BOOK)
        if rows and tuple(rows[0]) != COLUMNS:
            raise A7SimError(
                f"{path}, line 1: expected the columns {','.join(COLUMNS)}, got {','.join(map(str, rows[0]))}"
            )
        return [_entry(row, f"{path}, row {i}") for i, row in enumerate(rows, start=1)]

    @contextmanager
    def reading_results(self) -> Iterator[None]:
        """Convert missing keys of the results in the body into an error of their file. Raises A7SimError."""
        try:
            yield
        except (LookupError, TypeError, AttributeError, ValueError) as error:
            if isinstance(error, A7SimError):
                raise
            raise A7SimError(
                f"{self.folder / RESULTS}: expected the results of a session as a7sim leaves them, "
                f"got some that lack or change a part ({type(error).__name__}: {error})"
            ) from error


def _entry(row: dict[str, str], place: str) -> BookEntry:
    try:
        return BookEntry(
            number=int(row["number"]),
            time=float(row["time_s"]),
            round=int(row["round"] or 0),
            **{name: row[name] for name in ("model", "form", "point", "item", "reading", "remark", "struck")},
        )
    except (ValueError, TypeError) as error:
        raise A7SimError(f"{place}: expected an entry of the observation book, got {dict(row)}"[:300]) from error


def read_session(folder: Path) -> SessionFolder:
    """Return the session in a folder. Raises A7SimError for a folder without one and for damaged results."""
    if not folder.is_dir():
        came = "a file" if folder.exists() else "none"
        raise A7SimError(f"{folder}: expected the folder of a session, got {came}")
    path = folder / RESULTS
    if not path.is_file():
        if (folder / JOURNAL).is_file():
            raise A7SimError(
                f"{folder}: expected {RESULTS}, got only a journal: the session was cut off before its end"
            )
        raise A7SimError(f"{folder}: expected the folder of a session with its {RESULTS}, got none")
    try:
        document = msgspec.json.decode(read_text(path))
    except msgspec.DecodeError as error:
        raise A7SimError(f"{path}: expected the results of a session in JSON, got a damaged file: {error}") from error
    if not isinstance(document, dict) or "command" not in document:
        raise A7SimError(f"{path}: expected the results of a session, got a document that names no command")
    if document.get("schema_version") != SCHEMA_VERSION:
        raise A7SimError(
            f"{path}: expected schema_version {SCHEMA_VERSION}, got {document.get('schema_version')!r}: "
            "results of another version of a7sim"
        )
    if document["command"] not in COMMANDS:
        raise A7SimError(f"{path}: expected the results of {', '.join(COMMANDS)}, got those of {document['command']}")
    return SessionFolder(folder, document)
