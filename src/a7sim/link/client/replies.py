"""Parsing of replies: texts, and blocks of arbitrary bytes (IEEE 488.2 definite length)."""

from dataclasses import dataclass

_SEMICOLON, _QUOTE, _END, _HASH = b';"\n#'

Part = str | bytes
"""Answer of one query: text, or the bytes of a block."""


class MalformedReplyError(Exception):
    """Bytes that no instrument of this language sends."""


@dataclass(frozen=True, slots=True)
class ParsedReply:
    """Reply and its length in bytes, including its end."""

    parts: tuple[Part, ...]
    length: int


def parse_reply(received: bytes | bytearray) -> ParsedReply | None:
    """Return the reply at the start of the input, None while it is incomplete. Raises MalformedReplyError."""
    parts: list[Part] = []
    at = 0
    while True:
        found = _block(received, at) if received[at : at + 1] == b"#" else _text(received, at)
        if found is None or found[1] >= len(received):
            return None
        part, at = found
        parts.append(part)
        if received[at] == _END:
            return ParsedReply(tuple(parts), at + 1)
        if received[at] != _SEMICOLON:
            raise MalformedReplyError(f"expected ; or a line end behind a block, got byte {received[at]}")
        at += 1


def _text(received: bytes | bytearray, start: int) -> tuple[str, int] | None:
    within = False
    for at in range(start, len(received)):
        byte = received[at]
        if byte == _END or (byte == _SEMICOLON and not within):
            return bytes(received[start:at]).removesuffix(b"\r").decode("latin-1"), at
        within ^= byte == _QUOTE
    return None


def _block(received: bytes | bytearray, start: int) -> tuple[bytes, int] | None:
    digits = bytes(received[start + 1 : start + 2])
    if not digits:
        return None
    if digits not in b"123456789":
        raise MalformedReplyError(f"expected a block of definite length, got #{digits.decode('latin-1')}")
    begins = start + 2 + int(digits)
    size = bytes(received[start + 2 : begins])
    if len(size) < int(digits):
        return None
    if not size.isdigit():
        raise MalformedReplyError(f"expected the size of a block, got {size.decode('latin-1')}")
    ends = begins + int(size)
    return (bytes(received[begins:ends]), ends) if len(received) >= ends else None


def part_as_text(part: Part) -> str:
    """Return a part as text: a block as its size."""
    return part if isinstance(part, str) else f"#block of {len(part)} bytes"
