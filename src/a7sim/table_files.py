"""Reading and writing of table files: CSV or TOML, UTF-8, decimal points, `#` comments.

A table in CSV has a header line; in TOML it is an array of tables named `rows` with the columns as keys.
"""

import csv
import io
import math
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from a7sim.errors import A7SimError
from a7sim.text import pluralize

MAX_FILE_BYTES = 20_000_000
"""Bytes; a longer file is rejected before it is read."""

MAX_NAME_LENGTH = 64

MAX_NUMBER = 1e12
"""Maximum of any measurement in mm, m or counts."""

DECIMALS = 6
"""Of the numbers in written CSV files."""

_CONTROL = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\x85\u2028\u2029]")
_TOML = re.compile(r"\[|[\w.\"'-]+\s*=")


@dataclass(frozen=True, slots=True)
class Row:
    """Data row: its location, texts and numbers by column."""

    line: int
    texts: dict[str, str]
    numbers: dict[str, float]
    unit: str = "line"
    """Unit of `line`: lines of CSV, rows of TOML."""

    @property
    def location(self) -> str:
        """Location of the row as text."""
        return f"{self.unit} {self.line}"


@dataclass(frozen=True)
class Table:
    """Cells of a file by row and column, as text."""

    path: Path
    columns: tuple[str, ...]
    cells: tuple[tuple[int, dict[str, str]], ...]
    """Line of each row and its cells by column."""
    header: str
    """Location of the column names as text."""
    unit: str

    def rows(self, texts: Sequence[str], numbers: Sequence[str], gaps: Sequence[str] = ()) -> list[Row]:
        """Return the rows with the named columns, numbers finite; in columns of `gaps` an empty cell is nan.

        Raises A7SimError with file, line and column.
        """
        wanted = [*texts, *numbers]
        missing = [column for column in wanted if column not in self.columns]
        if missing:
            raise A7SimError(
                f"{self.path}{self.header}: expected the columns {','.join(wanted)}, "
                f"got {_shown(','.join(self.columns))} (no {', '.join(missing)})"
            )
        return [
            Row(
                line,
                {column: self._text(line, column, cells[column]) for column in texts},
                {column: self._number(line, column, cells[column], column in gaps) for column in numbers},
                self.unit,
            )
            for line, cells in self.cells
        ]

    def _text(self, line: int, column: str, cell: str) -> str:
        if 0 < len(cell) <= MAX_NAME_LENGTH and cell.isprintable():
            return cell
        shown = repr(cell[:40]) if cell else "nothing"
        raise A7SimError(
            f"{self.path}, {self.unit} {line}, column {column}: expected a name of 1 to {MAX_NAME_LENGTH} characters, "
            f"got {shown}"
        )

    def _number(self, line: int, column: str, cell: str, may_be_empty: bool) -> float:
        if may_be_empty and not cell:
            return math.nan
        try:
            value = float(cell)
        except ValueError:
            value = math.nan
        if not abs(value) <= MAX_NUMBER or "_" in cell:
            raise A7SimError(f"{self.path}, {self.unit} {line}, column {column}: expected a number, got {cell[:40]!r}")
        return value


def describe_missing_file(path: Path) -> str:
    """Return a description of a path that is not a file."""
    return "a folder" if path.is_dir() else "no such file"


def read_text(path: str | Path) -> str:
    """Return the text of a file. Raises A7SimError with line and column for invalid bytes, and for long files."""
    path = Path(path)
    try:
        with path.open("rb") as file:
            content = file.read(MAX_FILE_BYTES + 1)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise A7SimError(f"{path}: expected a readable file: {why}") from error
    if len(content) > MAX_FILE_BYTES:
        raise A7SimError(f"{path}: expected a file of at most {MAX_FILE_BYTES} bytes, got more")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        place = _place(content[: error.start].decode("utf-8", "replace"))
        raise A7SimError(f"{path}, {place}: expected UTF-8 text, got bytes that are none ({error.reason})") from error
    if control := _CONTROL.search(text):
        raise A7SimError(f"{path}, {_place(text[: control.start()])}: expected text, got a control byte")
    return text


def _shown(text: str) -> str:
    """Return the start of a text from a file, printable within a sentence."""
    return "".join(each if each.isprintable() else " " for each in text[:80])


def _place(before: str) -> str:
    return f"line {before.count(chr(10)) + 1}, column {len(before) - before.rfind(chr(10))}"


