"""Reading of measurements from files for the reductions.

Points are sorted by name, so that the order of rows in a file does not change any digit of a result.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.reduction.absolute import ROLES, Ground
from a7sim.reduction.cards import is_deck, read_cards
from a7sim.reduction.strips import CENTRE, Model, in_order
from a7sim.table_files import Row, Table, natural_sort_key, read_table, read_text, rows_by_key

PAIR_COLUMNS = ("xl", "yl", "xr", "yr")

_NEEDED = {"control": "XYZ", "plan": "XY", "height": "Z", "check": ""}


@dataclass(frozen=True)
class StereoPair:
    """Image coordinates ``(2, n)`` in mm of points in two photographs, about the principal point."""

    name: str
    points: tuple[str, ...]
    left: Array
    right: Array


def is_pair_table(table: Table) -> bool:
    """Return whether a table holds image coordinates of pairs rather than models."""
    return any(column in table.columns for column in PAIR_COLUMNS)


def point_names(rows: Sequence[Row]) -> tuple[str, ...]:
    """Return the point names of rows."""
    return tuple(row.texts["point"] for row in rows)


def point_columns(rows: Sequence[Row], names: Sequence[str]) -> Array:
    """Return columns ``(len(names), n)`` of rows."""
    return np.array([[row.numbers[name] for row in rows] for name in names])


def read_points(path: Path, numbers: Sequence[str], gaps: Sequence[str] = ()) -> list[Row]:
    """Return the rows of a file of points, sorted by name; each point occurs once. Raises A7SimError."""
    rows = rows_by_key(path, read_table(path).rows(["point"], numbers, gaps), "point").values()
    return sorted(rows, key=lambda row: natural_sort_key(row.texts["point"]))


def group_rows(table: Table, group: str, numbers: Sequence[str], may_be_one: bool = False) -> dict[str, list[Row]]:
    """Return the rows of a table by the text of a column; each point occurs once per group. Raises A7SimError.

    Groups are in the order of the file, their points sorted by name. A table that `may_be_one` group needs no such
    column; the group then has the name of the file.
    """
    if may_be_one and group not in table.columns:
        rows = rows_by_key(table.path, table.rows(["point"], numbers), "point").values()
        return {table.path.stem: sorted(rows, key=lambda row: natural_sort_key(row.texts["point"]))}
    found: dict[str, list[Row]] = {}
    for row in rows_by_key(table.path, table.rows([group, "point"], numbers), group, "point").values():
        found.setdefault(row.texts[group], []).append(row)
    return {name: sorted(rows, key=lambda row: natural_sort_key(row.texts["point"])) for name, rows in found.items()}


def read_pairs(table: Table, principal_point: tuple[float, float], may_be_one: bool = False) -> list[StereoPair]:
    """Return the pairs of a table in the order of the file. Raises A7SimError."""
    shift = np.array(principal_point)[:, None]
    pairs = []
    for name, rows in group_rows(table, "model", PAIR_COLUMNS, may_be_one).items():
        measured = point_columns(rows, PAIR_COLUMNS)
        pairs.append(StereoPair(name, point_names(rows), measured[:2] - shift, measured[2:] - shift))
    return pairs


def read_models_table(table: Table, may_be_one: bool = False) -> list[Model]:
    """Return the models of a table, by name. Raises A7SimError."""
    found = group_rows(table, "model", "XYZ", may_be_one)
    return [
        Model(name, point_names(found[name]), point_columns(found[name], "XYZ"))
        for name in sorted(found, key=natural_sort_key)
    ]


def read_models(paths: Sequence[Path], may_be_one: bool = False) -> list[Model]:
    """Return the models of all files, tables or decks of cards, by name.

    Raises A7SimError, also for a model that occurs in two files.
    """
    found: dict[str, tuple[Path, Model]] = {}
    for path in paths:
        text = read_text(path)
        here = (
            read_cards(path, text).models
            if is_deck(path, text)
            else read_models_table(read_table(path, text), may_be_one)
        )
        for model in here:
            if model.name in found:
                raise A7SimError(f"{path}: expected models of its own, got {model.name} as in {found[model.name][0]}")
            found[model.name] = path, model
    return sorted((model for _, model in found.values()), key=lambda model: natural_sort_key(model.name))


def short_list(paths: Sequence[Path]) -> str:
    """Return the names of files, the first three of them."""
    return ", ".join(map(str, paths[:3])) + (" ..." if len(paths) > 3 else "")


def read_ground(path: Path) -> Ground:
    """Return the ground points of a file; cells that a role does not need may be empty. Raises A7SimError."""
    rows = rows_by_key(path, read_table(path).rows(["point", "role"], "XYZ", gaps="XYZ"), "point").values()
    for row in rows:
        role = row.texts["role"]
        if role not in ROLES:
            raise A7SimError(
                f"{path}, {row.location}, column role: expected control, plan, height or check, got {role[:40]!r}"
            )
        empty = [axis for axis in "XYZ" if np.isnan(row.numbers[axis])]
        missing = [axis for axis in _NEEDED[role] if axis in empty] or (empty if len(empty) == 3 else [])
        if missing:
            raise A7SimError(
                f"{path}, {row.location}, column {missing[0]}: expected a number at a {role} point, got nothing"
            )
    ordered = sorted(rows, key=lambda row: natural_sort_key(row.texts["point"]))
    return Ground(point_names(ordered), point_columns(ordered, "XYZ"), tuple(row.texts["role"] for row in ordered))


def model_photographs(model: str) -> tuple[str, str] | None:
    """Return the photographs in the name of a model (`321-320`), or None."""
    left, dash, right = (part.strip() for part in model.partition("-"))
    return (left, right) if dash and left and right else None


def sort_along_strip(models: Sequence[Model]) -> tuple[Model, ...]:
    """Return models in the order of the strip, whatever order they were given in.

    A strip of models named LEFT-RIGHT starts with the model whose left photograph is no other model's right one,
    another strip with the end of the lower name; models without a common centre are sorted by name. Raises A7SimError
    as `in_order` does.
    """
    chain = in_order(sorted(models, key=lambda model: natural_sort_key(model.name)))
    if len(chain) < 2:
        return chain
    photographs = model_photographs(chain[0].name), model_photographs(chain[-1].name)
    if photographs[0] and photographs[1]:
        backwards = f"{photographs[0][0]}{CENTRE}" in chain[1].points
    else:
        backwards = natural_sort_key(chain[-1].name) < natural_sort_key(chain[0].name)
    return chain[::-1] if backwards and set(chain[0].centres) & set(chain[1].centres) else chain
