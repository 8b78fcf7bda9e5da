"""Grey values of an eyepiece as characters of a terminal: pure functions on arrays."""

from enum import StrEnum
from functools import lru_cache
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

Greys = npt.NDArray[np.uint8]
"""Grey values 0..255, rows from the top."""

LEVELS = 32
"""Grey levels of half-blocks."""

COLOUR_LEVELS = 16
"""Levels of each eye in an anaglyph."""

MARK = -1
"""Colour of the floating mark."""

_SHADES = " ░▒▓█"
_ASCII = " .:-=+*#%@"
_BAYER = np.array([[0, 8, 2, 10], [12, 4, 14, 6], [3, 11, 1, 9], [15, 7, 13, 5]]) / 16.0 + 1.0 / 32.0
_DOTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
_CORNER = 0.45
"""Share of the light lost in the corners of an eyepiece's window."""


class DrawingMode(StrEnum):
    """Drawing modes of grey values in a terminal."""

    HALVES = "halves"
    SHADES = "shades"
    BRAILLE = "braille"
    ASCII = "ascii"
    WORDS = "words"


_CELLS = {
    DrawingMode.HALVES: (1, 2),
    DrawingMode.SHADES: (1, 2),
    DrawingMode.BRAILLE: (2, 4),
    DrawingMode.ASCII: (1, 2),
}


class Run(NamedTuple):
    """Adjacent cells of a row with the same style: text, level of the foreground and of the background (or None)."""

    text: str
    ink: int | None = None
    paper: int | None = None


def window(width: int, height: int) -> tuple[int, int]:
    """Return columns and rows of the picture cells within a size: odd, so that the mark is in the middle."""
    return max(1, width - (width + 1) % 2), max(1, height - (height + 1) % 2)


def picture_size(drawing: DrawingMode, columns: int, rows: int) -> tuple[int, int]:
    """Return columns and rows of the picture that fills a number of cells; (0, 0) if nothing is drawn."""
    across, down = _CELLS.get(drawing, (0, 0))
    return columns * across, rows * down


def is_drawn_as(drawing: DrawingMode, greys: Greys) -> bool:
    """Return whether a picture has the shape of a drawing mode; one requested for another mode may not."""
    (rows, columns), (across, down) = greys.shape, _CELLS[drawing]
    return bool(columns % across == 0 and rows % down == 0)


@lru_cache(maxsize=16)
def _vignette(rows: int, columns: int) -> npt.NDArray[np.float32]:
    y, x = np.ogrid[-1.0 : 1.0 : rows * 1j, -1.0 : 1.0 : columns * 1j]
    return np.asarray(1.0 - _CORNER * ((x * x + y * y) / 2.0) ** 2, dtype=np.float32)


def apply_vignette(greys: Greys) -> Greys:
    """Return a picture ``(rows, columns)`` darkened towards the corners."""
    return (greys * _vignette(*greys.shape)).astype(np.uint8)


def levels(greys: Greys, count: int = LEVELS) -> Greys:
    """Return the level of each grey value, of `count` levels."""
    return (greys.astype(np.uint16) * count >> 8).astype(np.uint8)


def half_blocks(greys: Greys) -> list[list[Run]]:
    """Return the rows of runs of a picture ``(2 rows, columns)`` in half-blocks with 32 grey levels."""
    shown = levels(greys)
    return [_runs_of_halves(upper, lower) for upper, lower in zip(shown[0::2], shown[1::2], strict=True)]


def anaglyph(left: Greys, right: Greys) -> list[list[Run]]:
    """Return the runs of both pictures ``(2 rows, columns)`` in one; levels are 16 x left + right."""
    both = levels(left, COLOUR_LEVELS).astype(np.uint16) * COLOUR_LEVELS + levels(right, COLOUR_LEVELS)
    return [_runs_of_halves(upper, lower) for upper, lower in zip(both[0::2], both[1::2], strict=True)]


def _runs_of_halves(
    upper: npt.NDArray[np.unsignedinteger[npt.NBitBase]], lower: npt.NDArray[np.unsignedinteger[npt.NBitBase]]
) -> list[Run]:
    changes = np.flatnonzero((upper[1:] != upper[:-1]) | (lower[1:] != lower[:-1])) + 1
    begins = [0, *changes.tolist()]
    ends = [*begins[1:], len(upper)]
    ink, paper = upper.tolist(), lower.tolist()
    return [
        Run((" " if ink[begin] == paper[begin] else "▀") * (end - begin), ink[begin], paper[begin])
        for begin, end in zip(begins, ends, strict=True)
    ]


def shades(greys: Greys, ramp: str = _SHADES) -> list[list[Run]]:
    """Return the runs of a picture ``(2 rows, columns)`` in shades without colours, light as foreground."""
    cells = (greys[0::2].astype(float) + greys[1::2]) / 512.0 * (len(ramp) - 1)
    dither = np.tile(_BAYER, (cells.shape[0] // 4 + 1, cells.shape[1] // 4 + 1))[: cells.shape[0], : cells.shape[1]]
    steps = np.clip(np.floor(cells + dither).astype(int), 0, len(ramp) - 1)
    return [[Run("".join(ramp[step] for step in row))] for row in steps.tolist()]


def ascii_shades(greys: Greys) -> list[list[Run]]:
    """Return the runs of a picture ``(2 rows, columns)`` in ten characters of ASCII."""
    return shades(greys, _ASCII)


def braille(greys: Greys) -> list[list[Run]]:
    """Return the runs of a picture ``(4 rows, 2 columns)`` in dots, light as foreground."""
    rows, columns = greys.shape
    dither = np.tile(_BAYER, (rows // 4 + 1, columns // 4 + 1))[:rows, :columns]
    lit = greys / 256.0 > dither
    cells = lit.reshape(rows // 4, 4, columns // 2, 2).transpose(0, 2, 1, 3)
    codes = 0x2800 + (cells * _DOTS).sum(axis=(2, 3))
    return [[Run("".join(map(chr, row)))] for row in codes.tolist()]


def render(drawing: DrawingMode, greys: Greys) -> list[list[Run]]:
    """Return the rows of runs of a picture of `picture_size`."""
    if drawing is DrawingMode.HALVES:
        return half_blocks(greys)
    if drawing is DrawingMode.BRAILLE:
        return braille(greys)
    return ascii_shades(greys) if drawing is DrawingMode.ASCII else shades(greys)


def overlay_mark(rows: list[list[Run]], mark: str) -> list[list[Run]]:
    """Return the rows with the floating mark in the middle cell, on the background around it."""
    middle = len(rows) // 2
    row = rows[middle]
    left = sum(len(run.text) for run in row) // 2
    for at, run in enumerate(row):
        if left < len(run.text):
            before, after = run.text[:left], run.text[left + 1 :]
            under = row[at - 1] if at and not before else run
            marked = [run._replace(text=before), Run(mark, MARK, under.paper), run._replace(text=after)]
            marked = [each for each in marked if each.text]
            return [*rows[:middle], [*row[:at], *marked, *row[at + 1 :]], *rows[middle + 1 :]]
        left -= len(run.text)
    return rows
