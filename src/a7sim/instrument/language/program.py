"""Lines parsed against the command table; the result depends on the text alone and is cached."""

from functools import lru_cache

from msgspec import Struct

from a7sim.instrument.language.commands import COMMANDS
from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.syntax import Mnemonic, Parameter, Unit, parse_mnemonics, parse_unit, split_units
from a7sim.instrument.language.table import Call, Command, Handler

MAX_CACHED_LINE = 100
"""Maximum bytes of a cached line; longer ones rarely repeat."""

MAX_CACHED_LINES, MAX_CACHED_HEADERS = 256, 512
"""Numbers of parsed lines and of headers in the caches."""


class ParsedCommand(Struct, frozen=True):
    """Unit with a known command."""

    text: str
    command: Command
    suffix: int
    given: tuple[Parameter, ...]
    bare: Call | None
    """The call of a command without parameters, which is always the same."""

    def call(self, context: CommandContext) -> Call:
        """Return the call of the command in a context. Raises CommandError."""
        return self.bare or self.command.call(self.given, self.suffix, context)


class ParseFailure(Struct, frozen=True):
    """Unit that matches no command."""

    number: ErrorNumber
    detail: str


def strip_line_end(line: bytes) -> str:
    """Return the text of a line without its line end."""
    return line.removesuffix(b"\n").removesuffix(b"\r").decode("latin-1")


Program = tuple[ParsedCommand | ParseFailure, ...]
Path = tuple[Mnemonic, ...]


def parse_program(line: bytes) -> Program:
    """Return the units of a line in order, with or without its line end. Each line starts at the root."""
    return _parse_cached_line(line) if len(line) <= MAX_CACHED_LINE else _parse_line(line)


class CachedQuery(Struct, frozen=True):
    """Line with a single query that always has the same meaning and never waits: a client's poll."""

    text: str
    handler: Handler
    call: Call


def cached_query(received: bytes, cr_ends_line: bool) -> CachedQuery | None:
    """Return the cached query of the input, None if the input is anything else."""
    return _parse_query(received, cr_ends_line) if len(received) <= MAX_CACHED_LINE else None


@lru_cache(maxsize=MAX_CACHED_LINES)
def _parse_query(received: bytes, cr_ends_line: bool) -> CachedQuery | None:
    if received.find(b"\n") != len(received) - 1 or (cr_ends_line and b"\r" in received):
        return None
    program = parse_program(received)
    step = program[0] if len(program) == 1 else None
    if not isinstance(step, ParsedCommand) or step.bare is None or not step.command.query or step.command.may_wait:
        return None
    return CachedQuery(step.text, step.command.handler, step.bare)


def _parse_line(line: bytes) -> Program:
    program: list[ParsedCommand | ParseFailure] = []
    level: Path = ()
    for text in split_units(strip_line_end(line)):
        try:
            unit = parse_unit(text)
            command, suffix, level = _find_command(unit.header, unit.query, level)
            program.append(_parsed_command(text, unit, command, suffix))
        except CommandError as error:
            program.append(ParseFailure(error.number, error.detail))
    return tuple(program)


@lru_cache(maxsize=MAX_CACHED_HEADERS)
def _find_command(header: str, query: bool, level: Path) -> tuple[Command, int, Path]:
    """Return the command of a header below a level, its suffix, and the level of the next header."""
    common, rooted = header[0] == "*", header[0] == ":"
    path = parse_mnemonics(header) if common or rooted else level + parse_mnemonics(header)
    command, suffix = COMMANDS.find(path, query)
    return command, suffix, level if common else path[:-1]


_parse_cached_line = lru_cache(maxsize=MAX_CACHED_LINES)(_parse_line)


def _parsed_command(text: str, unit: Unit, command: Command, suffix: int) -> ParsedCommand:
    given = unit.parameters()
    bare = Call(suffix, ()) if not given and all(each.optional for each in command.parameters) else None
    return ParsedCommand(text, command, suffix, given, bare)
