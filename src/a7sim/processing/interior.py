"""Interior orientation of comparator counts from files."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import msgspec
import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import GON, Array
from a7sim.processing.outcome import ProcessingResult, errors_for
from a7sim.processing.reading import group_rows, point_columns, point_names
from a7sim.reduction.corrections import corrected_image
from a7sim.reduction.interior import PlaneFit, plane_fit, principal_distance_for_film
from a7sim.result_documents import Document, document_header, points_as_rows, statistics_document
from a7sim.scenario import Camera
from a7sim.scenario.validation import schema_errors
from a7sim.table_files import Row, natural_sort_key, read_table, read_toml, to_csv

CORRECTIONS = ("lens", "refraction", "curvature")
"""Corrections of image coordinates; each of them refers these to the principal point."""

MAX_FIDUCIAL_MM = 5.0
"""Maximum displacement of a fiducial by film; a confused or mirrored fiducial deviates more."""


@dataclass(frozen=True)
class FlightHeights:
    """Heights above the sea in m of the camera and of the mean ground."""

    flying_height: float
    ground_height: float = 0.0


@dataclass(frozen=True)
class _Picture:
    """Photograph with its fit and its refined points ``(2, n)`` in mm."""

    name: str
    fiducials: tuple[str, ...]
    fit: PlaneFit
    points: tuple[str, ...]
    image: Array


def interior(
    path: Path,
    camera_path: Path,
    kind: str = "affine",
    count_mm: float | None = None,
    corrections: Sequence[str] = (),
    flight: FlightHeights | None = None,
) -> ProcessingResult:
    """Return the interior orientation of each photograph in a file of counts, and its refined image points.

    `count_mm` is the size of a count, which determines the change of the film's size. Raises A7SimError.
    """
    camera = read_camera(camera_path)
    found = group_rows(read_table(path), "photo", "xy")
    pictures = [
        _picture(path, name, found[name], camera, kind, corrections, flight)
        for name in sorted(found, key=natural_sort_key)
    ]
    document = document_header("reduce interior") | {
        "method": kind,
        "camera": {"name": camera.name, "c_mm": camera.c, "principal_point_mm": list(camera.principal_point)},
        "corrections": list(corrections),
        "about": "principal point" if corrections else "fiducial centre",
        "photographs": [_of_picture(picture, camera, count_mm) for picture in pictures],
        "warnings": [warning for picture in pictures for warning in _warnings(picture, camera)],
    }
    files = {
        "image.csv": lambda: to_csv(("photo", "point", "x", "y"), _image_rows(pictures)),
        "residuals.csv": lambda: to_csv(("photo", "point", "x", "y"), _residual_rows(pictures)),
    }
    if len(pictures) > 1:
        files["pairs.csv"] = lambda: to_csv(("model", "point", "xl", "yl", "xr", "yr"), _pair_rows(pictures))
    return ProcessingResult(document, files)


def read_camera(path: Path) -> Camera:
    """Return the camera of a TOML file in the form of a scenario: under `[camera]` or at the top. Raises A7SimError."""
    raw = read_toml(path)
    raw = raw.get("camera", raw)
    wrong = next(schema_errors(raw, msgspec.inspect.type_info(Camera), "camera"), None)
    if wrong:
        raise A7SimError(f"{path}: {wrong}")
    return msgspec.convert(raw, Camera)


def _picture(
    path: Path,
    name: str,
    rows: Sequence[Row],
    camera: Camera,
    kind: str,
    corrections: Sequence[str],
    flight: FlightHeights | None,
) -> _Picture:
    calibrated = {fiducial.name: (fiducial.x, fiducial.y) for fiducial in camera.fiducials}
    fiducials = [row for row in rows if row.texts["point"] in calibrated]
    others = [row for row in rows if row.texts["point"] not in calibrated]
    names = point_names(fiducials)
    with errors_for(path, f"photo {name}"):
        places = np.array([calibrated[each] for each in names]).reshape((-1, 2)).T
        fit = plane_fit(point_columns(fiducials, "xy"), places, kind)
        _refuse_confused(fit, names)
        image = fit.calibrated(point_columns(others, "xy").reshape((2, -1)))
        if corrections:
            image = _corrected(image, camera, corrections, flight)
    return _Picture(name, names, fit, point_names(others), image)


def _refuse_confused(fit: PlaneFit, names: Sequence[str]) -> None:
    off = np.hypot(*fit.residuals)
    worst = int(np.argmax(off))
    if off[worst] > MAX_FIDUCIAL_MM:
        raise A7SimError(
            f"expected counts of the fiducials that lie as in the camera, got {names[worst]} {off[worst]:.1f} mm from "
            "its place (are two confused, or the axes mirrored?)"
        )


def _corrected(image: Array, camera: Camera, corrections: Sequence[str], flight: FlightHeights | None) -> Array:
    if flight is None and set(corrections) & {"refraction", "curvature"}:
        raise A7SimError("expected --flying-height for the corrections of refraction and curvature, got none")
    return corrected_image(
        image,
        camera.c,
        principal_point=camera.principal_point,
        distortion=camera.distortion if "lens" in corrections else (),
        flying_height_m=flight.flying_height if flight else None,
        ground_height_m=flight.ground_height if flight else 0.0,
        refraction="refraction" in corrections,
        curvature="curvature" in corrections,
    )


def _warnings(picture: _Picture, camera: Camera) -> list[str]:
    warnings = []
    if np.linalg.det(_at_the_centre(picture.fit.matrix)) < 0.0:
        warnings.append(
            f"photo {picture.name}: the counts are mirrored against the camera's axes, or fiducials are confused"
        )
    missing = [fiducial.name for fiducial in camera.fiducials if fiducial.name not in picture.fiducials]
    if missing:
        warnings.append(f"photo {picture.name}: fiducials without counts: {', '.join(missing)}")
    return warnings


def _of_picture(picture: _Picture, camera: Camera, count_mm: float | None) -> Document:
    fit = picture.fit
    sigmas = fit.sigmas
    observations = [f"{name} {axis}" for axis in "xy" for name in picture.fiducials]
    return {
        "photo": picture.name,
        "unknowns": {
            name: {"value": float(value), "sigma": float(sigmas[name])} for name, value in fit.unknowns.items()
        },
        "matrix": fit.matrix.tolist(),
        "residuals_mm": points_as_rows(picture.fiducials, fit.residuals),
        "s0_mm": float(fit.adjustment.s0),
        "iterations": int(fit.iterations),
        "statistics": statistics_document(fit.adjustment, list(fit.unknowns), observations),
        "film": _of_film(fit, camera.c, count_mm),
        "points": points_as_rows(picture.points, picture.image),
    }


def _of_film(fit: PlaneFit, c: float, count_mm: float | None) -> Document:
    """Return the film deformation at its centre; its size only if the size of a count is known."""
    jacobian = _at_the_centre(fit.matrix)
    per_x, per_y = np.hypot(*jacobian[:, 0]), np.hypot(*jacobian[:, 1])
    right_angle = np.arcsin(np.clip((jacobian[:, 0] * jacobian[:, 1]).sum() / (per_x * per_y), -1.0, 1.0))
    film: Document = {"mm_per_count": [float(per_x), float(per_y)], "shear_gon": float(right_angle / GON)}
    if count_mm is None:
        return film
    return film | {
        "shrinkage_ppm": [1e6 * float(per_x / count_mm - 1.0), 1e6 * float(per_y / count_mm - 1.0)],
        "scale": float(fit.film_scale * count_mm),
        "principal_distance_mm": float(principal_distance_for_film(c * count_mm, fit)),
    }


def _at_the_centre(matrix: Array) -> Array:
    """Return the derivatives ``(2, 2)`` of calibrated by measured coordinates at the calibrated zero."""
    x, y, w = np.linalg.inv(matrix) @ (0.0, 0.0, 1.0)
    return np.asarray(matrix[:2, :2] / (matrix[2] @ (x / w, y / w, 1.0)))


def _image_rows(pictures: Sequence[_Picture]) -> list[tuple[str, str, float, float]]:
    return [
        (picture.name, point, float(x), float(y))
        for picture in pictures
        for point, x, y in zip(picture.points, *picture.image, strict=True)
    ]


def _residual_rows(pictures: Sequence[_Picture]) -> list[tuple[str, str, float, float]]:
    return [
        (picture.name, point, float(x), float(y))
        for picture in pictures
        for point, x, y in zip(picture.fiducials, *picture.fit.residuals, strict=True)
    ]


def _pair_rows(pictures: Sequence[_Picture]) -> list[tuple[str, str, float, float, float, float]]:
    """Return the pairs of photographs of consecutive numbers; in the left one the common points are further right."""
    rows = []
    for one, other in pairwise(pictures):
        seen, seen_there = _by_point(one), _by_point(other)
        common = [point for point in one.points if point in seen_there]
        if sum(seen[point][0] - seen_there[point][0] for point in common) >= 0.0:
            rows += [(f"{one.name}-{other.name}", point, *seen[point], *seen_there[point]) for point in common]
        else:
            rows += [(f"{other.name}-{one.name}", point, *seen_there[point], *seen[point]) for point in common]
    return rows


def _by_point(picture: _Picture) -> Mapping[str, tuple[float, float]]:
    return {point: (float(x), float(y)) for point, x, y in zip(picture.points, *picture.image, strict=True)}
