"""Reductions of people's files: CSV in, documents out (files.md). The sums themselves are in `a7sim.reduction`."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from a7sim.documents import Document, by_point, head, of_absolute, of_adjustment, of_elements, of_joins, of_similarity
from a7sim.files import Row, read_rows, unique
from a7sim.geometry import GON, Array, ray_of, stereoscopic_intersection
from a7sim.mistakes import Mistake
from a7sim.reduction.absolute import Ground, absolute_orientation
from a7sim.reduction.centres import perspective_centre
from a7sim.reduction.coplanarity import RelativeOrientation, Unknowns, relative_orientation
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.modelling import model_coordinates
from a7sim.reduction.polynomials import Degree, strip_adjustment
from a7sim.reduction.similarity import similarity_by_iteration
from a7sim.reduction.strips import Model, formed_strip

PAIR_COLUMNS = ("xl", "yl", "xr", "yr")


@dataclass(frozen=True)
class Pair:
    """Image coordinates ``(2, n)`` in mm of points seen in two photographs, about the principal point."""

    name: str
    points: tuple[str, ...]
    left: Array
    right: Array


@contextmanager
def blamed_on(path: Path, what: str = "") -> Iterator[None]:
    """Turn what the sums cannot determine into a mistake of the file."""
    try:
        yield
    except Undetermined as undetermined:
        raise Mistake(f"{path}{f', {what}' if what else ''}: {undetermined}") from undetermined


def relative(path: Path, c: float, principal_point: tuple[float, float], unknowns: Unknowns, bx: float) -> Document:
    """Return the relative orientation of a pair file. Raises Mistake."""
    rows = list(unique(path, read_rows(path, ["point"], PAIR_COLUMNS), "point").values())
    pair = _pair(path.stem, rows, principal_point)
    with blamed_on(path):
        orientation = relative_orientation(pair.left, pair.right, c, c, unknowns, bx=bx)
    return head("reduce relative") | _of_pair(pair, orientation, c, bx)


def strip(
    path: Path,
    ground_path: Path,
    c: float,
    principal_point: tuple[float, float],
    bx: float | None = None,
    degree: Degree | None = None,
) -> Document:
    """Return the strip of a file of pairs with its absolute orientation; models have the photo base without a bx.

    Raises Mistake.
    """
    rows = read_rows(path, ["model", "point"], PAIR_COLUMNS)
    unique(path, rows, "model", "point")
    names = list(dict.fromkeys(row.texts["model"] for row in rows))
    ground = _ground(ground_path)
    models, documents = [], []
    for index, name in enumerate(names):
        pair = _pair(name, [row for row in rows if row.texts["model"] == name], principal_point)
        base = float((pair.left[0] - pair.right[0]).mean()) if bx is None else bx
        with blamed_on(path, f"model {name}"):
            orientation = relative_orientation(pair.left, pair.right, c, c, "dependent", bx=base)
        length = base / float(orientation.base[0])
        documents.append({"model": name} | _of_pair(pair, orientation, c, length))
        models.append(_with_centres(pair, orientation, c, length, _photos(name, index)))
    with blamed_on(path):
        formed = formed_strip(models)
    with blamed_on(ground_path):
        oriented = absolute_orientation(formed, ground)
        adjusted = strip_adjustment(oriented.model, ground, degree) if degree else None
    document = head("reduce strip") | {"models": documents, "joins": of_joins(formed)} | of_absolute(oriented)
    return document | ({"polynomial": of_adjustment(adjusted)} if adjusted else {})


def centres(path: Path, z1: float, z2: float) -> Document:
    """Return the perspective centre of a file of pointings at two levels. Raises Mistake."""
    columns = ("X1", "Y1", "X2", "Y2")
    rows = list(unique(path, read_rows(path, ["point"], columns), "point").values())
    X1, Y1, X2, Y2 = (_column(rows, name) for name in columns)
    if z1 == z2:
        raise Mistake(f"--z1 and --z2: expected two different levels, got {z1:g} twice")
    with blamed_on(path):
        found = perspective_centre(np.array([X1, Y1]), np.array([X2, Y2]), z1, z2)
    names = ("X0", "Y0", "Z0", "T0")
    document = head("reduce centres") | {name: float(getattr(found, name)) for name in names}
    document |= {f"sigma_{name}": float(getattr(found, f"sigma_{name}")) for name in names}
    return document | {"rms": float(found.rms), "residuals": by_point(_names(rows), found.residuals[:2])}


def similarity(path: Path) -> Document:
    """Return the similarity of a file of common points. Raises Mistake."""
    columns = ("x", "y", "z", "X", "Y", "Z")
    rows = list(unique(path, read_rows(path, ["point"], columns), "point").values())
    values = np.array([_column(rows, name) for name in columns])
    with blamed_on(path):
        found = similarity_by_iteration(values[:3], values[3:])
        sigma = {
            "scale": float(found.sigma_scale),
            **dict(zip(("omega", "phi", "kappa"), (found.sigma_angles / GON).tolist(), strict=True)),
            **dict(zip(("Tx", "Ty", "Tz"), found.sigma_translation.tolist(), strict=True)),
        }
    return (
        head("reduce similarity")
        | of_similarity(found)
        | {
            "angles": dict(zip(("omega", "phi", "kappa"), (found.angles / GON).tolist(), strict=True)),
            "sigma": sigma,
            "s0": float(found.s0),
            "residuals": by_point(_names(rows), found.residuals),
        }
    )


def _names(rows: Sequence[Row]) -> list[str]:
    return [row.texts["point"] for row in rows]


def _column(rows: Sequence[Row], name: str) -> Array:
    return np.array([row.numbers[name] for row in rows])


def _pair(name: str, rows: Sequence[Row], principal_point: tuple[float, float]) -> Pair:
    shift = np.array(principal_point)[:, None]
    xl, yl, xr, yr = (_column(rows, column) for column in PAIR_COLUMNS)
    return Pair(name, tuple(_names(rows)), np.array([xl, yl]) - shift, np.array([xr, yr]) - shift)


def _of_pair(pair: Pair, orientation: RelativeOrientation, c: float, bx: float) -> Document:
    points = _model_points(pair, orientation, c, bx)
    return {
        "unknowns": list(orientation.unknowns),
        "rotation": orientation.rotation.tolist(),
        "base": orientation.base.tolist(),
        "elements": of_elements(orientation.elements, orientation.sigmas),
        "iterations": int(orientation.iterations),
        "condition": float(orientation.condition),
        "s0_mm": float(orientation.s0),
        "residual_y_parallax_mm": dict(zip(pair.points, orientation.picture_parallaxes.tolist(), strict=True)),
        "points": by_point(pair.points, points),
    }


ALONG_X = 0.7
"""Cosine: a base nearer to the left photograph's X axis than this is taken as a plotter takes it."""


