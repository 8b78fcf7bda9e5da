"""Standard points of a model (thesis fig. 4.1) and cases of numerical relative orientation (thesis 3.4.2)."""

from collections.abc import Collection, Mapping, Sequence
from types import MappingProxyType

FIGURE_4_1 = ("3adg4", "1beh2", "5cfi6")
"""Rows from the top, columns from the left-hand nadir line (1) to the right-hand one (2)."""

POSITIONS = "123456abcdefghi"

PLACES: Mapping[str, tuple[float, float]] = MappingProxyType(
    {label: (column / 4.0, 1.0 - row) for row, labels in enumerate(FIGURE_4_1) for column, label in enumerate(labels)}
)
"""Position to its share of the base along it, and its row: 1 away from the operator, 0 on the base, -1 towards."""


def determine_orientation(positions: Collection[str]) -> bool:
    """Return whether y-parallaxes at positions determine the five elements of a relative orientation.

    A point in each row determines the terms in y and its square, two separate points in two of the rows those in x.
    """
    apart = [_extent([label for label in row if label in positions]) for row in FIGURE_4_1]
    return min(apart) >= 0.0 and sum(extent > 0.0 for extent in apart) >= 2


def _extent(row: Sequence[str]) -> float:
    """Return the distance of the outermost of some positions in a row, in bases; negative for none."""
    return PLACES[row[-1]][0] - PLACES[row[0]][0] if row else -1.0


CASES: Mapping[str, str] = MappingProxyType(
    {
        "A": "123456",
        "B": "123456abc",
        "C": "123456ghi",
        "D": "123456def",
        "E": POSITIONS,
    }
)
