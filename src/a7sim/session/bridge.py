"""Strip bridged at the instrument and the same strip of independent models, both on the ground."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

import a7sim
from a7sim.errors import A7SimError
from a7sim.journal.session_files import MODELS, RESULTS, write_atomic
from a7sim.journal.writer import make_header
from a7sim.operator import OperatorGaveUp
from a7sim.operator.procedures.bridging import BridgedModels, bridge_strip, bridge_strip_batch
from a7sim.reduction import Ground, Model, Strip, Undetermined, absolute_orientation, strip_adjustment
from a7sim.result_documents import Document, absolute_document, adjustment_document, as_json, document_header
from a7sim.scenario import Scenario, amend_provenance
from a7sim.scene import Scene
from a7sim.session.lifecycle import RunOptions, open_session, recorded_session
from a7sim.session.result_records import BridgeResult
from a7sim.session.results import end_document, hours_document, models_csv, request_document
from a7sim.session.running import run
from a7sim.session.session_batch import open_batch
from a7sim.strip_methods.strip import OrientedStrip, StripResult, ground_control
from a7sim.text_tables import text_table

INDEPENDENT = "independent"
"""Folder of the independent models within that of the bridge."""

Places = dict[str, tuple[float, float, float]]


def run_bridge(scenario: Scenario, seed: int, options: RunOptions | None = None) -> Document:
    """Bridge a strip, measure the same models independently, and return both on the ground.

    With a folder, write the files: those of bridging as of `run`, and a subfolder of the independent models. `status`
    is 'complete', or 'does not fit' with the `message` of the operator who gave up; in the folder it is 'interrupted'
    until the independent models are measured, too. Raises A7SimError for a plotter that cannot bridge, and for a folder
    that cannot be used, before anything is written.
    """
    options = options or RunOptions()
    if len(scenario.models) < 2 or "outside" not in {model.base for model in scenario.models}:
        raise A7SimError("models: expected a strip with base inside and outside in turn, as bridging needs")
    recorded = recorded_session(scenario, seed, options)
    session = recorded.session
    job = session.job
    options.prepare_folder((INDEPENDENT,))
    model_documents: list[Document] = []
    places: dict[str, Places] = {}
    document = document_header("bridge") | request_document(scenario)
    document |= {"software": f"a7sim {a7sim.__version__}", "scenario": scenario.title, "seed": seed}
    document |= {"variant": scenario.instrument.variant, "status": "failed", "message": ""}
    document["bridged"] = {"models": model_documents}
    with recorded.recording(
        make_header("bridge", scenario, seed),
        lambda end: document | end_document(end),
        lambda: {MODELS: models_csv([_make_model(name, each) for name, each in places.items()])},
    ):
        for model in bridge_strip(session.person, job, options.callbacks.on_point, options.callbacks.on_activity):
            places[model.model.name] = model.coordinates_of(0)
            model_documents.append(_model_document(model))
    document |= end_document(recorded.end)
    if document["status"] != "complete":
        return document
    document["bridged"] |= {
        "strip": _ground_document(strip_points([*places.values()]), ground_control(scenario, session.scene), scenario),
        "hours": round(session.person.clock.now / 3600.0, 3),
    }
    document |= {"status": "interrupted", "message": "the session was interrupted among the independent models"}
    _write_results(document, options.folder)
    independent = run(amend_provenance(scenario, "a7sim bridge", "a7sim run"), seed, options.for_part(INDEPENDENT))
    document |= {"status": independent["status"], "message": independent["message"]}
    document["independent"] = {"strip": independent.get("strip", {}), "hours": independent["operator"]["hours"]}
    _write_results(document, options.folder)
    return document


def _write_results(document: Document, folder: Path | None) -> None:
    if folder is not None:
        write_atomic(folder / RESULTS, as_json(document))


def bridge_over_link(scenario: Scenario, seed: int) -> BridgeResult:
    """Bridge the strip of a scenario over the link."""
    session = open_session(scenario, seed)
    models: list[Model] = []
    message = ""
    try:
        for each in bridge_strip(session.person, session.job):
            models.append(_make_model(each.model.name, each.coordinates_of(0)))
    except (OperatorGaveUp, Undetermined) as error:
        message = str(error)
    operator = hours_document(session.person.clock.now, session.person.timesheet)
    return _bridge_result(models, message, operator, scenario, session.scene)


def bridge_batch(scenario: Scenario, seeds: Sequence[int]) -> list[BridgeResult]:
    """Bridge the strip for each seed as a batch, equal to the digit to `bridge_over_link`."""
    batch = open_batch(scenario, seeds)
    models: list[list[Model]] = [[] for _ in seeds]
    for each in bridge_strip_batch(batch.workstation):
        for session in each.sessions.tolist():
            models[session].append(_make_model(each.model.name, each.coordinates_of(session)))
    operators = batch.workstation.operators
    return [
        _bridge_result(
            models[session],
            operators.reasons.get(session, ""),
            hours_document(float(operators.seconds[session]), operators.timesheet, session),
            scenario,
            scene,
        )
        for session, scene in enumerate(batch.scenes)
    ]


def _bridge_result(
    models: Sequence[Model], message: str, operator: Document, scenario: Scenario, scene: Scene
) -> BridgeResult:
    if message:
        return BridgeResult(None, message, operator)
    ground, degree = ground_control(scenario, scene), scenario.strip.polynomial
    strip = average_points(models)
    try:
        oriented = absolute_orientation(strip, ground)
        adjusted = strip_adjustment(oriented.model, ground, degree) if degree else None
    except Undetermined as undetermined:
        return BridgeResult(None, f"the bridged strip: {undetermined}", operator)
    return BridgeResult(
        StripResult(tuple(models), OrientedStrip(Strip((strip,), ()), oriented, adjusted)), "", operator
    )


def _make_model(name: str, places: Places) -> Model:
    return Model(name, tuple(places), np.array([*places.values()]).T)


def average_points(models: Iterable[Model]) -> Model:
    """Return all points of the models of a bridged strip, averaged over models."""
    return strip_points([dict(zip(each.points, each.coordinates.T.tolist(), strict=True)) for each in models])


def strip_points(places: Iterable[Places]) -> Model:
    """Return all points of a bridged strip in mm, averaged over models."""
    by_point: dict[str, list[tuple[float, float, float]]] = {}
    for model in places:
        for name, place in model.items():
            by_point.setdefault(name, []).append(place)
    return Model("bridge", tuple(by_point), np.array([np.mean(each, axis=0) for each in by_point.values()]).T)


def _ground_document(strip: Model, ground: Ground, scenario: Scenario) -> Document:
    try:
        oriented = absolute_orientation(strip, ground)
        document = absolute_document(oriented)
        if scenario.strip.polynomial:
            document["polynomial"] = adjustment_document(
                strip_adjustment(oriented.model, ground, scenario.strip.polynomial)
            )
    except (A7SimError, Undetermined) as reason:
        return {"message": str(reason)}
    return document


def _model_document(bridged: BridgedModels) -> Document:
    orientation = bridged.orientation.for_session(0)
    mm = [1.0, 1.0, 1.0 / bridged.z_units_per_mm]
    common = {name: [round(float(v), 4) for v in each[:, 0] * mm] for name, each in bridged.common.items()}
    return {
        "model": bridged.model.name,
        "left": bridged.model.left,
        "right": bridged.model.right,
        "base": bridged.model.base,
        "elements": dict(orientation.elements),
        "rms_parallax_mm": round(orientation.rms, 6),
        "scale": round(float(bridged.scale[0]), 7),
        "common_mm": {name: each for name, each in common.items() if np.isfinite(each).all()},
    }


def bridge_tables(document: Document) -> RenderableType:
    """Return the tables of a bridged strip and of the independent models, for a terminal."""
    summary = f"{document['status']}: {document['message']}" if document["message"] else ""
    parts: list[RenderableType] = [_model_table(document["bridged"]["models"])]
    if "independent" in document:
        parts += [Text(), _comparison_table(document)]
        parts.append(
            Text(
                f"{document['bridged']['hours']:.1f} hours at the instrument bridging, "
                f"{document['independent']['hours']:.1f} with independent models and their perspective centres"
            )
        )
    return Group(*parts, *([Text(summary, style="bold")] if summary else []))


def _model_table(models: Sequence[Document]) -> RenderableType:
    table = text_table("model", "base", "bx, mm", "scale", "rms p, mm", "common X", "Y", "Z, mm")
    for model in models:
        common = np.array(list(model["common_mm"].values())).reshape(-1, 3)
        rms = [f"{value:.3f}" for value in np.sqrt((common**2).mean(axis=0))] if common.size else ["", "", ""]
        table.add_row(
            model["model"],
            model["base"],
            f"{model['elements']['bx']:.2f}",
            f"{model['scale']:.5f}",
            f"{model['rms_parallax_mm']:.4f}",
            *rms,
        )
    return Group(Text("Bridged models: scale carried by bx, rms of differences at common points", style="bold"), table)


def _comparison_table(document: Document) -> RenderableType:
    table = text_table("strip", "points", "X", "Y", "Z", "plan", "height", fold=(1,))
    for method in ("bridged", "independent"):
        strip = document[method]["strip"]
        for label, part in ((method, strip), (f"{method}, polynomial", strip.get("polynomial", {}))):
            for group, each in part.get("accuracy_m", {}).items():
                values = [*each["rms"].values(), each["plan"], each["height"]]
                cells = ["" if value is None else f"{value:.3f}" for value in values]
                table.add_row(label, f"{each['points']} {group}", *cells)
        if "message" in strip:
            table.add_row(method, strip["message"])
    return Group(Text("On the ground, rms in m", style="bold"), table)
