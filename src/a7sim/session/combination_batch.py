"""Strips of each case of one model with each case of the next, for a batch of sessions as arrays (thesis 4.3)."""

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import product

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.reduction import Ground, GroundFit, Model, Strip, Undetermined, formed_strip
from a7sim.reduction.absolute import fitted_to_ground, root_mean_square
from a7sim.result_documents import Document
from a7sim.scenario.schema import StripPlan
from a7sim.session.result_records import SessionResult
from a7sim.session.results import brief_model_document, model_document
from a7sim.strip_methods.strip import orient_strip, oriented_strip_document

CHUNK_SIZE = 64
"""Replicates per array, a limit of memory."""

Replicate = Mapping[str, SessionResult]
"""Results of the sessions of one seed, by case."""
Cases = tuple[str, ...]
"""Of a strip's models."""


def cases_of_strips(cases: Sequence[str], models: int) -> list[Cases]:
    """Return the cases of the models of each strip, in the order of `combinations`."""
    return list(product(cases, repeat=models))


def combine_strips(
    replicates: Sequence[Replicate], models: int, ground: Ground, plan: StripPlan, brief: bool = False
) -> Iterator[list[Document]]:
    """Yield a document for each strip of each replicate, as if one session had measured its models in these cases.

    It contains models, hours, and the strip with its joins and accuracy; its `status` is that of the session that gave
    up, if a model is of one. No digit of a replicate depends on the others. Raises A7SimError for models that form no
    strip.
    """
    for first in range(0, len(replicates), CHUNK_SIZE):
        chunk = replicates[first : first + CHUNK_SIZE]
        strips = _batch_strips(chunk, models, ground, plan)
        for i, each in enumerate(chunk):
            documents = {case: _model_documents(session, brief) for case, session in each.items()}
            yield [
                _document(each, documents, cases, strips.get((i, cases)) or _single_strip(each, cases, ground, plan))
                for cases in cases_of_strips(tuple(each), models)
            ]


def _batch_strips(
    chunk: Sequence[Replicate], models: int, ground: Ground, plan: StripPlan
) -> dict[tuple[int, Cases], Document]:
    """Return the strips of replicates whose sessions all have the same points and full control."""
    groups: dict[tuple[Cases, ...], list[tuple[int, dict[str, list[Model]]]]] = defaultdict(list)
    for i, replicate in enumerate(chunk):
        if plan.polynomial is None and all(each.status == "complete" for each in replicate.values()):
            by_case = {case: each.strip_models for case, each in replicate.items()}
            point_lists = {tuple(model.points for model in each) for each in by_case.values()}
            if len(point_lists) == 1:
                groups[point_lists.pop()].append((i, by_case))
    return {key: strip for group in groups.values() for key, strip in _group_strips(group, models, ground, plan)}


def _group_strips(
    group: Sequence[tuple[int, Mapping[str, Sequence[Model]]]], models: int, ground: Ground, plan: StripPlan
) -> Iterator[tuple[tuple[int, Cases], Document]]:
    first = group[0][1]
    combinations = cases_of_strips(tuple(first), models)
    stacked = []
    for index, model in enumerate(next(iter(first.values()))):
        by_case = {case: np.stack([each[case][index].coordinates for _, each in group], axis=-1) for case in first}
        each_strip = np.stack([by_case[cases[index]] for cases in combinations], axis=-1)
        stacked.append(Model(model.name, model.points, each_strip.reshape((*each_strip.shape[:2], -1))))
    if not _has_full_control(stacked, ground):
        return
    try:
        strip = formed_strip(stacked, plan.join)
        fit = fitted_to_ground(strip.as_model, ground)[1]
    except Undetermined as undetermined:
        raise A7SimError(f"strips of all cases: {undetermined}") from undetermined
    keys = [(i, cases) for i, _ in group for cases in combinations]
    yield from zip(keys, _documents(strip, fit), strict=True)


def _has_full_control(models: Sequence[Model], ground: Ground) -> bool:
    """Return whether a strip is fitted to its control in closed form, member by member."""
    names = {name for model in models for name in model.points}
    return all(role in ("control", "check") for role in ground.among(tuple(names)).roles)


def _documents(strip: Strip, fit: GroundFit) -> Iterator[Document]:
    """Yield one document per member of a batch with joins and accuracy of the strip, without single points."""
    joins = [(join.before, join.after, join.scale.tolist(), join.max_residual.tolist()) for join in strip.joins]
    on = {
        role_group: _accuracy(residuals)
        for role_group, residuals in (("control", fit.at_control), ("checks", fit.at_checks))
        if np.isfinite(residuals).any()
    }
    for member in range(fit.computed.shape[-1]):
        yield {
            "joins": [
                {"models": [before, after], "scale": scale[member], "max_residual_mm": max_residual[member]}
                for before, after, scale, max_residual in joins
            ],
            "accuracy_m": {
                role_group: {
                    "rms": {"X": x[member], "Y": y[member], "Z": z[member]},
                    "plan": p[member],
                    "height": z[member],
                }
                for role_group, (x, y, z, p) in on.items()
            },
        }


def _accuracy(residuals: Array) -> tuple[list[float], ...]:
    """Return the rms in X, Y and Z and in plan of residuals ``(3, m, members)``."""
    x, y, z = root_mean_square(residuals)
    return tuple(each.tolist() for each in (x, y, z, np.hypot(x, y)))


def _single_strip(replicate: Replicate, cases: Cases, ground: Ground, plan: StripPlan) -> Document:
    if any(replicate[case].status != "complete" for case in cases):
        return {}
    models = [replicate[case].strip_models[index] for index, case in enumerate(cases)]
    try:
        return oriented_strip_document(orient_strip(models, ground, plan.join, plan.polynomial))
    except Undetermined as undetermined:
        raise A7SimError(f"strip of the cases {' and '.join(cases)}: {undetermined}") from undetermined


def _model_documents(session: SessionResult, brief: bool) -> list[Document]:
    return [brief_model_document(each) if brief else model_document(each) for each in session.models or ()]


def _document(
    replicate: Replicate, documents: Mapping[str, Sequence[Document]], cases: Cases, strip: Document
) -> Document:
    gave_up = next((replicate[case] for case in cases if replicate[case].status != "complete"), None)
    if gave_up is not None:
        return {"status": gave_up.status, "message": gave_up.message}
    models = [documents[case][index] for index, case in enumerate(cases)]
    seconds = sum(_seconds(documents[case], index) for index, case in enumerate(cases))
    return {
        "status": "complete",
        "message": "",
        "models": models,
        "strip": strip,
        "operator": {"hours": round(seconds / 3600.0, 3)},
    }


def _seconds(models: Sequence[Document], index: int) -> float:
    """Return the duration of a model in its session, s."""
    before = models[index - 1]["finished_at_s"] if index else 0.0
    return float(models[index]["finished_at_s"] - before)
