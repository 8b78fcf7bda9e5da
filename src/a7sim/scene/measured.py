"""Photographs known only by measured image coordinates."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.scenario.schema import FORMAT_MM, Camera, Measured
from a7sim.scene.camera import fiducial_places
from a7sim.scene.photograph import NamedPoints
from a7sim.table_files import read_rows, rows_by_key

MIN_FIDUCIALS = 3

MAX_FIDUCIAL_MM = 5.0
"""Maximum displacement of a fiducial by film and an uncertain count; a confused fiducial deviates more."""


def measured_marks(measured: Measured, name: str, camera: Camera) -> tuple[NamedPoints, NamedPoints]:
    """Return fiducials and points of a photograph from its file, in mm on film.

    Coordinates in mm are refined to the calibrated fiducials. Counts are multiplied by the size of a count and fitted
    to the fiducials without scaling, so that film shrinkage remains in them. Raises A7SimError with file, line and
    column.
    """
    path = Path(measured.file)
    if measured.side:
        x, y = ("xl", "yl") if measured.side == "left" else ("xr", "yr")
        by_point = rows_by_key(path, read_rows(path, ["point"], [x, y]), "point")
        found = {key[0]: (row.numbers[x], row.numbers[y]) for key, row in by_point.items()}
    else:
        by_photo = rows_by_key(path, read_rows(path, ["photo", "point"], ["x", "y"]), "photo", "point")
        wanted = measured.photo or name
        found = {key[1]: (row.numbers["x"], row.numbers["y"]) for key, row in by_photo.items() if key[0] == wanted}
        if not found:
            raise A7SimError(f"{path}, column photo: expected rows of photograph {wanted!r}, got none")
    for point in found:
        if not re.fullmatch(r"[ !#-~]{1,64}", point):
            raise A7SimError(
                f"{path}, column point: expected 1 to 64 ASCII characters without quotes, got {point[:80]!r}"
            )
    names, calibrated = fiducial_places(camera)
    if measured.units == "counts":
        return _from_counts(path, found, names, calibrated, measured.count_mm)
    for point, place in found.items():
        if max(map(abs, place)) > FORMAT_MM / 2.0:
            raise A7SimError(f"{path}: expected mm within the {FORMAT_MM:.0f} mm format, got {place} for point {point}")
    return NamedPoints(names, calibrated), NamedPoints(tuple(found), np.array(list(found.values())).T)


def _from_counts(
    path: Path,
    found: dict[str, tuple[float, float]],
    names: tuple[str, ...],
    calibrated: Array,
    count_mm: float | None,
) -> tuple[NamedPoints, NamedPoints]:
    seen = [name for name in names if name in found]
    if len(seen) < MIN_FIDUCIALS:
        raise A7SimError(
            f"{path}, column point: expected {MIN_FIDUCIALS} or more of the fiducials {', '.join(names)} "
            f"among the counts, got {len(seen)}"
        )
    counts = np.array([found[name] for name in seen]).T
    places = calibrated[:, [names.index(name) for name in seen]]
    to_film = _laid_over(counts, places, count_mm)
    off = np.abs(to_film(counts) - places).max(axis=0)
    if not (off < MAX_FIDUCIAL_MM).all():
        worst = seen[int(np.nanargmax(np.nan_to_num(off, nan=np.inf)))]
        raise A7SimError(
            f"{path}, column point: expected counts of the fiducials that lie as in the camera, "
            f"got {worst} more than {MAX_FIDUCIAL_MM:.0f} mm from its place"
        )
    others = [name for name in found if name not in names]
    all_points = np.array([found[name] for name in others]).reshape(-1, 2).T
    return NamedPoints(tuple(seen), to_film(counts)), NamedPoints(tuple(others), to_film(all_points))


def _laid_over(counts: Array, places: Array, count_mm: float | None) -> Callable[[Array], Array]:
    """Return the similarity without scale, mirrored if the comparator counts so, that fits counts to the fiducials."""
    from_mean = counts.mean(axis=1, keepdims=True)
    to_mean = places.mean(axis=1, keepdims=True)
    u, v = counts - from_mean, places - to_mean
    flip = np.diag([1.0, 1.0 if np.linalg.det(v @ u.T) >= 0.0 else -1.0])
    u = flip @ u
    along = float((u * v).sum())
    across = float((u[0] * v[1] - u[1] * v[0]).sum())
    angle = np.arctan2(across, along)
    spread = float((u * u).sum())
    scale = count_mm or (float(np.hypot(along, across)) / spread if spread else 0.0)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    return lambda each: np.asarray(scale * turn @ flip @ (each - from_mean) + to_mean)
