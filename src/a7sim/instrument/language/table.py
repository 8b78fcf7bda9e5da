"""Structure of a command, and the command table, expanded once into a dictionary."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from typing import Any, Protocol

from msgspec import Struct

from a7sim.instrument.language.context import CommandContext
from a7sim.instrument.language.errors import CommandError, ErrorNumber
from a7sim.instrument.language.syntax import Number, Parameter, Text, Word

_LENGTHS = {"": 1.0, "MM": 1.0, "UM": 1e-3}
_ANGLES = {"": 1.0, "GON": 1.0, "DEG": 10.0 / 9.0}
_BARE = {"": 1.0}
UNITS: Mapping[str, Mapping[str, float]] = {"mm": _LENGTHS, "gon": _ANGLES, "": _BARE}

Limits = tuple[float, float, float]
"""MIN, MAX, DEF."""


Handler = Callable[[CommandContext, "Call"], str | bytes | None]


class Call(Struct, frozen=True, gc=False):
    """Command with its header suffix and its checked parameters in base units."""

    suffix: int
    arguments: tuple[Any, ...]


class ParameterType(Protocol):
    """Type of a parameter: its parsing and its description."""

    @property
    def optional(self) -> bool:
        """Whether the parameter may be left out."""

    def read(self, parameter: Parameter, context: CommandContext, suffix: int) -> Any:
        """Return the value. Raises CommandError."""

    def describe(self) -> str:
        """Return the notation of the parameter for documentation."""


@dataclass(frozen=True, slots=True)
class Quantity:
    """Number in mm, in gon or without unit; MIN, MAX and DEF if it has limits."""

    unit: str = ""
    limits: Callable[[CommandContext, int], Limits] | None = None
    whole: bool = False
    optional: bool = False
    name: str = "value"
    instrument_unit: Callable[[CommandContext], str] | None = None
    """Function that returns the unit, if it depends on the instrument."""

    def read(self, parameter: Parameter, context: CommandContext, suffix: int) -> float:
        """Return the number in its base unit."""
        if isinstance(parameter, Word):
            return self._named(parameter, context, suffix)
        if not isinstance(parameter, Number):
            raise CommandError(ErrorNumber.DATA_TYPE_ERROR, f"expected a number, got the text '{parameter.value}'")
        factors = UNITS[self.instrument_unit(context) if self.instrument_unit else self.unit]
        if parameter.unit not in factors:
            if len(factors) == 1:
                raise CommandError(ErrorNumber.SUFFIX_NOT_ALLOWED, f"expected a bare number, got {parameter.unit}")
            known = " or ".join(unit for unit in factors if unit)
            raise CommandError(ErrorNumber.INVALID_SUFFIX, f"expected {known}, got {parameter.unit}")
        value = parameter.value * factors[parameter.unit]
        if not abs(value) < 1e12:
            raise CommandError(ErrorNumber.DATA_OUT_OF_RANGE, f"expected less than 1E12, got {parameter.value:g}")
        return float(round(value)) if self.whole else value

    def _named(self, word: Word, context: CommandContext, suffix: int) -> float:
        places = {"MIN": 0, "MINIMUM": 0, "MAX": 1, "MAXIMUM": 1, "DEF": 2, "DEFAULT": 2}
        if self.limits is None or word.value not in places:
            allowed = "a number, MIN, MAX or DEF" if self.limits else "a number"
            raise CommandError(ErrorNumber.DATA_TYPE_ERROR, f"expected {allowed}, got {word.value}")
        return self.limits(context, suffix)[places[word.value]]

    def describe(self) -> str:
        """Return the notation of the number."""
        return f"<{self.name}{' ' + self.unit if self.unit else ''}>"


@dataclass(frozen=True, slots=True)
class Choice:
    """One of a few words, short or long form."""

    words: tuple[str, ...]
    optional: bool = False

    def read(self, parameter: Parameter, context: CommandContext, suffix: int) -> str:
        """Return the chosen word in lower case, long form."""
        if not isinstance(parameter, Word):
            raise CommandError(ErrorNumber.DATA_TYPE_ERROR, f"expected {self.describe()}")
        for word in self.words:
            if parameter.value in (short_form(word), word.upper()):
                return word.lower()
        raise CommandError(ErrorNumber.ILLEGAL_PARAMETER_VALUE, f"expected {self.describe()}, got {parameter.value}")

    def describe(self) -> str:
        """Return the words separated by bars."""
        return "|".join(self.words)


@dataclass(frozen=True, slots=True)
class Quoted:
    """Quoted text."""

    name: str = "text"
    optional: bool = False

    def read(self, parameter: Parameter, context: CommandContext, suffix: int) -> str:
        """Return the text."""
        if not isinstance(parameter, Text):
            raise CommandError(ErrorNumber.DATA_TYPE_ERROR, f"expected a text in quotes, got {parameter.value}")
        return parameter.value

    def describe(self) -> str:
        """Return the name in quotes."""
        return f'"{self.name}"'


@dataclass(frozen=True, slots=True)
class QuotedOrNumber:
    """Quoted text or bare number."""

    name: str = "name"
    optional: bool = False

    def read(self, parameter: Parameter, context: CommandContext, suffix: int) -> str | float:
        """Return the text or the number."""
        if isinstance(parameter, Text):
            return parameter.value
        return Quantity().read(parameter, context, suffix)

    def describe(self) -> str:
        """Return both notations."""
        return f'"{self.name}"|<value>'


@dataclass(frozen=True, slots=True)
class AnyWord:
    """Word interpreted by the handler."""

    name: str = "word"
    optional: bool = True

    def read(self, parameter: Parameter, context: CommandContext, suffix: int) -> str:
        """Return the word in capitals."""
        if not isinstance(parameter, Word):
            raise CommandError(ErrorNumber.DATA_TYPE_ERROR, f"expected a word, got {parameter.value}")
        return parameter.value

    def describe(self) -> str:
        """Return the name."""
        return f"[{self.name}]"


@dataclass(frozen=True)
class Command:
    """Header in SCPI notation, parameters and handler. `<n>` in the header stands for 1 or 2."""

    header: str
    handler: Handler
    parameters: tuple[ParameterType, ...] = ()
    repeated_parameter: ParameterType | None = None
    """Parameter that may follow the others any number of times."""
    moves: bool = False
    """Whether it moves something, which is reserved to the holder of the lock."""
    waits: bool = False
    """Whether it waits until the current movement is done."""
    polls: bool = False
    """Whether it queries the status, as a client does repeatedly while waiting for movement."""
    allowed_before_login: bool = False
    """Whether it is allowed before login."""
    help: str = ""
    suffixes: tuple[int, ...] = field(default=(1, 2))

    @property
    def query(self) -> bool:
        """Whether the header ends in a question mark."""
        return self.header.endswith("?")

    @property
    def may_wait(self) -> bool:
        """Whether it may wait, or make later units wait."""
        return self.moves or self.waits or self.polls

    def syntax(self) -> str:
        """Return header and parameters as in the manual."""
        parts = [f"[{each.describe()}]" if each.optional else each.describe() for each in self.parameters]
        if self.repeated_parameter:
            parts.append(f"{self.repeated_parameter.describe()}...")
        return " ".join([self.header, ",".join(parts)]).strip()

    def call(self, given: Sequence[Parameter], suffix: int, context: CommandContext) -> Call:
        """Return the call for the parameters of a unit. Raises CommandError."""
        taken = self.parameters if len(given) == len(self.parameters) else self._taken(len(given))
        values = [kind.read(parameter, context, suffix) for kind, parameter in zip(taken, given, strict=False)]
        return Call(suffix, tuple(values))

    def _taken(self, given: int) -> Sequence[ParameterType]:
        """Return the types of the given parameters in order; omitted ones are the last."""
        if given < sum(not each.optional for each in self.parameters):
            raise CommandError(ErrorNumber.MISSING_PARAMETER, f"expected {self.syntax()}")
        more = max(0, given - len(self.parameters))
        if more and self.repeated_parameter is None:
            raise CommandError(ErrorNumber.PARAMETER_NOT_ALLOWED, f"expected {self.syntax()}")
        return (
            self.parameters
            if self.repeated_parameter is None
            else [*self.parameters, *[self.repeated_parameter] * more]
        )


def short_form(word: str) -> str:
    """Return the capitals of a word in SCPI notation, such as MODE or BACK or FRON of FRONt."""
    return "".join(c for c in word if not c.islower())


@dataclass(frozen=True)
class _Found:
    command: Command
    numbered: tuple[bool, ...]


class CommandTable:
    """Commands by header, with each short and long form and optional node expanded once."""

    def __init__(self, commands: Sequence[Command]) -> None:
        self.commands = tuple(commands)
        self._commands: dict[tuple[tuple[str, ...], bool], _Found] = {}
        for command in commands:
            for path in _paths_of(command.header):
                self._enter(command, path)

    def _enter(self, command: Command, path: tuple[str, ...]) -> None:
        bare = [node.removesuffix("<n>") for node in path]
        found = _Found(command, tuple(node.endswith("<n>") for node in path))
        for names in product(*({short_form(node), node.upper()} for node in bare)):
            if self._commands.setdefault((names, command.query), found) is not found:
                raise ValueError(f"{command.header} stands twice in the table")

    def find(self, mnemonics: Sequence[tuple[str, int | None]], query: bool) -> tuple[Command, int]:
        """Return the command of a complete header path and its suffix. Raises CommandError."""
        found = self._commands.get((tuple([name for name, _ in mnemonics]), query))
        if found is None:
            raise CommandError(ErrorNumber.UNDEFINED_HEADER, _shown(mnemonics) + ("?" if query else ""))
        suffix = 1
        for (_, number), numbered in zip(mnemonics, found.numbered, strict=True):
            if number is not None and not numbered:
                raise CommandError(ErrorNumber.UNDEFINED_HEADER, _shown(mnemonics))
            if numbered and number is not None:
                if number not in found.command.suffixes:
                    raise CommandError(ErrorNumber.HEADER_SUFFIX_OUT_OF_RANGE, f"expected 1 or 2, got {number}")
                suffix = number
        return found.command, suffix

    def headers(self) -> list[str]:
        """Return all headers in the order of the table."""
        return [command.header for command in self.commands]


def _shown(mnemonics: Sequence[tuple[str, int | None]]) -> str:
    return ":".join(f"{name}{'' if number is None else number}" for name, number in mnemonics)


def _paths_of(header: str) -> list[tuple[str, ...]]:
    """Return the node paths of a header with each optional node left out and included."""
    nodes = re.findall(r"\[:?[^\]]+\]|[^:\[\]]+", header.rstrip("?"))
    choices = [((node.strip("[]:"),), ()) if node.startswith("[") else ((node,),) for node in nodes]
    return [tuple(name for part in combination for name in part) for combination in product(*choices)]
