"""Completion of headers from an instrument's own list."""

import re
from collections.abc import Iterator, Sequence
from itertools import product

_UNIT = re.compile(r"""(?:[^;"']|"[^"]*"|'[^']*')*""")
_NODE = re.compile(r"([A-Za-z*_]*)([12]?)")


def completions(typed: str, headers: Sequence[str]) -> list[str]:
    """Return the headers that complete the last word; empty inside parameters and quotes.

    `headers` are in the instrument's notation: `PROJector<n>:KAPPa?`. After `;` the level of the previous unit is tried
    first, as the instrument does.
    """
    *before, unit = _units(typed)
    word = unit.lstrip(" \t")
    if re.search(r"[\s\"'?]", word):
        return []
    level = "" if word.startswith((":", "*")) else _level(before)
    found = _matching(level + word, headers)
    return [f"{':' if word.startswith(':') else ''}{each.removeprefix(level)}" for each in found] if found else []


def _units(typed: str) -> list[str]:
    units: list[str] = []
    at = 0
    while True:
        found = _UNIT.match(typed, at)
        end = found.end() if found else at
        if end < len(typed) and typed[end] != ";":
            return [*units, typed[at:]]
        units.append(typed[at:end])
        if end >= len(typed):
            return units
        at = end + 1


def _level(units: Sequence[str]) -> str:
    level = ""
    for unit in units:
        header = (unit.split() or [""])[0].rstrip("?")
        if header and not header.startswith("*"):
            path = header.removeprefix(":") if header.startswith(":") else level + header
            level = path[: path.rfind(":") + 1]
    return level


def _matching(word: str, headers: Sequence[str]) -> list[str]:
    nodes = word.removeprefix(":").split(":")
    found = [each for header in headers for path in _paths(header) for each in _continued(nodes, path)]
    return list(dict.fromkeys(found))


def _paths(header: str) -> Iterator[list[str]]:
    """Yield the nodes of a header, with each optional node left out and included."""
    nodes = re.findall(r"\[:?[^\]]+\]|[^:\[\]?]+", header)
    choices = [((node.strip("[]:"),), ()) if node.startswith("[") else ((node,),) for node in nodes]
    mark = "?" if header.endswith("?") else ""
    for combination in product(*choices):
        path = [name for part in combination for name in part]
        yield [*path[:-1], path[-1] + mark]


def _continued(typed: Sequence[str], path: Sequence[str]) -> Iterator[str]:
    """Yield the continuation of a path from the typed nodes, which stay unchanged except for the last."""
    if len(typed) > len(path) or not all(_is(*pair) for pair in zip(typed[:-1], path, strict=False)):
        return
    last = _NODE.fullmatch(typed[-1])
    node = path[len(typed) - 1].rstrip("?").removesuffix("<n>")
    if (
        last is None
        or not node.upper().startswith(last[1].upper())
        or (last[2] and last[1].upper() not in _forms(node))
    ):
        return
    rest = list(path[len(typed) - 1 :])
    for numbers in product(*(("1", "2") if "<n>" in each else ("",) for each in rest)):
        numbered = [each.replace("<n>", number) for each, number in zip(rest, numbers, strict=True)]
        if not last[2] or numbers[0] == last[2]:
            yield ":".join([*typed[:-1], *numbered])


def _is(typed: str, node: str) -> bool:
    found = _NODE.fullmatch(typed)
    return (
        found is not None and found[1].upper() in _forms(node.removesuffix("<n>")) and ("<n>" in node or not found[2])
    )


def _forms(node: str) -> tuple[str, str]:
    return "".join(c for c in node if not c.islower()), node.upper()
