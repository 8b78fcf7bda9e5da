"""Strips from files of pairs, models or cards: joined and oriented to the ground."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.processing.comparing import compare_to_reference as compared_with
from a7sim.processing.comparing import comparison_csv
from a7sim.processing.outcome import (
    ProcessingResult,
    errors_for,
    free_format,
    models_csv,
    output_cards,
    points_csv,
    residuals_csv,
)
from a7sim.processing.pairs import add_centres, pair_document, photographs_of_pairs
from a7sim.processing.reading import (
    is_pair_table,
    read_ground,
    read_models,
    read_models_table,
    read_pairs,
    short_list,
    sort_along_strip,
)
from a7sim.reduction.absolute import AbsoluteOrientation, Ground, GroundFit, absolute_orientation
from a7sim.reduction.cards import Deck, is_deck, read_cards
from a7sim.reduction.coplanarity import relative_orientation
from a7sim.reduction.least_squares import Undetermined
from a7sim.reduction.polynomials import Degree, StripAdjustment, strip_adjustment
from a7sim.reduction.similarity import SIMILARITY_UNKNOWNS
from a7sim.reduction.strips import JoinMethod, Model, Strip, formed_strip
from a7sim.result_documents import (
    Document,
    absolute_document,
    adjustment_document,
    document_header,
    joins_document,
    points_as_rows,
    statistics_document,
)
from a7sim.table_files import Table, read_table, read_text


@dataclass(frozen=True)
class PairCamera:
    """Camera of pairs: principal distance and principal point in mm, and the bx of all models, if given."""

    c: float
    principal_point: tuple[float, float] = (0.0, 0.0)
    bx: float | None = None


@dataclass(frozen=True)
class _Input:
    """Input of a strip: models in order, their documents, and ground points if included."""

    kind: str
    models: tuple[Model, ...]
    documents: list[Document]
    ground: Ground | None = None


def connect(paths: Sequence[Path], method: JoinMethod = "points") -> ProcessingResult:
    """Return the models of all files joined into one, in the system of the first model of the strip.

    Raises A7SimError.
    """
    models = read_models(paths)
    with errors_for(short_list(paths)):
        if len(models) < 2:
            raise A7SimError(f"expected two models or more, got {len(models)}")
        formed = formed_strip(sort_along_strip(models), method)
    document = document_header("reduce connect") | {
        "method": method,
        "system": formed.models[0].name,
        "models": [model.name for model in formed.models],
        "joins": _of_closed_joins(formed),
        "points": points_as_rows(formed.points, formed.coordinates),
    }
    return ProcessingResult(document, _model_files(formed.models, formed.as_model))


def absolute(path: Path, ground_path: Path, against: Path | None = None) -> ProcessingResult:
    """Return one model or strip oriented to the ground. Raises A7SimError."""
    models = read_models([path], may_be_one=True)
    if len(models) > 1:
        raise A7SimError(f"{path}, column model: expected one model, got {len(models)}; `reduce strip` joins them")
    ground = read_ground(ground_path)
    with errors_for(path, f"ground {ground_path}"):
        oriented = absolute_orientation(models[0], ground)
    document = document_header("reduce absolute") | orientation_document(oriented)
    document["points"] = points_as_rows(oriented.model.points, oriented.model.coordinates)
    files = _model_files([oriented.model], oriented.model)
    files["residuals.csv"] = lambda: residuals_csv(oriented.fit)
    return _with_comparison(ProcessingResult(document, files), oriented.model, against)


def strip(
    path: Path,
    ground_path: Path | None = None,
    camera: PairCamera | None = None,
    method: JoinMethod = "points",
    degree: Degree | None = None,
    against: Path | None = None,
) -> ProcessingResult:
    """Return the strip of a file of pairs, models or cards with its absolute orientation and adjustment.

    Pairs need the camera; without a bx their models have the photo base. Only cards include ground points, which the
    ground file replaces. Raises A7SimError.
    """
    own_ground = read_ground(ground_path) if ground_path else None
    given = _strip_input(path, camera)
    ground = own_ground or given.ground
    if ground is None:
        raise A7SimError(f"{path}: expected ground points (--ground), which only cards bring with them, got none")
    with errors_for(path):
        formed = formed_strip(given.models, method)
    with errors_for(path, f"ground {ground_path}" if ground_path else ""):
        oriented = absolute_orientation(formed, ground)
        adjusted = strip_adjustment(oriented.model, ground, degree) if degree else None
    document = document_header("reduce strip") | {
        "input": given.kind,
        "method": method,
        "models": given.documents,
        "joins": _of_closed_joins(formed),
    }
    document |= orientation_document(oriented)
    if adjusted:
        document["polynomial"] = adjustment_document(adjusted) | _of_polynomials(adjusted)
    final = adjusted.model if adjusted else oriented.model
    document["points"] = points_as_rows(final.points, final.coordinates)
    models = _in_ground(formed, oriented, adjusted)
    fit = adjusted.fit if adjusted else oriented.fit
    return _with_comparison(
        ProcessingResult(document, _model_files(models, final) | ground_files(models, fit)), final, against
    )


def orientation_document(oriented: AbsoluteOrientation) -> Document:
    """Return an absolute orientation with the statistics of its seven unknowns if all are determined."""
    similarity = oriented.similarity
    try:
        adjustment = similarity.adjustment
    except Undetermined:  # omega and kappa turn about one axis
        return absolute_document(oriented)
    used = oriented.fit.ground.used > 0.0
    names = oriented.fit.ground.points
    observations = [
        f"{name} {axis}" for k, axis in enumerate("XYZ") for name, each in zip(names, used[k], strict=True) if each
    ]
    return absolute_document(oriented) | {
        "iterations": similarity.iterations,
        "s0_m": float(adjustment.s0),
        "statistics": statistics_document(adjustment, SIMILARITY_UNKNOWNS, observations),
    }


def ground_files(models: Sequence[Model], fit: GroundFit) -> dict[str, Callable[[], str]]:
    """Return the files of a strip in the ground system: residuals, output cards and free format."""
    return {
        "residuals.csv": lambda: residuals_csv(fit),
        "strip.crd": lambda: output_cards(fit, number_models(models)),
        "strip.pat": lambda: free_format(number_models(models)),
    }


def number_models(models: Sequence[Model]) -> list[Model]:
    """Return models with numeric names, as cards require: their own numbers, otherwise their positions in the strip."""
    if all(model.name.isascii() and model.name.isdigit() for model in models):
        return list(models)
    return [Model(str(place), model.points, model.coordinates) for place, model in enumerate(models, start=1)]


def _strip_input(path: Path, camera: PairCamera | None) -> _Input:
    text = read_text(path)
    if is_deck(path, text):
        return _of_deck(path, read_cards(path, text))
    table = read_table(path, text)
    if not is_pair_table(table):
        return _of_models(path, "models", read_models_table(table))
    if camera is None:
        raise A7SimError(f"{path}: expected the principal distance (--c) of the pairs, got none")
    return _of_pairs(path, table, camera)


def _of_deck(path: Path, deck: Deck) -> _Input:
    found = _of_models(path, "cards", deck.models)
    return _Input(found.kind, found.models, found.documents, deck.ground)


def _of_models(path: Path, kind: str, models: Sequence[Model]) -> _Input:
    with errors_for(path):
        chain = sort_along_strip(models)
    documents = [{"model": model.name, "points": points_as_rows(model.points, model.coordinates)} for model in chain]
    return _Input(kind, chain, documents)


def _of_pairs(path: Path, table: Table, camera: PairCamera) -> _Input:
    pairs = read_pairs(table, camera.principal_point)
    models: list[Model] = []
    documents: dict[str, Document] = {}
    for pair, photos in zip(pairs, photographs_of_pairs(pairs), strict=True):
        base = float((pair.left[0] - pair.right[0]).mean()) if camera.bx is None else camera.bx
        with errors_for(path, f"model {pair.name}"):
            if not base > 0.0:
                raise A7SimError(
                    f"expected the points of the left photograph further right than in the other, "
                    f"got a mean x-parallax of {base:.3f} mm (is the pair given right to left?)"
                )
            orientation = relative_orientation(pair.left, pair.right, camera.c, camera.c, "dependent", bx=base)
        length = base / abs(float(orientation.base[0]))
        documents[pair.name] = {"model": pair.name} | pair_document(pair, orientation, camera.c, length)
        models.append(add_centres(pair, orientation, camera.c, length, photos))
    with errors_for(path):
        chain = sort_along_strip(models)
    return _Input("pairs", chain, [documents[model.name] for model in chain])


def _of_closed_joins(formed: Strip) -> list[Document]:
    return [
        document
        | {
            "points": list(join.points),
            "translation": join.similarity.translation.tolist(),
            "rms_mm": join.rms.tolist(),
            "differences_mm": points_as_rows(join.points, join.differences),
        }
        for document, join in zip(joins_document(formed), formed.joins, strict=True)
    ]


def _of_polynomials(adjusted: StripAdjustment) -> Document:
    """Return the coefficients in half lengths along the strip, and their statistics."""
    ground = adjusted.fit.ground
    plan = [name for name, used in zip(ground.points, ground.used[0], strict=True) if used]
    height = [name for name, used in zip(ground.points, ground.used[2], strict=True) if used]
    degree = adjusted.degree
    in_plan = [f"{part} a{k}" for k in range(degree + 1) for part in ("Re", "Im")]
    in_height = [f"b{k}" for k in range(2 * degree + 1)]
    axis = adjusted.axis
    return {
        "axis": {
            "middle_m": axis.middle.tolist(),
            "along": axis.along.tolist(),
            "half_length_m": float(axis.half_length),
        },
        "coefficients": {
            name: {"value": float(value), "sigma": float(sigma)}
            for names, part in ((in_plan, adjusted.plan), (in_height, adjusted.height))
            for name, value, sigma in zip(names, part.unknowns, part.sigmas, strict=True)
        },
        "statistics": {
            "plan": statistics_document(
                adjusted.plan, in_plan, [f"{name} {where}" for where in ("along", "across") for name in plan]
            ),
            "height": statistics_document(adjusted.height, in_height, height),
        },
    }


def _in_ground(formed: Strip, oriented: AbsoluteOrientation, adjusted: StripAdjustment | None) -> tuple[Model, ...]:
    models = formed.transformed(oriented.similarity).models
    if adjusted is None:
        return models
    return tuple(Model(each.name, each.points, adjusted.corrected(each.coordinates)) for each in models)


def _model_files(models: Sequence[Model], whole: Model) -> dict[str, Callable[[], str]]:
    return {
        "models.csv": lambda: models_csv(models),
        "points.csv": lambda: points_csv(whole.points, whole.coordinates),
    }


def _with_comparison(outcome: ProcessingResult, final: Model, path: Path | None) -> ProcessingResult:
    if path is None:
        return outcome
    compared = compared_with(path, final.points, final.coordinates)
    return ProcessingResult(
        outcome.document | {"compare": compared}, {**outcome.files, "compare.csv": lambda: comparison_csv(compared)}
    )
