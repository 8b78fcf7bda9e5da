"""Comparison of sessions: the values of their results side by side, as text."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import msgspec
from rich.console import Group, RenderableType
from rich.text import Text

from a7sim.errors import A7SimError
from a7sim.report.session_folder import SessionFolder
from a7sim.result_documents import Document, document_header
from a7sim.text import pluralize
from a7sim.text_tables import text_table

EXCLUDED_KEYS = frozenset(
    {
        "schema_version",
        "rounds",
        "parallax_mm",
        "points",
        "standard_points",
        "rotation",
        "relative_rotation",
        "found_relative_rotation",
        "base_direction",
        "found_base_direction",
        "translation",
        "residuals_m",
        "residuals_um",
        "residual_parallax_mm",
        "statistics",
        "common_mm",
        "in_words",
        "finished_at_s",
    }
)
"""Parts of results that are lists of points, matrices, or repeated elsewhere."""

_NAMED_BY = ("model", "photo", "models", "name", "number")
"""Key that names an entry in its list."""

ABSENT = "-"

MIN_WIDTH = 8
"""Minimum width of a value on a terminal, for any number of sessions."""


@dataclass(frozen=True)
class FactRow:
    """Value by its path in the results, for each session."""

    fact: str
    values: tuple[str, ...]

    @property
    def differs(self) -> bool:
        """Return whether the sessions differ."""
        return len(set(self.values)) > 1


def compare_sessions(sessions: Sequence[SessionFolder], everything: bool = False) -> list[FactRow]:
    """Return the values that differ between sessions of one kind, or all of them. Raises A7SimError."""
    kinds = {kept.command: kept.folder for kept in reversed(sessions)}
    if len(kinds) > 1:
        shown = " and ".join(f"{folder} is of a7sim {command}" for command, folder in kinds.items())
        raise A7SimError(f"expected sessions of one kind to compare, got several: {shown}")
    facts = []
    for kept in sessions:
        with kept.reading_results():
            facts.append(dict(_facts(kept.document, ())))
    names = _in_order(facts)
    rows = (FactRow(name, tuple(each.get(name, ABSENT) for each in facts)) for name in names)
    return [row for row in rows if everything or row.differs]


def _in_order(facts: Sequence[Mapping[str, str]]) -> list[str]:
    """Return all names, each after its predecessor in the first session that has it."""
    names: list[str] = []
    for each in facts:
        at = 0
        for name in each:
            if name in names:
                at = names.index(name) + 1
            else:
                names.insert(at, name)
                at += 1
    return names


def _facts(value: Any, path: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    if isinstance(value, Mapping):
        for key, each in value.items():
            if key == "slips":
                yield from _slips(each, (*path, key))
            elif key not in EXCLUDED_KEYS:
                yield from _facts(each, (*path, key))
    elif isinstance(value, list) and all(isinstance(each, Mapping) for each in value):
        for i, each in enumerate(value, start=1):
            yield from _facts(each, (*path, _name(each, i)))
    else:
        yield ".".join(path), _as_text(value)


def _slips(slips: Sequence[Document], path: tuple[str, ...]) -> Iterator[tuple[str, str]]:
    yield ".".join(path), str(len(slips))
    for kind, number in sorted(Counter(each["kind"] for each in slips).items()):
        yield ".".join((*path, kind)), str(number)


def _name(entry: Mapping[str, Any], number: int) -> str:
    named = next((entry[key] for key in _NAMED_BY if key in entry), number)
    return "-".join(map(str, named)) if isinstance(named, list) else str(named)


def _as_text(value: Any) -> str:
    if isinstance(value, str):
        return value
    return msgspec.json.encode(value).decode()


def comparison_document(sessions: Sequence[SessionFolder], rows: Sequence[FactRow]) -> Document:
    """Return a comparison as a document."""
    return document_header("compare") | {
        "sessions": [str(kept.folder) for kept in sessions],
        "rows": [{"fact": row.fact, "values": list(row.values)} for row in rows],
    }


def comparison_table(sessions: Sequence[SessionFolder], rows: Sequence[FactRow], width: int) -> RenderableType:
    """Return a comparison for a terminal of a width."""
    if not rows:
        return Text(f"{len(sessions)} sessions of a7sim {sessions[0].command}, all the same")
    leaves = max(len(row.fact.rpartition(".")[2]) for row in rows)
    each_value = max(MIN_WIDTH, (width - leaves - 2) // len(sessions) - 2)
    parts: list[RenderableType] = [Text(f"{i}: {kept.folder}") for i, kept in enumerate(sessions, start=1)]
    for group, members in groupby(rows, key=lambda row: row.fact.rpartition(".")[0]):
        table = text_table("", *map(str, range(1, len(sessions) + 1)), left=range(len(sessions) + 1), fold=range(1, 99))
        for column, wide in zip(table.columns, (leaves, *[each_value] * len(sessions)), strict=True):
            column.width = wide
        for row in members:
            table.add_row(row.fact.rpartition(".")[2], *row.values)
        parts += [Text(), Text(group.replace(".", " ") or "session", style="bold"), table]
    return Group(*parts, Text(f"\n{pluralize(sum(row.differs for row in rows), 'difference')}"))
