"""Format of a journal: lines of JSON, each with a checksum over all lines before it."""

import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from a7sim.errors import A7SimError

SCHEMA_VERSION = 3

READABLE_VERSIONS = (2, 3)
"""Schema versions that are read; version 2 had the whole scenario in its header."""

_END_OF_LINE = b',"crc":"%08x"}'
_END_LENGTH = len(_END_OF_LINE % 0)


class Event(msgspec.Struct, frozen=True, omit_defaults=True):
    """Event of a journal; `t` is the simulated time in s.

    If `kind` is empty, an event on the link (`LinkEvent`). Otherwise 'entry', an entry of the observation book;
    'strike', its striking out; 'state', the hash of the instrument's state.
    """

    t: float
    client: str = ""
    dir: str = ""
    text: str = ""
    kind: str = ""
    number: int = 0
    model: str = ""
    form: str = ""
    round: int = 0
    point: str = ""
    item: str = ""
    reading: str = ""
    remark: str = ""
    struck: str = ""
    hash: str = ""


@dataclass
class ChecksumChain:
    """Chain of checksums over lines: a changed, lost or moved line breaks it."""

    crc: int = 0

    def line(self, data: Any) -> bytes:
        """Return the next line of a journal, without its end."""
        body = msgspec.json.encode(data)[:-1]
        self.crc = zlib.crc32(body, self.crc)
        return body + _END_OF_LINE % self.crc

    def accepts(self, line: bytes) -> bool:
        """Return whether a line is the next one; if so the chain advances."""
        crc = zlib.crc32(line[:-_END_LENGTH], self.crc)
        if line[-_END_LENGTH:] != _END_OF_LINE % crc:
            return False
        self.crc = crc
        return True


@dataclass(frozen=True)
class JournalFile:
    """Contents of a journal: its lines, and the truncated last line, if any."""

    path: Path
    header: dict[str, Any]
    lines: list[bytes]
    """Without their ends, the header first."""
    truncated_tail: bytes
    crc: int
    """Of the last line."""

    def __len__(self) -> int:
        return len(self.lines)

    def event(self, number: int) -> Event:
        """Return the event of a line, counted from 1 as editors do; line 1 is the header."""
        return _DECODER.decode(self.lines[number - 1])

    def location(self, number: int) -> str:
        """Return the location of a line as text."""
        return f"{self.path}, line {number}"

    @property
    def size(self) -> int:
        """Bytes of the whole lines with their ends."""
        return sum(map(len, self.lines)) + len(self.lines)


_DECODER = msgspec.json.Decoder(Event)


def read_journal(path: Path) -> JournalFile:
    """Return the contents of a journal. Raises A7SimError for an unreadable or damaged one, naming the line.

    A last line without an end is truncated: it was being written at a crash, and no client had its reply.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise A7SimError(f"{path}: expected the journal of a session: {error.strerror}") from error
    *lines, tail = data.split(b"\n")
    chain = ChecksumChain()
    for number, line in enumerate(lines, start=1):
        if not chain.accepts(line):
            raise A7SimError(f"{path}, line {number}: {_damage_message(line, number)}")
    crc = chain.crc
    if not lines:
        raise A7SimError(f"{path}: expected the journal of a session, got no whole line: nothing was observed yet")
    if chain.accepts(tail[:-1]):
        raise A7SimError(
            f"{path}, line {len(lines) + 1}: expected a line end, got another byte: the journal is damaged"
        )
    return JournalFile(path, _header(path, lines[0]), lines, tail, crc)


def has_header(path: Path) -> bool:
    """Return whether there is a journal with a whole line: its header, from which a session can continue."""
    try:
        with path.open("rb") as file:
            return file.readline().endswith(b"\n")
    except FileNotFoundError:
        return False


def _header(path: Path, line: bytes) -> dict[str, Any]:
    header = msgspec.json.decode(line)
    if header.get("schema_version") not in READABLE_VERSIONS:
        raise A7SimError(f"{path}, line 1: {_version_message(header)}")
    return dict(header)


def _damage_message(line: bytes, number: int) -> str:
    if number == 1:
        try:
            header = msgspec.json.decode(line)
        except (msgspec.DecodeError, UnicodeDecodeError):
            header = None
        if isinstance(header, dict) and header.get("schema_version", SCHEMA_VERSION) not in READABLE_VERSIONS:
            return _version_message(header)
    return "expected the checksum that follows from the lines before and this one, got another: the journal is damaged"


def _version_message(header: dict[str, Any]) -> str:
    return (
        f"expected a journal of schema_version {' or '.join(map(str, READABLE_VERSIONS))}, "
        f"got {header['schema_version']!r}: this version of a7sim cannot replay or resume it"
    )
