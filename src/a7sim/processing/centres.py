"""Perspective centres from files of pointings and grid-plate readings."""

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import GON, Array
from a7sim.processing.outcome import ProcessingResult, errors_for, points_csv
from a7sim.processing.reading import point_columns, point_names, read_points
from a7sim.reduction.centres import (
    PerspectiveCentre,
    a8_centres,
    grid_plate_centre,
    perspective_centre,
    perspective_centre_of_levels,
)
from a7sim.reduction.resection import ELEMENTS
from a7sim.reduction.strips import CENTRE
from a7sim.result_documents import Document, document_header, points_as_rows, statistics_document
from a7sim.table_files import natural_sort_key, read_table, rows_by_key, to_csv

CentreMethod = Literal["two-levels", "levels", "grid", "a8"]

CENTRE_METHODS: tuple[CentreMethod, ...] = ("two-levels", "levels", "grid", "a8")

UNKNOWNS = ("X0", "Y0", "Z0", "T0")


def centres(
    path: Path,
    z1: float = 4900.0,
    z2: float = 5100.0,
    method: CentreMethod = "two-levels",
    c: float | None = None,
) -> ProcessingResult:
    """Return the perspective centre of a file of pointings; with the base scale of the A8, both centres of each model.

    The levels z1 and z2 apply to the method of two levels, c, the principal distance of the projector, to a grid plate.
    Raises A7SimError.
    """
    if method == "a8":
        return _of_base_scale(path)
    if method == "grid":
        return _of_grid_plate(path, c)
    return _of_two_levels(path, z1, z2) if method == "two-levels" else _of_levels(path)


def _of_two_levels(path: Path, z1: float, z2: float) -> ProcessingResult:
    rows = read_points(path, ("X1", "Y1", "X2", "Y2"))
    if z1 == z2:
        raise A7SimError(f"--z1 and --z2: expected two different levels, got {z1:g} twice")
    pointings = point_columns(rows, ("X1", "Y1", "X2", "Y2"))
    with errors_for(path):
        found = perspective_centre(pointings[:2], pointings[2:], z1, z2)
    return _of_lines("two-levels", point_names(rows), found, {"levels": [z1, z2]})


def _of_levels(path: Path) -> ProcessingResult:
    rows = read_table(path).rows(["point"], ["level", "X", "Y"])
    by_level: dict[tuple[str, float], Array] = {}
    for row in rows:
        key = row.texts["point"], row.numbers["level"]
        if key in by_level:
            raise A7SimError(
                f"{path}, {row.location}, column level: expected point {key[0]} once at every level, "
                f"got it twice at {key[1]:g}"
            )
        by_level[key] = np.array([row.numbers["X"], row.numbers["Y"]])
    points = sorted({point for point, _ in by_level}, key=natural_sort_key)
    levels = sorted({level for _, level in by_level})
    for point in points:
        for level in levels:
            if (point, level) not in by_level:
                raise A7SimError(f"{path}: expected every point at every level, got none of point {point} at {level:g}")
    pointings = np.array([[by_level[point, level] for point in points] for level in levels])
    with errors_for(path):
        found = perspective_centre_of_levels(np.moveaxis(pointings, 2, 0), levels)
    extra: Document = {"levels": levels}
    if found.pointing_rms is not None:
        extra["pointing_rms"] = float(found.pointing_rms)
    return _of_lines("levels", tuple(points), found, extra)


def _of_lines(method: str, points: tuple[str, ...], found: PerspectiveCentre, extra: Document) -> ProcessingResult:
    document = document_header("reduce centres") | {"method": method}
    document |= {name: float(getattr(found, name)) for name in UNKNOWNS}
    document |= {f"sigma_{name}": float(getattr(found, f"sigma_{name}")) for name in UNKNOWNS}
    document |= {"rms": float(found.rms), "redundancy": 2 * len(points) - 3}
    document |= {"residuals": points_as_rows(points, found.residuals[:2])} | extra
    return ProcessingResult(document, {"residuals.csv": lambda: _residuals_csv(document["residuals"])})


def _of_grid_plate(path: Path, c: float | None) -> ProcessingResult:
    if c is None:
        raise A7SimError("--method grid: expected the projector's principal distance (--c), got none")
    rows = read_points(path, ("x", "y", "X", "Y", "Z"))
    values, points = point_columns(rows, ("x", "y", "X", "Y", "Z")), point_names(rows)
    with errors_for(path):
        found = grid_plate_centre(values[:2], values[2:4], values[4], c)
    document = document_header("reduce centres") | {"method": "grid", "c_mm": c}
    document |= dict(zip(("X0", "Y0", "Z0"), found.centre.tolist(), strict=True))
    document |= dict(zip(("sigma_X0", "sigma_Y0", "sigma_Z0"), found.sigma_centre.tolist(), strict=True))
    angles, sigmas = (found.angles / GON).tolist(), (found.sigma_angles / GON).tolist()
    document["angles"] = {
        name: {"value": value, "sigma": sigma} for name, value, sigma in zip(ELEMENTS[:3], angles, sigmas, strict=True)
    }
    observations = [f"{point} {axis}" for axis in "xy" for point in points]
    document |= {
        "rotation": found.rotation.tolist(),
        "s0_mm": float(found.s0),
        "iterations": int(found.iterations),
        "statistics": statistics_document(found.adjustment, ELEMENTS, observations),
        "residuals": points_as_rows(points, found.residuals),
    }
    return ProcessingResult(document, {"residuals.csv": lambda: _residuals_csv(document["residuals"])})


def _of_base_scale(path: Path) -> ProcessingResult:
    table = read_table(path)
    rows = rows_by_key(path, table.rows(["model"], ["base", "column", "height"]), "model")
    names = sorted((name for (name,) in rows), key=natural_sort_key)
    base, column, height = point_columns([rows[name,] for name in names], ("base", "column", "height"))
    if not (base > 0.0).all():
        row = next(row for row in rows.values() if not row.numbers["base"] > 0.0)
        raise A7SimError(
            f"{path}, {row.location}, column base: expected a base above 0 mm, got {row.numbers['base']:g}"
        )
    left, right = a8_centres(base, column, height)
    document = document_header("reduce centres") | {
        "method": "a8",
        "models": {name: {"left": left[:, i].tolist(), "right": right[:, i].tolist()} for i, name in enumerate(names)},
    }
    ends = [f"{name} {side}{CENTRE}" for side in ("left", "right") for name in names]
    return ProcessingResult(document, {"points.csv": lambda: points_csv(ends, np.concatenate([left, right], axis=1))})


def _residuals_csv(residuals: Mapping[str, list[float]]) -> str:
    return to_csv(("point", "x", "y"), [(point, *values) for point, values in residuals.items()])
