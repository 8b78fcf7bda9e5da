"""Relative orientation of pairs from files."""

from collections.abc import Sequence
from pathlib import Path
from typing import Literal

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array, ray_of, stereoscopic_intersection
from a7sim.processing.comparing import compare_methods, methods_csv
from a7sim.processing.outcome import ProcessingResult, errors_for, models_csv
from a7sim.processing.reading import StereoPair, model_photographs, read_pairs
from a7sim.reduction.coplanarity import RelativeOrientation, Unknowns, relative_orientation
from a7sim.reduction.hallert import orientation_by_parallaxes
from a7sim.reduction.modelling import model_coordinates
from a7sim.reduction.schut import orientation_by_schut
from a7sim.reduction.snooping import SnoopedOrientation, snooped_orientation
from a7sim.reduction.strips import CENTRE, Model
from a7sim.result_documents import Document, document_header, elements_document, points_as_rows, statistics_document
from a7sim.table_files import read_table, to_csv

RelativeMethod = Literal["coplanarity", "parallax", "schut", "robust", "all"]

RELATIVE_METHODS: tuple[RelativeMethod, ...] = ("coplanarity", "parallax", "schut", "robust", "all")

ALONG_X = 0.7
"""Cosine: a base closer to the X axis of the left photograph is oriented as at a plotter."""


def relative(
    path: Path,
    c: float,
    principal_point: tuple[float, float],
    unknowns: Unknowns,
    bx: float,
    method: RelativeMethod = "coplanarity",
) -> ProcessingResult:
    """Return the relative orientation of a pair file; with all methods, coplanarity compared with the others.

    Raises A7SimError.
    """
    if method in ("schut", "all") and unknowns != "dependent":
        raise A7SimError(f"--method {method}: expected dependent unknowns, got {unknowns}")
    pair = _only_pair(path, principal_point)
    methods = [each for each in RELATIVE_METHODS if each != "all"] if method == "all" else [method]
    found: dict[str, RelativeOrientation | SnoopedOrientation] = {}
    for name in methods:
        with errors_for(path, f"by {name}" if method == "all" else ""):
            found[name] = _oriented(pair, c, unknowns, bx, name)
    first = found[methods[0]]
    document = document_header("reduce relative") | {"method": methods[0]} | pair_document(pair, first, c, bx)
    photos = model_photographs(pair.name) or ("left", "right")
    model = add_centres(_without_blunders(pair, first), _orientation(first), c, bx, photos)
    files = {
        "models.csv": lambda: models_csv([model]),
        "residuals.csv": lambda: to_csv(("point", "p"), list(document["residual_y_parallax_mm"].items())),
    }
    if method == "all":
        document["compare"] = compared = _compared(pair, found, c, bx)
        document["robust"] = _of_snooping(found["robust"])
        files["compare.csv"] = lambda: methods_csv(compared)
    return ProcessingResult(document, files)


def _only_pair(path: Path, principal_point: tuple[float, float]) -> StereoPair:
    pairs = read_pairs(read_table(path), principal_point, may_be_one=True)
    if len(pairs) > 1:
        shown = ", ".join(pair.name for pair in pairs)[:80]
        raise A7SimError(
            f"{path}, column model: expected one pair, got {len(pairs)} ({shown}); `reduce strip` takes more"
        )
    return pairs[0]


def pair_document(pair: StereoPair, found: RelativeOrientation | SnoopedOrientation, c: float, bx: float) -> Document:
    """Return an oriented pair with its model, a base of length `bx` in the left photograph's frame."""
    orientation = _orientation(found)
    oriented_on = found.points if isinstance(found, SnoopedOrientation) else pair.points
    document = {
        "unknowns": list(orientation.unknowns),
        "rotation": orientation.rotation.tolist(),
        "base": orientation.base.tolist(),
        "elements": elements_document(orientation.elements, orientation.sigmas),
        "iterations": int(orientation.iterations),
        "converged": bool(orientation.converged),
        "condition": float(orientation.condition),
        "s0_mm": float(orientation.s0),
        "residual_y_parallax_mm": dict(zip(oriented_on, orientation.picture_parallaxes.tolist(), strict=True)),
        "statistics": statistics_document(orientation.adjustment, orientation.unknowns, oriented_on),
        "points": points_as_rows(pair.points, model_points(pair, orientation, c, bx)),
    }
    return document | _of_snooping(found)


