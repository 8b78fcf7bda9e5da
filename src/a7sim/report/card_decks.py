"""N.R.C. cards of a session's strip: from the folder, or made from its results."""

import numpy as np

from a7sim.errors import A7SimError
from a7sim.journal.session_files import CARDS, MODELS_OF_WAY, STRIP, STRIP_OF_WAY
from a7sim.reduction import Ground, Model, Undetermined
from a7sim.report.session_folder import SessionFolder
from a7sim.result_documents import Document
from a7sim.strip_methods.strip import models_from_documents, orient_strip, strip_cards


def strip_deck(kept: SessionFolder, way: str | None = None) -> str:
    """Return the deck of a session's strip, or of the strip by a method. Raises A7SimError if there is none."""
    if way is None and (present := kept.text(CARDS)):
        return present
    with kept.reading_results():
        strip, models, points = _measured(kept, way)
        ground = _ground(kept, strip, points)
    try:
        cards = strip_cards(orient_strip(models, ground), models, ground)
    except Undetermined as reason:
        raise A7SimError(f"{kept.folder}: expected a strip that can be put on cards: {reason}") from reason
    return "\n".join([*cards.deck, ""])


def _measured(kept: SessionFolder, way: str | None) -> tuple[Document, list[Model], str]:
    """Return a strip, its models, and the file of its points."""
    document = kept.document
    if way is not None:
        if way not in document.get("ways", {}):
            known = ", ".join(document.get("ways", {})) or "none"
            raise A7SimError(f"{kept.folder}: expected a way in which the strip was measured ({known}), got {way}")
        return document["ways"][way], _models(kept, MODELS_OF_WAY.format(way.lower())), STRIP_OF_WAY.format(way.lower())
    if "residuals_m" not in document.get("strip", {}):
        raise A7SimError(
            f"{kept.folder}: expected a session with a strip on the ground, got one without{_hint(document)}"
        )
    return document["strip"], models_from_documents(document["models"]), STRIP


def _hint(document: Document) -> str:
    if "strips" in document:
        return ": each of its folders case-A to case-E has its own"
    return f" (--method {' or '.join(document['ways'])} has one)" if "ways" in document else ""


def _models(kept: SessionFolder, name: str) -> list[Model]:
    by_model: dict[str, dict[str, tuple[float, ...]]] = {}
    for row in kept.rows(name):
        by_model.setdefault(row["model"], {})[row["point"]] = tuple(float(row[axis]) for axis in "XYZ")
    return [Model(model, tuple(at), np.array(list(at.values())).T) for model, at in by_model.items()]


def _ground(kept: SessionFolder, strip: Document, name: str) -> Ground:
    """Return the given coordinates of the measured ground points: computed minus residuals."""
    computed = {row["point"]: [float(row[axis]) for axis in "XYZ"] for row in kept.rows(name)}
    residuals = {
        point: each
        for point, each in strip.get("polynomial", strip)["residuals_m"].items()
        if point in computed and None not in each.values()
    }
    given = [
        [at - residuals[point][axis] for at, axis in zip(computed[point], "XYZ", strict=True)] for point in residuals
    ]
    return Ground(
        tuple(residuals), np.array(given).reshape(-1, 3).T, tuple(each["role"] for each in residuals.values())
    )
