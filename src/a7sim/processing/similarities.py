"""Similarity transformation of common points from files."""

from pathlib import Path
from typing import Literal

from a7sim.geometry import GON
from a7sim.processing.comparing import compare_methods, methods_csv
from a7sim.processing.outcome import ProcessingResult, errors_for
from a7sim.processing.reading import point_columns, point_names, read_points
from a7sim.reduction.similarity import Similarity, similarity_by_iteration, similarity_by_quaternion
from a7sim.result_documents import Document, document_header, points_as_rows, similarity_document, statistics_document
from a7sim.table_files import to_csv

SimilarityMethod = Literal["iteration", "quaternion", "both"]

SIMILARITY_METHODS: tuple[SimilarityMethod, ...] = ("iteration", "quaternion", "both")

ANGLES, SHIFTS = ("omega", "phi", "kappa"), ("Tx", "Ty", "Tz")

_BY = {"iteration": similarity_by_iteration, "quaternion": similarity_by_quaternion}


def similarity(path: Path, method: SimilarityMethod = "iteration") -> ProcessingResult:
    """Return the similarity of a file of common points; with both methods, iteration compared with the other.

    Raises A7SimError.
    """
    rows = read_points(path, ("x", "y", "z", "X", "Y", "Z"))
    points, values = point_names(rows), point_columns(rows, ("x", "y", "z", "X", "Y", "Z"))
    with errors_for(path):
        found = {name: by(values[:3], values[3:]) for name, by in _BY.items() if method in (name, "both")}
        name, first = next(iter(found.items()))
        document = document_header("reduce similarity") | {"method": name} | common_points_document(first, points)
    files = {
        "residuals.csv": lambda: to_csv(
            ("point", "X", "Y", "Z"), [(point, *v) for point, v in document["residuals"].items()]
        )
    }
    if method == "both":
        document["compare"] = compared = compare_methods(_quantities(found))
        files["compare.csv"] = lambda: methods_csv(compared)
    return ProcessingResult(document, files)


def common_points_document(found: Similarity, points: tuple[str, ...]) -> Document:
    """Return a similarity on named points with its statistics, angles in gon."""
    sigmas = [found.sigma_scale, *(found.sigma_angles / GON), *found.sigma_translation]
    observations = [f"{point} {axis}" for axis in "XYZ" for point in points]
    return similarity_document(found) | {
        "angles": dict(zip(ANGLES, (found.angles / GON).tolist(), strict=True)),
        "sigma": {name: float(sigma) for name, sigma in zip(("scale", *ANGLES, *SHIFTS), sigmas, strict=True)},
        "s0": float(found.s0),
        "iterations": found.iterations,
        "residuals": points_as_rows(points, found.residuals),
        "statistics": statistics_document(found.adjustment, ("scale", *ANGLES, *SHIFTS), observations),
    }


def _quantities(found: dict[str, Similarity]) -> dict[tuple[str, str], dict[str, float]]:
    values = {
        name: {("scale", ""): float(each.scale)}
        | {(angle, "gon"): float(value) for angle, value in zip(ANGLES, each.angles / GON, strict=True)}
        | {(shift, "unit of X"): float(value) for shift, value in zip(SHIFTS, each.translation, strict=True)}
        | {("s0", "unit of X"): float(each.s0)}
        for name, each in found.items()
    }
    return {key: {name: each[key] for name, each in values.items()} for key in next(iter(values.values()))}
