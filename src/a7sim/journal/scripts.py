"""Operator scripts (`.a7s`): a session written by hand, one statement per line.

scenario akwanga seed 7                  # first statement: the instrument and the photographs
PHOT1:LOAD "101"                         # any line of the command language
wait 30                                  # simulated s
expect EYEP1? "1011" = 0, 0 +- 5         # a query, its reply, and a tolerance; texts exactly
include mounting.a7s                     # another script, in the same folder
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.scenario import Scenario, ScenarioError, load_scenario
from a7sim.scenario.loading import SEARCH_PATH
from a7sim.table_files import read_text

SUFFIX = ".a7s"

ANYTHING = "*"
"""Matches any value."""

_BINARY_FRACTION_TOLERANCE = 1e-9

_SCENARIO = re.compile(r"scenario\s+(\S+)(?:\s+seed\s+(\d{1,40}))?")
_EXPECTED = re.compile(r"expect\s+(?P<query>.+?)\s+=\s+(?P<values>.+?)(?:\s+\+-\s+(?P<within>\S+))?")
_KEYWORD = re.compile(r"(scenario|expect|wait|include)(\s|$)")
_PARTS = re.compile(r"\"(?:[^\"]|\"\")*\"|'(?:[^']|'')*'|[^\"'#]|[\"']")
_VALUES = re.compile(r"\s*(\"(?:[^\"]|\"\")*\"|[^,\"]+?)\s*(?:,|$)")


@dataclass(frozen=True)
class SourceLocation:
    """File and line of a statement."""

    file: Path
    line: int

    def __str__(self) -> str:
        return f"{self.file}, line {self.line}"


@dataclass(frozen=True)
class SendLine:
    """Line for the instrument."""

    place: SourceLocation
    text: str


@dataclass(frozen=True)
class Wait:
    """Wait in simulated s."""

    place: SourceLocation
    seconds: float


@dataclass(frozen=True)
class Expect:
    """Query and its expected reply, numbers `within` a tolerance; a value * matches any."""

    place: SourceLocation
    query: str
    values: tuple[str, ...]
    within: float = 0.0

    def __str__(self) -> str:
        tolerance = f" +- {self.within:g}" if self.within else ""
        return f"{self.query} = {', '.join(self.values)}{tolerance}"

    def matches(self, answer: tuple[str, ...]) -> bool:
        """Return whether a reply meets the expectation."""
        return len(answer) == len(self.values) and all(map(self._matches_value, self.values, answer))

    def _matches_value(self, expected: str, got: str) -> bool:
        if expected == ANYTHING:
            return True
        expected_value, actual_value = _number(expected), _number(got)
        if expected_value is None or actual_value is None:
            return expected.strip('"') == got.strip('"')
        return abs(expected_value - actual_value) <= self.within + _BINARY_FRACTION_TOLERANCE


Statement = SendLine | Wait | Expect


@dataclass(frozen=True)
class Script:
    """Script with all its includes: its scenario, and the statements in order."""

    file: Path
    scenario: Scenario
    seed: int
    statements: tuple[Statement, ...]


def find_script(name: str) -> Path:
    """Return the path of a script, given as a path or as the name of one that comes with a7sim. Raises A7SimError."""
    path = Path(name)
    if path.is_file():
        return path
    folders = [folder / "scripts" for folder in SEARCH_PATH]
    for folder in folders:
        found = folder / f"{path.name.removesuffix(SUFFIX)}{SUFFIX}"
        if path.parent == Path() and found.is_file():
            return found
    known = sorted({file.stem for folder in folders for file in folder.glob(f"*{SUFFIX}")})
    raise A7SimError(
        f"{name}: expected the folder of a session, its journal, or a script such as {', '.join(known)}; "
        "found no such file"
    )


def read_script(path: Path) -> Script:
    """Return a script. Raises A7SimError with file and line."""
    scenarios: list[tuple[SourceLocation, str, int | None]] = []
    statements = tuple(_statements(path, (), scenarios))
    if not scenarios:
        raise A7SimError(f"{path}, line 1: expected a first line such as 'scenario akwanga seed 7', got none")
    place, name, seed = scenarios[0]
    for other, *rest in scenarios[1:]:
        if rest != [name, seed]:
            raise A7SimError(f"{other}: expected the scenario and seed of {place}, got others")
    try:
        scenario_path = place.file.parent / name
        scenario = load_scenario(scenario_path if scenario_path.is_file() else name)
    except ScenarioError as error:
        raise A7SimError(f"{place}: {error}") from error
    return Script(path, scenario, scenario.seed if seed is None else seed, statements)


def _statements(
    path: Path, within: tuple[Path, ...], scenarios: list[tuple[SourceLocation, str, int | None]]
) -> Iterator[Statement]:
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        text = _without_comment(line).strip()
        place = SourceLocation(path, number)
        keyword = _KEYWORD.match(text)
        rest = text[keyword.end() :].strip() if keyword else ""
        if keyword and keyword[1] == "scenario":
            scenarios.append((place, *_scenario(place, text)))
        elif text and not scenarios:
            raise A7SimError(f"{place}: expected a first line such as 'scenario akwanga seed 7', got {text!r}")
        elif keyword and keyword[1] == "include":
            yield from _include(place, rest, (*within, path.resolve()), scenarios)
        elif keyword and keyword[1] == "wait":
            yield Wait(place, _seconds(place, rest))
        elif keyword:
            yield _expect(place, text)
        elif text:
            yield SendLine(place, text)


def _include(
    place: SourceLocation, name: str, within: tuple[Path, ...], scenarios: list[tuple[SourceLocation, str, int | None]]
) -> Iterator[Statement]:
    path = place.file.parent / name
    if not name or not path.is_file():
        raise A7SimError(f"{place}: expected a script beside this one to include, got {name or 'no name'}")
    if path.resolve() in within:
        raise A7SimError(f"{place}: expected a script that does not include itself, got {name}")
    yield from _statements(path, within, scenarios)


def _scenario(place: SourceLocation, text: str) -> tuple[str, int | None]:
    found = _SCENARIO.fullmatch(text)
    if found is None:
        raise A7SimError(f"{place}: expected 'scenario NAME' or 'scenario NAME seed N', got {text!r}")
    return found[1], int(found[2]) if found[2] else None


def _seconds(place: SourceLocation, text: str) -> float:
    seconds = _number(text)
    if seconds is None or not 0.0 <= seconds <= 1e6:
        raise A7SimError(f"{place}: expected 'wait' and 0 to 1000000 s, got {text!r}")
    return seconds


def _expect(place: SourceLocation, text: str) -> Expect:
    found = _EXPECTED.fullmatch(text)
    if found is None or "?" not in found["query"]:
        raise A7SimError(f"{place}: expected 'expect QUERY? = VALUE, VALUE +- TOLERANCE', got {text!r}")
    within = 0.0 if found["within"] is None else _number(found["within"])
    if within is None or within < 0.0:
        raise A7SimError(f"{place}: expected a tolerance of 0 or more behind +-, got {found['within']!r}")
    values = tuple(_VALUES.findall(found["values"]))
    if ",".join(values).replace(" ", "") != found["values"].replace(" ", ""):
        raise A7SimError(f"{place}: expected values with commas between them, got {found['values']!r}")
    return Expect(place, found["query"], values, within)


def _without_comment(line: str) -> str:
    code = ""
    for part in _PARTS.finditer(line):
        if part.start() != len(code):
            break
        code += part[0]
    return code


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None
