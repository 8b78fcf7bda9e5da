"""Reading CSV files that people send: a header line, decimal points, `#` comments, UTF-8."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from a7sim.mistakes import Mistake

LONGEST_FILE = 20_000_000
"""Bytes; a longer file is refused before it is read."""


@dataclass(frozen=True, slots=True)
class Row:
    """A data row: its line number, its texts and its numbers by column."""

    line: int
    texts: dict[str, str]
    numbers: dict[str, float]


def read_rows(path: str | Path, texts: Sequence[str], numbers: Sequence[str]) -> list[Row]:
    """Return the rows of a CSV file that must have the named columns.

    Raises Mistake with file, line and column when it cannot be read so.
    """
    path = Path(path)
    try:
        if path.stat().st_size > LONGEST_FILE:
            raise Mistake(f"{path}: expected a file of at most {LONGEST_FILE} bytes, got {path.stat().st_size}")
        content = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise Mistake(f"{path}: expected UTF-8 text, got bytes that are none ({error.reason})") from error
    except OSError as error:
        raise Mistake(f"{path}: expected a readable file: {error.strerror}") from error
    rows = _rows_of(path, content)
    if not rows:
        raise Mistake(f"{path}: expected a header line {','.join([*texts, *numbers])}, got an empty file")
    header_line, header = rows[0]
    missing = [column for column in [*texts, *numbers] if column not in header]
    if missing:
        raise Mistake(
            f"{path}, line {header_line}: expected the columns {','.join([*texts, *numbers])}, "
            f"got {','.join(header)[:80]} (no {', '.join(missing)})"
        )
    if len(rows) == 1:
        raise Mistake(f"{path}: expected rows under the header, got none")
    places = {column: header.index(column) for column in [*texts, *numbers]}
    return [_row(path, line, cells, header, places, numbers) for line, cells in rows[1:]]


def _rows_of(path: Path, content: str) -> list[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(content), strict=True)
    rows = []
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(stripped) and not stripped[0].startswith("#"):
                rows.append((reader.line_num, stripped))
    except csv.Error as error:
        raise Mistake(
            f"{path}, line {reader.line_num}: expected CSV, got a line that breaks its rules: {error}"
        ) from None
    return rows


def _row(
    path: Path, line: int, cells: list[str], header: list[str], places: dict[str, int], numbers: Sequence[str]
) -> Row:
    if len(cells) != len(header):
        raise Mistake(f"{path}, line {line}: expected {len(header)} columns, got {len(cells)}")
    values = {}
    for column in numbers:
        text = cells[places[column]]
        try:
            values[column] = float(text)
        except ValueError:
            values[column] = math.nan
        if not math.isfinite(values[column]):
            raise Mistake(f"{path}, line {line}, column {column}: expected a number, got {text[:40]!r}")
    return Row(
        line,
        {column: cells[place] for column, place in places.items() if column not in values},
        values,
    )


def unique(path: str | Path, rows: Sequence[Row], *columns: str) -> dict[tuple[str, ...], Row]:
    """Return the rows by the texts of the named columns. Raises Mistake when two rows have the same."""
    found: dict[tuple[str, ...], Row] = {}
    for row in rows:
        key = tuple(row.texts[column] for column in columns)
        if key in found:
            shown = " ".join(key)
            raise Mistake(
                f"{path}, line {row.line}, column {columns[-1]}: expected a point of its own, "
                f"got {shown} as in line {found[key].line}"
            )
        found[key] = row
    return found