def _model_points(pair: Pair, orientation: RelativeOrientation, c: float, length: float) -> Array:
    """Return model points ``(3, n)``: where x-parallax vanishes in the left photograph's frame, Y the rays' mean.

    Only a base that points elsewhere than along X is first turned onto it.
    """
    if orientation.base[0] < ALONG_X:
        return model_coordinates(pair.left, pair.right, c, c, orientation.rotation, orientation.base, length)[0]
    left, right = ray_of(pair.left, np.eye(3), c), ray_of(pair.right, orientation.rotation[:, :, None], c)
    centre2 = (orientation.base * length)[:, None]
    return stereoscopic_intersection(np.zeros_like(centre2), left, centre2, right)[0]


def _with_centres(pair: Pair, orientation: RelativeOrientation, c: float, bx: float, photos: tuple[str, str]) -> Model:
    points = _model_points(pair, orientation, c, bx)
    ends = np.array([np.zeros(3), orientation.base * bx]).T
    names = (*pair.points, *(f"{photo}:centre" for photo in photos))
    return Model(pair.name, names, np.concatenate([points, ends], axis=1))


def _photos(model: str, index: int) -> tuple[str, str]:
    """Return the photographs of a model: those in its name (`321-320`), else by its place in the file."""
    left, dash, right = model.partition("-")
    return (left.strip(), right.strip()) if dash and left and right else (f"photo{index + 1}", f"photo{index + 2}")


def _ground(path: Path) -> Ground:
    rows = list(unique(path, read_rows(path, ["point", "role"], ["X", "Y", "Z"]), "point").values())
    for row in rows:
        if row.texts["role"] not in ("control", "plan", "height", "check"):
            raise Mistake(
                f"{path}, line {row.line}, column role: expected control, plan, height or check, "
                f"got {row.texts['role'][:40]!r}"
            )
    coordinates = np.array([_column(rows, axis) for axis in "XYZ"])
    return Ground(tuple(_names(rows)), coordinates, tuple(row.texts["role"] for row in rows))
