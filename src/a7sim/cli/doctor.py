"""`a7sim doctor`: installed and missing libraries, without importing them."""

import json
import os
import platform
import re
import shutil
import sys
from collections.abc import Iterator
from importlib import metadata
from itertools import takewhile
from typing import Any, NamedTuple

import click

import a7sim
from a7sim.bundled import Kind, bundled_names
from a7sim.cli import options
from a7sim.errors import A7SimError

EXIT_MISSING = 1

MIN_TERMINAL = (80, 24)
"""Columns and lines that the console needs."""

NOT_FOR_USERS = ("all", "dev", "docs")
"""Extras that are not reported."""

_KINDS: tuple[Kind, ...] = ("scenarios", "exercises", "studies")
_REQUIREMENT = re.compile(r"([\w.-]+)\s*(?:\[([^]]*)\])?\s*\(?([^;)]*)\)?\s*(?:;(.*))?")
_EXTRA = re.compile(r"""extra\s*==\s*['"]([\w-]+)['"]""")
_PLATFORM = re.compile(r"""sys_platform\s*(==|!=)\s*['"](\w+)['"]""")
_BOUND = re.compile(r"(>=|<=|==|!=|<|>)\s*([\w.]+)")


class Library(NamedTuple):
    """Required library, and its installed version, None if missing."""

    name: str
    asked: str
    installed: str | None

    @property
    def fits(self) -> bool:
        """Return whether a suitable version is installed."""
        return self.installed is not None and satisfies(self.installed, self.asked)


@click.command("doctor")
@options.as_document
def command(as_document: bool) -> None:
    """Report what is installed and what is missing, and the abilities of the terminal.

    Exit code 1 if a library is missing that all commands need; extras may be missing.

    Example: a7sim doctor
    """
    found = examine()
    if as_document:
        click.echo(json.dumps(found, indent=2, ensure_ascii=False))
    else:
        click.echo("\n".join(_as_lines(found)))
    if not found["healthy"]:
        raise click.exceptions.Exit(EXIT_MISSING)


def examine() -> dict[str, Any]:
    """Return the report as the document of `--json`. Raises A7SimError if a7sim is not installed."""
    asked = libraries()
    extras = {name: _extra_document(name, parts) for name, parts in asked.items() if name not in ("", *NOT_FOR_USERS)}
    return {
        "schema_version": 1,
        "command": "doctor",
        "healthy": all(each.fits for each in asked[""]),
        "a7sim": a7sim.__version__,
        "python": platform.python_version(),
        "implementation": platform.python_implementation(),
        "platform": f"{platform.system()} {platform.machine()}",
        "libraries": [_library_document(each) for each in asked[""]],
        "extras": extras,
        "comes_with": {kind: bundled_names(kind) for kind in _KINDS},
        "terminal": _terminal_document(),
    }


def _library_document(library: Library) -> dict[str, Any]:
    return library._asdict() | {"fits": library.fits}


def _extra_document(name: str, parts: list[Library]) -> dict[str, Any]:
    ready = all(each.fits for each in parts)
    return {
        "ready": ready,
        "libraries": [_library_document(each) for each in parts],
        "get": None if ready else f"pip install 'a7sim[{name}]'",
    }


def _terminal_document() -> dict[str, Any]:
    size = shutil.get_terminal_size()
    encoding = (sys.stdout.encoding or "").lower()
    return {
        "terminal": sys.stdout.isatty(),
        "columns": size.columns,
        "lines": size.lines,
        "colours": _colours(),
        "unicode": encoding.replace("-", "").startswith("utf"),
        "room_for_console": size.columns >= MIN_TERMINAL[0] and size.lines >= MIN_TERMINAL[1],
    }


def _colours() -> int:
    if os.environ.get("NO_COLOR") or os.environ.get("TERM", "dumb") in ("dumb", "unknown"):
        return 0
    if os.environ.get("COLORTERM", "").lower() in ("truecolor", "24bit"):
        return 1 << 24
    return 256 if "256" in os.environ["TERM"] else 16


