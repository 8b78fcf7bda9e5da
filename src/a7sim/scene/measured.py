"""Photographs known only by image coordinates that somebody measured."""

from pathlib import Path

import numpy as np

from a7sim.files import read_rows, unique
from a7sim.geometry import Array
from a7sim.mistakes import Mistake
from a7sim.scenario.schema import Camera, Measured
from a7sim.scene.camera import fiducial_places
from a7sim.scene.photograph import Marks

FEWEST_FIDUCIALS = 3


def measured_marks(measured: Measured, name: str, camera: Camera) -> tuple[Marks, Marks]:
    """Return fiducials and points of a photograph from its file, in mm on film.

    Coordinates in mm are taken as refined to the calibrated fiducials. Counts are brought to mm by the
    size of a count and laid over the fiducials without stretching, so that film shrinkage stays in them.
    Raises Mistake with file, line and column.
    """
    path = Path(measured.file)
    if measured.side:
        x, y = ("xl", "yl") if measured.side == "left" else ("xr", "yr")
        by_point = unique(path, read_rows(path, ["point"], [x, y]), "point")
        found = {key[0]: (row.numbers[x], row.numbers[y]) for key, row in by_point.items()}
    else:
        by_photo = unique(path, read_rows(path, ["photo", "point"], ["x", "y"]), "photo", "point")
        wanted = measured.photo or name
        found = {key[1]: (row.numbers["x"], row.numbers["y"]) for key, row in by_photo.items() if key[0] == wanted}
        if not found:
            raise Mistake(f"{path}, column photo: expected rows of photograph {wanted!r}, got none")
    names, calibrated = fiducial_places(camera)
    if measured.units == "counts":
        return _from_counts(path, found, names, calibrated, measured.count_mm)
    points = {key: value for key, value in found.items() if key not in names}
    return Marks(names, calibrated), Marks(tuple(points), np.array(list(points.values())).reshape(-1, 2).T)


def _from_counts(
    path: Path,
    found: dict[str, tuple[float, float]],
    names: tuple[str, ...],
    calibrated: Array,
    count_mm: float | None,
) -> tuple[Marks, Marks]:
    seen = [name for name in names if name in found]
    if len(seen) < FEWEST_FIDUCIALS:
        raise Mistake(
            f"{path}, column point: expected {FEWEST_FIDUCIALS} or more of the fiducials {', '.join(names)} "
            f"among the counts, got {len(seen)}"
        )
    counts = np.array([found[name] for name in seen]).T
    places = calibrated[:, [names.index(name) for name in seen]]
    to_film = _laid_over(counts, places, count_mm)
    others = [name for name in found if name not in names]
    all_points = np.array([found[name] for name in others]).reshape(-1, 2).T
    return Marks(tuple(seen), to_film(counts)), Marks(tuple(others), to_film(all_points))


class _laid_over:  # noqa: N801 - used as a function
    """The similarity, mirrored where the comparator counts so, that lays counts over the fiducials."""

    def __init__(self, counts: Array, places: Array, count_mm: float | None) -> None:
        self.from_mean = counts.mean(axis=1, keepdims=True)
        self.to_mean = places.mean(axis=1, keepdims=True)
        u, v = counts - self.from_mean, places - self.to_mean
        self.flip = np.diag([1.0, np.sign(np.linalg.det(v @ u.T))])
        u = self.flip @ u
        along = float((u * v).sum())
        across = float((u[0] * v[1] - u[1] * v[0]).sum())
        angle = np.arctan2(across, along)
        self.scale = count_mm or float(np.hypot(along, across) / (u * u).sum())
        self.turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])

    def __call__(self, counts: Array) -> Array:
        return np.asarray(self.scale * self.turn @ self.flip @ (counts - self.from_mean) + self.to_mean)
