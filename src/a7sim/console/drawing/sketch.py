"""Sketch of a photograph in characters: its pricked points and the mark."""

from collections.abc import Mapping
from dataclasses import dataclass

HALF_MM = 120.0
"""Half the side of a sketch, a little more than half the photograph's."""

Place = tuple[float, float]
"""x, y on the print, mm."""

Cell = tuple[int, int]
"""Column and row."""


@dataclass(frozen=True)
class SketchGrid:
    """Rows of characters, and the cells of the mark (None if off the print) and the points."""

    rows: list[str]
    mark: Cell | None
    points: dict[str, Cell]

    def nearest(self, column: int, row: int) -> str | None:
        """Return the name of the point nearest to a cell, None without points."""
        return min(
            self.points,
            key=lambda name: abs(self.points[name][0] - column) + 2 * abs(self.points[name][1] - row),
            default=None,
        )


def draw_points(points: Mapping[str, Place], width: int, height: int, dot: str = "·") -> SketchGrid:
    """Return the sketch of named positions with a number of columns and rows, without the mark.

    Names are written where there is space.
    """
    rows = [[" "] * width for _ in range(height)]
    cells = {name: cell for name, place in points.items() if (cell := _cell(place, width, height)) is not None}
    for column, row in cells.values():
        rows[row][column] = dot
    for name, (column, row) in cells.items():
        _write(rows[row], column, name)
    return SketchGrid(["".join(row) for row in rows], None, cells)


def overlay_mark(sketch: SketchGrid, mark: Place | None, width: int, height: int) -> SketchGrid:
    """Return a sketch with the mark."""
    at = _cell(mark, width, height) if mark is not None else None
    if at is None:
        return sketch
    column, row = at
    rows = list(sketch.rows)
    rows[row] = f"{rows[row][:column]}+{rows[row][column + 1 :]}"
    return SketchGrid(rows, at, sketch.points)


def _cell(place: Place, width: int, height: int) -> Cell | None:
    across, down = place[0] / HALF_MM, -place[1] / HALF_MM
    if max(abs(across), abs(down)) > 1.0:
        return None
    return round((across + 1.0) / 2.0 * (width - 1)), round((down + 1.0) / 2.0 * (height - 1))


def _write(row: list[str], column: int, name: str) -> None:
    for begin in (column + 1, column - len(name)):
        end = begin + len(name)
        if begin >= 0 and end <= len(row) and all(each == " " for each in row[max(0, begin) : end]):
            row[begin:end] = name
            return
