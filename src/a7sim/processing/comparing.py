"""Comparisons of results: several methods on the same observations, and final coordinates with given ones."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.processing.reading import point_columns, point_names, read_points
from a7sim.reduction.absolute import max_abs_residual, root_mean_square
from a7sim.result_documents import Document, points_as_rows
from a7sim.table_files import to_csv

Quantities = Mapping[tuple[str, str], Mapping[str, float]]
"""Values by method, by name and unit of the quantity."""


def compare_methods(quantities: Quantities) -> Document:
    """Return the values of several methods side by side, and the largest difference by unit."""
    rows: list[Document] = []
    most: dict[str, float] = {}
    for (name, unit), values in quantities.items():
        difference = max(values.values()) - min(values.values())
        rows.append({"quantity": name, "unit": unit, "values": dict(values), "difference": difference})
        most[unit] = max(most.get(unit, 0.0), difference)
    return {"rows": rows, "largest_difference": most}


def methods_csv(compared: Document) -> str:
    """Return the values of several methods as CSV, to twelve digits."""
    rows = compared["rows"]
    methods = list(rows[0]["values"])
    return to_csv(
        ("quantity", "unit", *methods, "difference"),
        (
            (row["quantity"], row["unit"], *(f"{row['values'][m]:.12g}" for m in methods), f"{row['difference']:.3e}")
            for row in rows
        ),
    )


def compare_to_reference(path: Path, points: Sequence[str], coordinates: Array) -> Document:
    """Return the differences of final coordinates ``(3, n)`` from those of a file, computed minus given.

    Raises A7SimError.
    """
    place = {name: i for i, name in enumerate(points)}
    rows = [row for row in read_points(path, "XYZ", gaps="XYZ") if row.texts["point"] in place]
    if not rows:
        raise A7SimError(f"{path}, column point: expected points that were computed, got none of them")
    names, given = point_names(rows), point_columns(rows, "XYZ")
    differences = coordinates[:, [place[name] for name in names]] - given
    return {
        "points": len(names),
        "rms": dict(zip("XYZ", root_mean_square(differences).tolist(), strict=True)),
        "largest": dict(zip("XYZ", max_abs_residual(differences).tolist(), strict=True)),
        "given": points_as_rows(names, given),
        "differences": points_as_rows(names, differences),
    }


def comparison_csv(compared: Document) -> str:
    """Return given coordinates and computed minus given as CSV."""
    given = compared["given"]
    return to_csv(
        ("point", "X", "Y", "Z", "dX", "dY", "dZ"),
        ((name, *given[name], *difference) for name, difference in compared["differences"].items()),
    )
