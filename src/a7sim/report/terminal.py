"""Conversion of terminal output into parts of a page, so that no table is made twice."""

from collections.abc import Iterator

from rich.console import Group, RenderableType
from rich.rule import Rule
from rich.table import Table
from rich.text import Text

from a7sim.report.page import Heading, Paragraph, Part, TableBlock


def terminal_parts(*shown: RenderableType, caption: str = "") -> Iterator[Part]:
    """Yield the parts of a page with the same contents as terminal output.

    A bold line is the caption of the next table; a table without one has the last heading's, else `caption`.
    """
    pending = ""
    for each in _flat(shown):
        match each:
            case Table():
                yield _sheet(each, pending or caption)
                pending = ""
            case Rule():
                caption = str(each.title)
                yield Heading(caption)
            case Text():
                if pending:
                    yield Paragraph(pending)
                pending = each.plain.strip() if each.style == "bold" else ""
                if each.plain.strip() and not pending:
                    yield Paragraph(each.plain.strip())
    if pending:
        yield Paragraph(pending)


def _flat(shown: tuple[RenderableType, ...] | list[RenderableType]) -> Iterator[RenderableType]:
    for each in shown:
        if isinstance(each, Group):
            yield from _flat(each.renderables)
        elif not (isinstance(each, Text) and not each.plain.strip()):
            yield each


def _sheet(table: Table, caption: str) -> TableBlock:
    left = frozenset(i for i, column in enumerate(table.columns) if column.justify == "left")
    columns = [str(column.header) for column in table.columns]
    rows = [[str(cell) for cell in row] for row in zip(*(column.cells for column in table.columns), strict=True)]
    return TableBlock(caption, columns, rows, left)
