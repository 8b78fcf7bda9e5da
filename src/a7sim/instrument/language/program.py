"""A line taken apart against the command table: what follows from its text alone, kept for when it comes again."""

from dataclasses import dataclass
from functools import lru_cache

from a7sim.instrument.language.commands import COMMANDS
from a7sim.instrument.language.errors import ErrorNumber, LanguageError
from a7sim.instrument.language.syntax import Parameter, Unit, unit_of, units_of
from a7sim.instrument.language.table import Call, Command, Handler

LONGEST_KEPT_LINE = 100
"""Bytes of a line that is kept taken apart; longer ones seldom come twice."""

LINES_KEPT = 256


@dataclass(frozen=True, slots=True)
class Step:
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


@dataclass(frozen=True, slots=True)
class Fault:
    """A unit that can be no command's."""

    number: ErrorNumber
    detail: str


def text_of(line: bytes) -> str:
    """Return the text of a line without its line end."""
    return line.removesuffix(b"\n").removesuffix(b"\r").decode("latin-1")


Program = tuple[Step | Fault, ...]


def program_of(line: bytes) -> Program:
    """Return the units of a line in order, with or without its line end. Every line begins at the root."""
    return _kept(line) if len(line) <= LONGEST_KEPT_LINE else _taken_apart(line)


@dataclass(frozen=True, slots=True)
class Question:
    """A line that is nothing but a query, always means the same and need not wait: what a client polls."""

    text: str
    handler: Handler
    call: Call


def question_of(received: bytes, cr_ends_line: bool) -> Question | None:
    """Return the question that what was received is, None where it is anything else."""
    return _kept_question(received, cr_ends_line) if len(received) <= LONGEST_KEPT_LINE else None


@lru_cache(maxsize=LINES_KEPT)
def _kept_question(received: bytes, cr_ends_line: bool) -> Question | None:
    if received.find(b"\n") != len(received) - 1 or (cr_ends_line and b"\r" in received):
        return None
    program = program_of(received)
    step = program[0] if len(program) == 1 else None
    if not isinstance(step, Step) or step.bare is None or not step.command.query or step.command.holds:
        return None
    return Question(step.text, step.command.handler, step.bare)


def _taken_apart(line: bytes) -> Program:
    program: list[Step | Fault] = []
    level: tuple[tuple[str, int | None], ...] = ()
    for text in units_of(text_of(line)):
        try:
            unit = unit_of(text)
            path = unit.mnemonics if unit.common or unit.rooted else level + unit.mnemonics
            command, suffix = COMMANDS.find(path, unit.query)
            level = level if unit.common else path[:-1]
            program.append(_step(text, unit, command, suffix))
        except LanguageError as error:
            program.append(Fault(error.number, error.detail))
    return tuple(program)


_kept = lru_cache(maxsize=LINES_KEPT)(_taken_apart)


def _step(text: str, unit: Unit, command: Command, suffix: int) -> Step:
    given = unit.parameters()
    bare = Call(suffix, ()) if not given and all(each.optional for each in command.takes) else None
    return Step(text, command, suffix, given, bare)
