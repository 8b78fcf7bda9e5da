"""Result of a reduction of files: a document and its files."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.reduction.absolute import GroundFit
from a7sim.reduction.cards import free_format_lines, output_lines
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.strips import Model, Strip
from a7sim.result_documents import Document, as_json
from a7sim.table_files import to_csv, write_files

MODEL_COLUMNS = ("model", "point", "X", "Y", "Z")
POINT_COLUMNS = ("point", "X", "Y", "Z")
RESIDUAL_COLUMNS = ("point", "role", "X", "Y", "Z")


@dataclass(frozen=True)
class ProcessingResult:
    """Document, and the texts of files by name, each made when it is written."""

    document: Document
    files: Mapping[str, Callable[[], str]] = field(default_factory=dict)


@contextmanager
def errors_for(path: Path | str, what: str = "") -> Iterator[None]:
    """Convert errors of a reduction into an error of the file; numpy warnings are suppressed."""
    try:
        with np.errstate(all="ignore"):
            yield
    except (Undetermined, A7SimError) as refusal:
        raise A7SimError(f"{path}{f', {what}' if what else ''}: {refusal}") from refusal


def write_result(outcome: ProcessingResult, folder: Path) -> Document:
    """Write `results.json` and the files of a result into a folder and return the document as written.

    A file whose form cannot hold the data (a name with letters on a card) is not written, and the document lists it
    under `not_written`. Raises A7SimError for a folder that cannot be written.
    """
    texts, refused = {}, {}
    for name, text in outcome.files.items():
        try:
            texts[name] = text()
        except A7SimError as error:
            refused[name] = str(error)
    document = outcome.document | ({"not_written": refused} if refused else {})
    write_files(folder, texts | {"results.json": as_json(document)})
    return document


def models_csv(models: Sequence[Model]) -> str:
    """Return models as CSV, centres as points `<photo>:centre`."""
    return to_csv(
        MODEL_COLUMNS,
        ([model.name, name, *xyz] for model in models for name, xyz in _places(model.points, model.coordinates)),
    )


def points_csv(points: Sequence[str], coordinates: Array) -> str:
    """Return points with coordinates ``(3, n)`` as CSV."""
    return to_csv(POINT_COLUMNS, ([name, *xyz] for name, xyz in _places(points, coordinates)))


def residuals_csv(fit: GroundFit) -> str:
    """Return computed minus given at the ground points as CSV."""
    rows = zip(fit.ground.points, fit.ground.roles, fit.residuals.T.tolist(), strict=True)
    return to_csv(RESIDUAL_COLUMNS, ([name, role, *residual] for name, role, residual in rows))


def free_format(models: Sequence[Model]) -> str:
    """Return models in the free format of PAT-M (see `reduction.cards`)."""
    return _lines(free_format_lines(models))


def output_cards(fit: GroundFit, models: Sequence[Model]) -> str:
    """Return the output cards of a strip's models in the ground system, with their residuals."""
    return _lines(output_lines(fit.ground, Strip(tuple(models), ())))


def _lines(lines: Sequence[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _places(points: Sequence[str], coordinates: Array) -> Iterator[tuple[str, list[float]]]:
    return zip(points, coordinates.T.tolist(), strict=True)
