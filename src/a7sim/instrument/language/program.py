"""A line taken apart against the command table: what follows from its text alone, kept for when it comes again."""

from functools import lru_cache

from msgspec import Struct

from a7sim.instrument.language.commands import COMMANDS
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.syntax import Mnemonic, Parameter, Unit, parse_mnemonics, parse_unit, split_units
from a7sim.instrument.language.table import Call, Command, Handler

MAX_CACHED_LINE = 100
"""Bytes of a line that is kept taken apart; longer ones seldom come twice."""

LINES_KEPT, HEADERS_KEPT = 256, 512


class ParsedCommand(Struct, frozen=True):
    """A unit whose command is known."""

    text: str
    command: Command
    suffix: int
    given: tuple[Parameter, ...]
    bare: Call | None
    """The call, where it takes no parameter and hence always is the same."""

    def call(self, client: object) -> Call:
        """Return the call that a client makes of the command. Raises LanguageError."""
        return self.bare or self.command.call(self.given, self.suffix, client)


class ParseFailure(Struct, frozen=True):
    """A unit that can be no command's."""

    number: ErrorNumber
    detail: str


def strip_line_end(line: bytes) -> str:
    """Return the text of a line without its line end."""
    return line.removesuffix(b"\n").removesuffix(b"\r").decode("latin-1")


Program = tuple[ParsedCommand | ParseFailure, ...]
Path = tuple[Mnemonic, ...]


def parse_program(line: bytes) -> Program:
    """Return the units of a line in order, with or without its line end. Every line begins at the root."""
    return _kept(line) if len(line) <= MAX_CACHED_LINE else _taken_apart(line)


class CachedQuery(Struct, frozen=True):
    """A line that is nothing but a query, always means the same and need not wait: what a client polls."""

    text: str
    handler: Handler
    call: Call


def cached_query(received: bytes, cr_ends_line: bool) -> CachedQuery | None:
    """Return the question that what was received is, None where it is anything else."""
    return _kept_question(received, cr_ends_line) if len(received) <= MAX_CACHED_LINE else None


@lru_cache(maxsize=LINES_KEPT)
def _kept_question(received: bytes, cr_ends_line: bool) -> CachedQuery | None:
    if received.find(b"\n") != len(received) - 1 or (cr_ends_line and b"\r" in received):
        return None
    program = parse_program(received)
    step = program[0] if len(program) == 1 else None
    if not isinstance(step, ParsedCommand) or step.bare is None or not step.command.query or step.command.may_wait:
        return None
    return CachedQuery(step.text, step.command.handler, step.bare)


def _taken_apart(line: bytes) -> Program:
    program: list[ParsedCommand | ParseFailure] = []
    level: Path = ()
    for text in split_units(strip_line_end(line)):
        try:
            unit = parse_unit(text)
            command, suffix, level = _found(unit.header, unit.query, level)
            program.append(_step(text, unit, command, suffix))
        except CommandError as error:
            program.append(ParseFailure(error.number, error.detail))
    return tuple(program)


@lru_cache(maxsize=HEADERS_KEPT)
def _found(header: str, query: bool, level: Path) -> tuple[Command, int, Path]:
    """Return the command that a header names below a level, its suffix, and the level of what follows."""
    common, rooted = header[0] == "*", header[0] == ":"
    path = parse_mnemonics(header) if common or rooted else level + parse_mnemonics(header)
    command, suffix = COMMANDS.find(path, query)
    return command, suffix, level if common else path[:-1]


_kept = lru_cache(maxsize=LINES_KEPT)(_taken_apart)


def _step(text: str, unit: Unit, command: Command, suffix: int) -> ParsedCommand:
    given = unit.parameters()
    bare = Call(suffix, ()) if not given and all(each.optional for each in command.parameters) else None
    return ParsedCommand(text, command, suffix, given, bare)
