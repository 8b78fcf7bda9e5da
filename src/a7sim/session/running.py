"""Running of a scenario: scene, instrument, link and operator."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.instrument import Autograph, build_autograph
from a7sim.instrument.language import Listener, SharedInstrument
from a7sim.journal.session_files import (
    CARD_KEY,
    CARDS,
    MODELS,
    OUTPUT_CARDS,
    RESULTS,
    STRIP,
    write_atomic,
)
from a7sim.journal.writer import Journal, JournalOptions, make_header
from a7sim.link.client.client import Client, Port
from a7sim.link.clock import Clock
from a7sim.link.inprocess import InProcessSerial
from a7sim.operator import Job, ModelJob, Person, measure_models
from a7sim.reduction import Ground, Model, Undetermined
from a7sim.result_documents import Document, as_json
from a7sim.scenario import Scenario
from a7sim.scene import Scene, build_scene
from a7sim.session import results
from a7sim.session.lifecycle import recorded_session
from a7sim.session.truth import TruthComparison
from a7sim.strip_methods.strip import (
    OrientedStrip,
    given_control,
    ground_control,
    models_from_documents,
    orient_strip,
    oriented_strip_document,
    strip_cards,
)
from a7sim.table_files import to_csv

PortAdapter = Callable[[InProcessSerial], Port]
"""Function between instrument and operator: it takes the instrument's port and returns the operator's."""


def direct(port: InProcessSerial) -> Port:
    """Return the instrument's port unchanged."""
    return port


@dataclass
class Session:
    """Operator at an instrument with the photographs of a scenario."""

    scenario: Scenario
    seed: int
    scene: Scene
    autograph: Autograph
    person: Person
    instrument: SharedInstrument

    @cached_property
    def job(self) -> Job:
        """Job sheet. Raises A7SimError if the scenario has no settings of a plotter."""
        return make_job(self.scenario, self.scene)


def open_session(
    scenario: Scenario, seed: int, listener: Listener | None = None, port_adapter: PortAdapter = direct
) -> Session:
    """Return a session ready to start. Raises A7SimError for an invalid file of measurements."""
    scene = build_scene(scenario, seed)
    autograph = build_autograph(scenario.instrument, scene.mountable, seed)
    clock = Clock()
    instrument = SharedInstrument(autograph, listener)
    port = InProcessSerial(instrument=instrument, clock=clock, timeout=1.0)
    person = Person(Client(port_adapter(port)), clock, scenario.observer, seed)
    return Session(scenario, seed, scene, autograph, person, instrument)


def make_job(scenario: Scenario, scene: Scene) -> Job:
    """Return the job sheet: the data of a scenario that an operator may know."""
    models = tuple(
        ModelJob(
            model.name,
            model.left,
            model.right,
            model.base,
            scene.photographs[model.left].polarity,
            scene.standard_points[model.name],
            scene.other_points,
        )
        for model in scenario.models
    )
    control = _control_of(scenario, scene) if scenario.plan.absolute_orientation else {}
    return Job(scenario.camera, scenario.plan, models, scenario.grid_plate, control)


def _control_of(scenario: Scenario, scene: Scene) -> dict[str, tuple[float, float, float]]:
    given = given_control(scenario, scene)
    return {name: (x, y, z) for name, (x, y, z) in zip(given.points, given.coordinates.T.tolist(), strict=True)}


@dataclass(frozen=True)
class ProgressCallbacks:
    """Callbacks of a session's progress: start of an activity, end of a point."""

    on_activity: Callable[[str], None] = lambda _: None
    on_point: Callable[[], None] = lambda: None


def run(
    scenario: Scenario,
    seed: int,
    out: Path | None = None,
    watcher: ProgressCallbacks | None = None,
    force: bool = False,
    port_adapter: PortAdapter = direct,
    journal_options: JournalOptions | None = None,
) -> Document:
    """Run a scenario up to its strip and return the document of results; with `out`, write the files.

    `status` in the document is 'complete', or 'does not fit' with the operator's `message`. An interrupted session
    (KeyboardInterrupt) writes complete files and raises. Raises A7SimError for an invalid file of measurements or a
    folder that cannot be used, before anything is written. A resumed session continues in its folder, and writes the
    files of an uninterrupted one.
    """
    watcher = watcher or ProgressCallbacks()
    journal_options = journal_options or JournalOptions()
    journal = Journal(journal_options)
    session = open_session(scenario, seed, journal.on_link_event, port_adapter)
    job = session.job
    journal_options.prepare(out, force)
    done: list[Document] = []
    document = results.results_header(scenario, seed) | {"status": "failed", "message": "", "models": done}

    def leaves() -> dict[str, str]:
        return {MODELS: results.models_csv(models_from_documents(done))}

    with recorded_session(document, session, journal, make_header("run", scenario, seed), out, leaves):
        for record in measure_models(session.person, job, watcher.on_point, watcher.on_activity):
            plan = next(model for model in scenario.models if model.name == record.model.name)
            truth = session.scene.relative_truth(plan)
            beside = TruthComparison.from_record(record, session.autograph, truth)
            done.append(results.model_document(record, beside, published=plan.published))
    return _concluded(session, document, out)


def _concluded(session: Session, document: Document, out: Path | None) -> Document:
    """Return the document of a session, with the strip on the ground if the session is complete."""
    if document["status"] != "complete":
        return document
    ground = ground_control(session.scenario, session.scene)
    document["strip"], strip = strip_document(session.scenario, ground, document["models"])
    if out is not None and strip is not None:
        write_atomic(out / STRIP, results.points_csv(strip.points))
        _write_cards(out, strip, models_from_documents(document["models"]), ground)
    if out is not None:
        write_atomic(out / RESULTS, as_json(document))
    return document


def strip_document(
    scenario: Scenario, ground: Ground, models: Sequence[Document]
) -> tuple[Document, OrientedStrip | None]:
    """Return the strip on the ground of the models of a document, or the reason why there is none in its `message`."""
    try:
        if not ground.used.any():
            raise A7SimError("the scenario has no ground control")
        strip = orient_strip(models_from_documents(models), ground, scenario.strip.join, scenario.strip.polynomial)
    except (A7SimError, Undetermined) as reason:
        return {"message": str(reason)}, None
    return oriented_strip_document(strip), strip


def _write_cards(out: Path, strip: OrientedStrip, models: Sequence[Model], ground: Ground) -> None:
    cards = strip_cards(strip, models, ground)
    write_atomic(out / CARDS, "\n".join([*cards.deck, ""]))
    write_atomic(out / OUTPUT_CARDS, "\n".join([*cards.output, ""]))
    write_atomic(out / CARD_KEY, to_csv(("point", "number"), cards.key.items()))
