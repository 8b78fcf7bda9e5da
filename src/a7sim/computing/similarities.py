"""The similarity of people's common points."""

from pathlib import Path
from typing import Literal

from a7sim.computing.comparing import methods_csv, of_methods
from a7sim.computing.outcome import Outcome, blamed_on
from a7sim.computing.reading import columns_of, names_of, read_points
from a7sim.documents import Document, by_point, head, of_similarity, of_statistics
from a7sim.files import csv_text
from a7sim.geometry import GON
from a7sim.reduction.similarity import Similarity, similarity_by_iteration, similarity_by_quaternion

SimilarityMethod = Literal["iteration", "quaternion", "both"]

SIMILARITY_METHODS: tuple[SimilarityMethod, ...] = ("iteration", "quaternion", "both")

ANGLES, SHIFTS = ("omega", "phi", "kappa"), ("Tx", "Ty", "Tz")

_BY = {"iteration": similarity_by_iteration, "quaternion": similarity_by_quaternion}


def similarity(path: Path, method: SimilarityMethod = "iteration") -> Outcome:
    """Return the similarity of a file of common points; with both methods, by iteration and the other beside it.

    Raises Mistake.
    """
    rows = read_points(path, ("x", "y", "z", "X", "Y", "Z"))
    points, values = names_of(rows), columns_of(rows, ("x", "y", "z", "X", "Y", "Z"))
    with blamed_on(path):
        found = {name: by(values[:3], values[3:]) for name, by in _BY.items() if method in (name, "both")}
        name, first = next(iter(found.items()))
        document = head("reduce similarity") | {"method": name} | of_common(first, points)
    files = {
        "residuals.csv": lambda: csv_text(
            ("point", "X", "Y", "Z"), [(point, *v) for point, v in document["residuals"].items()]
        )
    }
    if method == "both":
        document["compare"] = compared = of_methods(_quantities(found))
        files["compare.csv"] = lambda: methods_csv(compared)
    return Outcome(document, files)


def of_common(found: Similarity, points: tuple[str, ...]) -> Document:
    """Return a similarity on named points with its statistics, angles in gon."""
    sigmas = [found.sigma_scale, *(found.sigma_angles / GON), *found.sigma_translation]
    observations = [f"{point} {axis}" for axis in "XYZ" for point in points]
    return of_similarity(found) | {
        "angles": dict(zip(ANGLES, (found.angles / GON).tolist(), strict=True)),
        "sigma": {name: float(sigma) for name, sigma in zip(("scale", *ANGLES, *SHIFTS), sigmas, strict=True)},
        "s0": float(found.s0),
        "iterations": found.iterations,
        "residuals": by_point(points, found.residuals),
        "statistics": of_statistics(found.adjustment, ("scale", *ANGLES, *SHIFTS), observations),
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
