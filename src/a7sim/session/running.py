"""Running a scenario at the plotter: the operator measures the models, and their strip is oriented to the ground."""

from collections.abc import Sequence
from pathlib import Path

import msgspec

from a7sim.errors import A7SimError
from a7sim.journal.session_files import (
    CARD_KEY,
    CARDS,
    MODELS,
    OUTPUT_CARDS,
    RESULTS,
    STRIP,
    write_atomic,
)
from a7sim.journal.writer import make_header
from a7sim.operator import measure_models
from a7sim.reduction import Ground, Model, Undetermined
from a7sim.result_documents import Document, as_json
from a7sim.scenario import Scenario
from a7sim.session.lifecycle import RunOptions, recorded_session
from a7sim.session.result_records import ModelResult, SessionEnd, SessionResult
from a7sim.session.results import models_csv, points_csv, session_document
from a7sim.session.truth import TruthComparison
from a7sim.strip_methods.strip import StripResult, ground_control, orient_strip, strip_cards
from a7sim.table_files import to_csv


def run(scenario: Scenario, seed: int, options: RunOptions | None = None) -> Document:
    """Run a scenario up to its strip and return the document of results; see `measure_session`."""
    return session_document(measure_session(scenario, seed, options))


def measure_session(scenario: Scenario, seed: int, options: RunOptions | None = None) -> SessionResult:
    """Measure the models of a scenario at the plotter and orient their strip; with a folder, write the files.

    `status` is 'complete', or 'does not fit' with the operator's `message`. An interrupted session (KeyboardInterrupt)
    writes complete files and raises. Raises A7SimError for an invalid file of measurements or a folder that cannot be
    used, before anything is written. A resumed session continues in its folder, and writes the files of an
    uninterrupted one.
    """
    options = options or RunOptions()
    recorded = recorded_session(scenario, seed, options)
    session, callbacks = recorded.session, options.callbacks
    job = session.job
    options.prepare_folder()
    models: list[ModelResult] = []

    def result(end: SessionEnd) -> SessionResult:
        return SessionResult(scenario, seed, end.status, end.message, tuple(models), end.operator, end.slips)

    with recorded.recording(
        make_header("run", scenario, seed),
        lambda end: session_document(result(end)),
        lambda: {MODELS: models_csv([each.rounded_model for each in models])},
    ):
        for record in measure_models(session.person, job, callbacks.on_point, callbacks.on_activity):
            planned_model = next(model for model in scenario.models if model.name == record.model.name)
            truth = session.scene.relative_truth(planned_model)
            comparison = TruthComparison.from_record(record, session.autograph, truth)
            models.append(ModelResult(record, comparison, published=planned_model.published))
    measured = result(recorded.end)
    if measured.status != "complete":
        return measured
    ground = ground_control(scenario, session.scene)
    oriented = with_strip(measured, ground)
    if options.folder is not None:
        if oriented.strip is not None:
            write_atomic(options.folder / STRIP, points_csv(oriented.strip.strip.points))
            _write_cards(options.folder, oriented.strip, [each.rounded_model for each in models], ground)
        write_atomic(options.folder / RESULTS, as_json(session_document(oriented)))
    return oriented


def with_strip(result: SessionResult, ground: Ground) -> SessionResult:
    """Return a result with the strip of its models on the ground, or with the reason why there is none."""
    strip, message = _orient_models(result.strip_models, ground, result.scenario)
    return msgspec.structs.replace(result, strip=strip, strip_message=message)


def _orient_models(models: Sequence[Model], ground: Ground, scenario: Scenario) -> tuple[StripResult | None, str]:
    plan = scenario.strip
    try:
        if not ground.used.any():
            raise A7SimError("the scenario has no ground control")
        return StripResult(tuple(models), orient_strip(models, ground, plan.join, plan.polynomial)), ""
    except (A7SimError, Undetermined) as reason:
        return None, str(reason)


def _write_cards(folder: Path, strip: StripResult, models: Sequence[Model], ground: Ground) -> None:
    cards = strip_cards(strip.strip, models, ground)
    write_atomic(folder / CARDS, "\n".join([*cards.deck, ""]))
    write_atomic(folder / OUTPUT_CARDS, "\n".join([*cards.output, ""]))
    write_atomic(folder / CARD_KEY, to_csv(("point", "number"), cards.key.items()))