def add_centres(
    pair: StereoPair, orientation: RelativeOrientation, c: float, bx: float, photos: tuple[str, str]
) -> Model:
    """Return the model of a pair with its centres as points."""
    points = model_points(pair, orientation, c, bx)
    ends = np.array([np.zeros(3), orientation.base * bx]).T
    names = (*pair.points, *(f"{photo}{CENTRE}" for photo in photos))
    return Model(pair.name, names, np.concatenate([points, ends], axis=1))


def model_points(pair: StereoPair, orientation: RelativeOrientation, c: float, length: float) -> Array:
    """Return model points ``(3, n)``: zero x-parallax in the left photograph's frame, Y the mean of the rays.

    A base in another direction than X is first rotated onto it.
    """
    if orientation.base[0] < ALONG_X:
        return model_coordinates(pair.left, pair.right, c, c, orientation.rotation, orientation.base, length)[0]
    left, right = ray_of(pair.left, np.eye(3), c), ray_of(pair.right, orientation.rotation[:, :, None], c)
    centre2 = (orientation.base * length)[:, None]
    return stereoscopic_intersection(np.zeros_like(centre2), left, centre2, right)[0]


def _oriented(
    pair: StereoPair, c: float, unknowns: Unknowns, bx: float, method: str
) -> RelativeOrientation | SnoopedOrientation:
    if method == "robust":
        return snooped_orientation(pair.left, pair.right, c, c, pair.points, unknowns=unknowns, bx=bx)
    if method == "schut":
        return orientation_by_schut(pair.left, pair.right, c, c, bx=bx)
    by = orientation_by_parallaxes if method == "parallax" else relative_orientation
    return by(pair.left, pair.right, c, c, unknowns, bx=bx)


def _without_blunders(pair: StereoPair, found: RelativeOrientation | SnoopedOrientation) -> StereoPair:
    if not isinstance(found, SnoopedOrientation):
        return pair
    kept = [i for i, name in enumerate(pair.points) if name in found.points]
    return StereoPair(pair.name, found.points, pair.left[:, kept], pair.right[:, kept])


def _orientation(found: RelativeOrientation | SnoopedOrientation) -> RelativeOrientation:
    return found.orientation if isinstance(found, SnoopedOrientation) else found


def _of_snooping(found: RelativeOrientation | SnoopedOrientation) -> Document:
    """Return the results of data snooping; empty for another method."""
    if not isinstance(found, SnoopedOrientation):
        return {}
    return {
        "searchable": found.searchable,
        "standardised": dict(zip(found.points, found.standardised.tolist(), strict=True)),
        "blunders": [
            {
                "point": blunder.point,
                "parallax_mm": blunder.parallax_mm,
                "standardised": blunder.standardised,
                "critical": float(blunder.critical),
            }
            for blunder in found.blunders
        ],
    }


def _compared(
    pair: StereoPair, found: dict[str, RelativeOrientation | SnoopedOrientation], c: float, bx: float
) -> Document:
    """Return elements, precision and model coordinates of several methods side by side."""
    orientations = {name: _orientation(each) for name, each in found.items()}
    elements = {name: elements_document(each.elements, each.sigmas) for name, each in orientations.items()}
    first = next(iter(elements.values()))
    rows = {
        (element, "mm" if element.startswith("b") else "gon"): {
            name: values[element]["value"] for name, values in elements.items()
        }
        for element in first
    }
    models = {name: model_points(pair, each, c, bx) for name, each in orientations.items()}
    for i, point in enumerate(pair.points):
        for k, axis in enumerate("XYZ"):
            rows[f"{point} {axis}", "mm of the model"] = {name: float(model[k, i]) for name, model in models.items()}
    rows["s0", "mm of the picture"] = {name: float(each.s0) for name, each in orientations.items()}
    return compare_methods(rows)


def photographs_of_pairs(pairs: Sequence[StereoPair]) -> list[tuple[str, str]]:
    """Return the photographs of each pair: from its name (`321-320`), otherwise from its position in the file."""
    return [
        model_photographs(pair.name) or (f"photo{place}", f"photo{place + 1}")
        for place, pair in enumerate(pairs, start=1)
    ]