def first_line(text: str) -> str:
    """Return the first line that is neither empty nor a comment."""
    return next((line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")), "")


def read_table(path: str | Path, text: str | None = None) -> Table:
    """Return the table of a CSV or TOML file, recognised by the suffix or else the first line.

    `text` saves reading the file again. Raises A7SimError.
    """
    path = Path(path)
    text = read_text(path) if text is None else text
    if not text.strip():
        raise A7SimError(f"{path}: expected a header line and rows, got an empty file")
    toml = path.suffix.lower() == ".toml" or (path.suffix.lower() != ".csv" and _TOML.match(first_line(text).lstrip()))
    table = _toml_table(path, text) if toml else _csv_table(path, text)
    if not table.cells:
        raise A7SimError(f"{path}: expected rows under the header, got none")
    return table


def read_rows(path: str | Path, texts: Sequence[str], numbers: Sequence[str], gaps: Sequence[str] = ()) -> list[Row]:
    """Return the rows of a file with the named columns (see `Table.rows`)."""
    return read_table(path).rows(texts, numbers, gaps)


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return the tables of a TOML file. Raises A7SimError."""
    return _toml(Path(path), read_text(path))


def _csv_table(path: Path, text: str) -> Table:
    lines = _csv_lines(path, text)
    if not lines:
        raise A7SimError(f"{path}: expected a header line and rows, got nothing but comments")
    header_line, columns = lines[0]
    twice = next((column for column in columns if column and columns.count(column) > 1), None)
    if twice:
        raise A7SimError(
            f"{path}, line {header_line}, column {_shown(twice)}: expected every column once, got it twice"
        )
    for line, cells in lines[1:]:
        if len(cells) != len(columns):
            raise A7SimError(f"{path}, line {line}: expected {pluralize(len(columns), 'column')}, got {len(cells)}")
    cells_of = tuple((line, dict(zip(columns, cells, strict=True))) for line, cells in lines[1:])
    return Table(path, tuple(columns), cells_of, f", line {header_line}", "line")


def _csv_lines(path: Path, text: str) -> list[tuple[int, list[str]]]:
    reader = csv.reader(io.StringIO(text, newline=None), strict=True)
    rows = []
    try:
        for cells in reader:
            stripped = [cell.strip() for cell in cells]
            if any(stripped) and not stripped[0].startswith("#"):
                rows.append((reader.line_num, stripped))
    except csv.Error as error:
        raise A7SimError(
            f"{path}, line {reader.line_num}: expected CSV, got a line that breaks its rules: {error}"
        ) from None
    return rows


def _toml(path: Path, text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        why = "tables within tables without end" if isinstance(error, RecursionError) else error
        raise A7SimError(f"{path}: expected TOML, got a file that breaks its rules: {why}") from None


def _toml_table(path: Path, text: str) -> Table:
    rows = _toml(path, text).get("rows")
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise A7SimError(
            f"{path}: expected an array of tables named rows ([[rows]] with the columns as keys), got none"
        )
    columns = tuple(dict.fromkeys(column for row in rows for column in row))
    cells = tuple(
        (number, {column: _toml_cell(path, number, column, row.get(column, "")) for column in columns})
        for number, row in enumerate(rows, start=1)
    )
    return Table(path, columns, cells, "", "row")


def _toml_cell(path: Path, row: int, column: str, value: Any) -> str:
    if isinstance(value, bool) or not isinstance(value, str | int | float):
        raise A7SimError(
            f"{path}, row {row}, column {_shown(column)}: expected a text or a number, got {_shown(str(value))}"
        )
    return value.strip() if isinstance(value, str) else repr(value)


def rows_by_key(path: str | Path, rows: Sequence[Row], *columns: str) -> dict[tuple[str, ...], Row]:
    """Return the rows by the texts of the named columns. Raises A7SimError if two rows have the same."""
    found: dict[tuple[str, ...], Row] = {}
    for row in rows:
        key = tuple(row.texts[column] for column in columns)
        if key in found:
            shown = " ".join(key)
            raise A7SimError(
                f"{path}, {row.location}, column {columns[-1]}: expected a point of its own, "
                f"got {shown} as in {found[key].location}"
            )
        found[key] = row
    return found


def natural_sort_key(name: str) -> tuple[tuple[str | tuple[int, str], ...], str]:
    """Return a natural sort key of names with numbers: 2 before 10, `7a` before `7b`."""
    parts = re.split(r"([0-9]+)", name)
    shown = [part.lstrip("0") if i % 2 else part for i, part in enumerate(parts)]
    return tuple((len(part), part) if i % 2 else part for i, part in enumerate(shown)), name


def to_csv(columns: Sequence[str], rows: Iterable[Sequence[str | float | None]]) -> str:
    """Return a table as CSV, numbers with six decimals, an empty cell for None and nan."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in rows)
    return text.getvalue()


def _cell(value: str | float | None) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    return f"{value:.{DECIMALS}f}" if isinstance(value, float) else str(value)


def write_files(folder: str | Path, texts: Mapping[str, str]) -> None:
    """Write texts to the named files of a folder, which is created if necessary; each file is replaced atomically.

    Raises A7SimError for a folder that cannot be written.
    """
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(prefix=".writing-", dir=folder) as written:
            for name, text in texts.items():
                Path(written, name).write_text(text, encoding="utf-8", newline="\n")
            for name in texts:
                Path(written, name).replace(folder / name)
    except (OSError, ValueError) as error:
        why = error.strerror if isinstance(error, OSError) else error
        raise A7SimError(f"{folder}: expected a folder that can be written: {why}") from error