def libraries() -> dict[str, list[Library]]:
    """Return by extra, '' for all commands, the libraries required on this platform. Raises A7SimError."""
    try:
        requirements = metadata.requires("a7sim") or []
    except metadata.PackageNotFoundError as error:
        raise A7SimError("doctor: expected a7sim to be installed (pip install .), found only its files") from error
    asked: dict[str, list[Library]] = {"": []}
    included: dict[str, list[str]] = {}
    for text in requirements:
        found = _REQUIREMENT.match(text)
        assert found is not None, text
        name, parts, bounds, marker = found.groups(default="")
        extra = _EXTRA.search(marker)
        members = asked.setdefault(extra[1] if extra else "", [])
        if name == "a7sim":
            included.setdefault(extra[1] if extra else "", []).extend(part.strip() for part in parts.split(","))
        elif _is_for_this_platform(marker):
            members.append(Library(name, bounds.strip(), _version(name)))
    for extra_name, included_names in included.items():
        for part in included_names:
            asked[extra_name] += [each for each in asked.get(part, []) if each not in asked[extra_name]]
    return {extra: sorted(each, key=lambda library: library.name.lower()) for extra, each in sorted(asked.items())}


def _is_for_this_platform(marker: str) -> bool:
    named = _PLATFORM.search(marker)
    return named is None or (sys.platform == named[2]) == (named[1] == "==")


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def satisfies(version: str, asked: str) -> bool:
    """Return whether a version is within bounds such as '>=8.2,<9'."""
    return all(_satisfies_bound(_numbers(version), sign, _numbers(bound)) for sign, bound in _BOUND.findall(asked))


def _satisfies_bound(version: list[int], sign: str, bound: list[int]) -> bool:
    longest = max(len(version), len(bound))
    a, b = ([*each, *[0] * (longest - len(each))] for each in (version, bound))
    return {">=": a >= b, "<=": a <= b, "==": a == b, "!=": a != b, "<": a < b, ">": a > b}[sign]


def _numbers(version: str) -> list[int]:
    parts = re.findall(r"\d+|[^\d.]+", version)
    return [int(part) for part in takewhile(str.isdecimal, parts)]


def _as_lines(found: dict[str, Any]) -> Iterator[str]:
    yield f"a7sim {found['a7sim']}, {found['implementation']} {found['python']}, {found['platform']}"
    yield ""
    yield "Needed by every command"
    yield from (_library_line(each) for each in found["libraries"])
    for name, extra in found["extras"].items():
        yield ""
        yield f"Extra {name}: {'ready' if extra['ready'] else 'missing, ' + extra['get']}"
        yield from (_library_line(each) for each in extra["libraries"])
    yield ""
    yield "Comes with a7sim: " + ", ".join(f"{len(names)} {kind}" for kind, names in found["comes_with"].items())
    yield _describe_terminal(found["terminal"])
    if not found["healthy"]:
        yield "A library that every command needs is missing or does not fit: pip install --upgrade a7sim"


def _library_line(library: dict[str, Any]) -> str:
    state = "" if library["fits"] else "missing" if library["installed"] is None else "does not fit"
    asked = library["asked"] or "any"
    return f"  {library['name']:<16}{library['installed'] or '-':<14}{asked:<16}{state}".rstrip()


def _describe_terminal(terminal: dict[str, Any]) -> str:
    colours = {0: "no colours", 16: "16 colours", 256: "256 colours"}.get(terminal["colours"], "true colours")
    room = "room for the console" if terminal["room_for_console"] else "the console needs 80x24"
    kind = "Terminal" if terminal["terminal"] else "Not a terminal"
    letters = "Unicode" if terminal["unicode"] else "no Unicode"
    return f"{kind}, {terminal['columns']}x{terminal['lines']} ({room}), {colours}, {letters}"
