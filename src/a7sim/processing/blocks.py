"""Block adjustment of models from files."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

import numpy as np

from a7sim.geometry import GON
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
from a7sim.processing.reading import read_ground, read_models, short_list, sort_along_strip
from a7sim.processing.strips import number_models
from a7sim.reduction.block import BlockAdjustment, block_adjustment
from a7sim.reduction.strips import Model
from a7sim.result_documents import Document, accuracy_document, document_header, points_as_rows, residuals_document

SIGMAS = ("scale", "turn_X", "turn_Y", "turn_Z", "TX", "TY", "TZ")
"""Standard deviations of each model: rotations in gon, translation at the middle of the model."""


def block(
    paths: Sequence[Path], ground_path: Path, height_weight: float = 1.0, against: Path | None = None
) -> ProcessingResult:
    """Return the models of all files adjusted to the ground as one block. Raises A7SimError."""
    models = read_models(paths)
    ground = read_ground(ground_path)
    with errors_for(short_list(paths), f"ground {ground_path}"):
        found = block_adjustment(models, ground, height_weight)
    document = document_header("reduce block") | {
        "models": _of_models(found),
        "s0_m": found.s0,
        "s0_plan_m": found.s0_plan,
        "s0_height_m": found.s0_height,
        "redundancy": found.redundancy,
        "iterations": found.iterations,
        "residuals_m": residuals_document(found.fit),
        "accuracy_m": accuracy_document(found.fit),
        "warnings": _missing(ground.points, found),
        "points": points_as_rows(found.points, found.coordinates),
    }
    files = _files(models, found)
    if against:
        document["compare"] = compared = compared_with(against, found.points, found.coordinates)
        files["compare.csv"] = lambda: comparison_csv(compared)
    return ProcessingResult(document, files)


def _of_models(found: BlockAdjustment) -> list[Document]:
    residuals: dict[str, dict[str, list[float]]] = {name: {} for name in found.names}
    for (model, point), residual in zip(found.observed, found.residuals.T.tolist(), strict=True):
        residuals[model][point] = residual
    units = np.array([1.0, GON, GON, GON, 1.0, 1.0, 1.0])
    return [
        {
            "model": name,
            "scale": float(found.scales[m]),
            "rotation": found.rotations[:, :, m].tolist(),
            "translation": found.translations[:, m].tolist(),
            "sigma": dict(zip(SIGMAS, (found.sigmas[:, m] / units).tolist(), strict=True)),
            "residuals_m": residuals[name],
        }
        for m, name in enumerate(found.names)
    ]


def _missing(given: Sequence[str], found: BlockAdjustment) -> list[str]:
    present = set(found.points)
    missing = [name for name in given if name not in present]
    return [f"ground points that no model has: {', '.join(missing)}"] if missing else []


def _files(models: Sequence[Model], found: BlockAdjustment) -> dict[str, Callable[[], str]]:
    in_ground = [
        Model(
            model.name,
            model.points,
            found.scales[m] * found.rotations[:, :, m] @ model.coordinates + found.translations[:, m : m + 1],
        )
        for m, model in enumerate(models)
    ]
    strips = _strips(in_ground)
    cards = {f"strip-{place}.crd": partial(_cards, strip, found) for place, strip in enumerate(strips, start=1)}
    return {
        "models.csv": lambda: models_csv(in_ground),
        "points.csv": lambda: points_csv(found.points, found.coordinates),
        "residuals.csv": lambda: residuals_csv(found.fit),
        "block.pat": lambda: free_format(number_models(in_ground)),
        **cards,
    }


def _cards(strip: Sequence[Model], found: BlockAdjustment) -> str:
    return output_cards(found.fit, number_models(sort_along_strip(strip)))


def _strips(models: Sequence[Model]) -> list[list[Model]]:
    """Return the models of a block by strips: models connected by their projection centres."""
    strips: list[list[Model]] = []
    for model in models:
        apart, with_it = [], [model]
        for strip in strips:
            if any(set(each.centres) & set(model.centres) for each in strip):
                with_it = [*strip, *with_it]
            else:
                apart.append(strip)
        strips = [*apart, with_it]
    return strips
