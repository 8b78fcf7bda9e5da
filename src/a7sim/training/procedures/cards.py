"""Strip of independent models by cards, from sheets that were handed out."""

import csv
import io
import tempfile
from pathlib import Path

import numpy as np

from a7sim.processing.strips import strip
from a7sim.reduction import Ground, Model, deck_lines
from a7sim.reduction.strips import is_centre
from a7sim.result_documents import Document
from a7sim.training.attempt_record import ANSWER
from a7sim.training.procedures.base import ProcedureContext, procedure


@procedure("strip by cards")
def strip_by_cards(
    context: ProcedureContext,
    wanted: list[str],
    z_units_per_mm: float = 8.0,
    leave_out: bool = True,
    count_centre: bool = True,
    named: str = "",
) -> None:
    """Punch the cards of the models, compute the strip, leave out outliers, and answer.

    Mistakes: Z divided by another number of units, outliers not left out, the centre not counted among the ties, or
    another point `named` as the bad one.
    """
    models = _read_models(context.papers["models.csv"], z_units_per_mm)
    ground = _read_ground(context.papers["control.csv"])
    first, second = models[:2]
    ties = [name for name in first.points if name in second.points and (count_centre or not is_centre(name))]
    document = _compute_strip(models, ground)
    after, bad = _largest_difference(document)
    if leave_out:
        models = [model.without(bad) if model.name == after else model for model in models]
        document = _compute_strip(models, ground)
    answers = {"bad": named or bad, "ties": str(len(ties)), "scale": f"{1e3 * document['absolute']['scale']:.1f}"}
    for name in wanted:
        position = zip("xyz", document["points"][name], strict=True)
        answers |= {f"{axis}{name}": f"{each:.2f}" for axis, each in position}
    for key, value in answers.items():
        context.person.note(f"{ANSWER}{key}={value}")


def _rows(text: str) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text)))


def _read_models(text: str, z_units_per_mm: float) -> list[Model]:
    by_model: dict[str, dict[str, list[float]]] = {}
    for row in _rows(text):
        position = [float(row["X"]), float(row["Y"]), float(row["Z"]) / z_units_per_mm]
        by_model.setdefault(row["model"], {})[row["point"]] = position
    return [Model(name, tuple(points), np.array(list(points.values())).T) for name, points in by_model.items()]


def _read_ground(text: str) -> Ground:
    rows = _rows(text)
    coordinates = np.array([[float(row[axis]) for row in rows] for axis in "XYZ"])
    return Ground(tuple(row["point"] for row in rows), coordinates, tuple(row["role"] for row in rows))


def _compute_strip(models: list[Model], ground: Ground) -> Document:
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "strip.crd"
        deck.write_text("\n".join(deck_lines(ground, models)) + "\n", encoding="ascii")
        return strip(deck).document


def _largest_difference(document: Document) -> tuple[str, str]:
    """Return the model and the point with the largest closing difference."""
    differences = {
        (join["models"][1], point): max(map(abs, by_axis))
        for join in document["joins"]
        for point, by_axis in join["differences_mm"].items()
        if not is_centre(point)
    }
    return max(differences, key=lambda each: differences[each])
