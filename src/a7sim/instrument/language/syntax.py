"""Syntax of a command line: units, headers, parameters, independent of any command."""

import re
from collections.abc import Iterable, Iterator

from msgspec import Struct

from a7sim.instrument.language.errors import CommandError, ErrorNumber

MAX_NUMBER_LENGTH = 255
"""Digits and signs of a number (IEEE 488.2 7.7.2.4.1)."""

_HEADER = re.compile(r"(\*[A-Za-z]+|:?[A-Za-z][A-Za-z0-9_]*(?::[A-Za-z][A-Za-z0-9_]*)*)(\?)?")
_MNEMONIC = re.compile(r"([A-Za-z_]+?)(\d*)")
_NUMBER = re.compile(r"([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)\s*([A-Za-z]*)")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_NEVER = re.compile(r"[^ -~\t]")

Mnemonic = tuple[str, int | None]
"""In capitals, with its numeric suffix."""


class Text(Struct, frozen=True, gc=False):
    """Quoted parameter."""

    value: str


class Word(Struct, frozen=True, gc=False):
    """Parameter of letters and digits, in capitals."""

    value: str


class Number(Struct, frozen=True, gc=False):
    """Number with its unit in capitals, '' without a unit."""

    value: float
    unit: str


Parameter = Text | Word | Number


class Unit(Struct, frozen=True, gc=False):
    """Program message unit: its header as received, without the question mark, and the rest.

    The parameters are parsed only when the header is known: an unknown header is reported first.
    """

    header: str
    query: bool
    data: str

    def parameters(self) -> tuple[Parameter, ...]:
        """Return the parsed parameters. Raises CommandError."""
        return tuple(_parameter(each.strip()) for each in _split(self.data, ",")) if self.data else ()


def split_units(line: str) -> Iterator[str]:
    """Yield the texts between the semicolons of a line outside quotes, without blank ones."""
    for text in _split(line, ";"):
        unit = text.strip(" \t")
        if unit:
            yield unit


def _split(text: str, separator: str) -> Iterable[str]:
    return text.split(separator) if '"' not in text and "'" not in text else _split_outside_quotes(text, separator)


def _split_outside_quotes(text: str, separator: str) -> Iterator[str]:
    start, quote = 0, ""
    for i, character in enumerate(text):
        if quote:
            quote = "" if character == quote else quote
        elif character in "\"'":
            quote = character
        elif character == separator:
            yield text[start:i]
            start = i + 1
    yield text[start:]


def parse_unit(text: str) -> Unit:
    """Return a unit with its parsed header. Raises CommandError."""
    never = _NEVER.search(text)
    if never is not None:
        raise CommandError(ErrorNumber.INVALID_CHARACTER, f"character number {ord(never[0])}")
    header = _HEADER.match(text)
    if header is None:
        raise CommandError(ErrorNumber.SYNTAX_ERROR, f"expected a header, got {text[:20]}")
    rest = text[header.end() :]
    if rest and rest[0] not in " \t":
        raise CommandError(ErrorNumber.SYNTAX_ERROR, f"expected a blank after {header[0]}, got {rest[:10]}")
    return Unit(header[1], header[2] == "?", rest.strip())


def parse_mnemonics(header: str) -> tuple[Mnemonic, ...]:
    """Return the mnemonics of a header in capitals with their suffixes, None without one. Raises CommandError."""
    if header[0] == "*":
        return ((header.upper(), None),)
    return tuple(map(_mnemonic, header.lstrip(":").split(":")))


def _mnemonic(text: str) -> Mnemonic:
    found = _MNEMONIC.fullmatch(text)
    if found is None or len(found[2]) > 9:
        raise CommandError(ErrorNumber.UNDEFINED_HEADER, text[:20])
    return found[1].upper(), int(found[2]) if found[2] else None


def _parameter(text: str) -> Parameter:
    if not text:
        raise CommandError(ErrorNumber.SYNTAX_ERROR, "expected a parameter between the commas")
    if text[0] in "\"'":
        return _text(text)
    number = _NUMBER.fullmatch(text)
    if number is not None:
        if len(number[1]) > MAX_NUMBER_LENGTH:
            raise CommandError(ErrorNumber.DATA_TYPE_ERROR, f"expected at most {MAX_NUMBER_LENGTH} digits")
        return Number(float(number[1]), number[2].upper())
    if _WORD.fullmatch(text):
        return Word(text.upper())
    raise CommandError(ErrorNumber.DATA_TYPE_ERROR, f"expected a number, a word or a text in quotes, got {text[:20]}")


def _text(text: str) -> Text:
    quote = text[0]
    inner = text[1:-1]
    if len(text) < 2 or text[-1] != quote or quote in inner.replace(quote * 2, ""):
        raise CommandError(ErrorNumber.SYNTAX_ERROR, f"expected a text in quotes, got {text[:20]}")
    return Text(inner.replace(quote * 2, quote))


def quote_text(text: str) -> str:
    """Return a text in quotes, as string response data."""
    return '"' + text.replace('"', '""') + '"'
