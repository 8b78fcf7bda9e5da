"""Running a scenario: a scene, an instrument, a line, and an operator who works it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from a7sim.documents import as_json
from a7sim.instrument import Autograph, build_autograph
from a7sim.instrument.language import Desk, Listener
from a7sim.link.client import Client
from a7sim.link.clock import Clock
from a7sim.link.inprocess import InProcessSerial
from a7sim.mistakes import Mistake
from a7sim.operator import DoesNotFit, Job, ModelJob, Person, work
from a7sim.scenario import Scenario
from a7sim.scene import Scene, build_scene
from a7sim.session import results
from a7sim.session.journal import Journal

JOURNAL, BOOK, MODELS, RESULTS = "session.jsonl", "book.csv", "models.csv", "results.json"


@dataclass
class Session:
    """An operator at an instrument with the photographs of a scenario in the drawer."""

    scenario: Scenario
    seed: int
    scene: Scene
    autograph: Autograph
    person: Person
    job: Job


def open_session(scenario: Scenario, seed: int, listener: Listener | None = None) -> Session:
    """Return a session ready to begin. Raises Mistake when a file of measurements is bad."""
    scene = build_scene(scenario, seed)
    autograph = build_autograph(scenario.instrument, scene.photographs, seed)
    clock = Clock()
    port = InProcessSerial(desk=Desk(autograph, listener), clock=clock, timeout=1.0)
    person = Person(Client(port), clock, scenario.observer, seed)
    return Session(scenario, seed, scene, autograph, person, job_of(scenario, scene))


def job_of(scenario: Scenario, scene: Scene) -> Job:
    """Return the job sheet: what of a scenario an operator is told."""
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
    return Job(scenario.camera, scenario.plan, models)


@dataclass(frozen=True)
class Watcher:
    """Who is told how a session goes on: an activity begins, a point is done."""

    begins: Callable[[str], None] = lambda _: None
    tick: Callable[[], None] = lambda: None


def run(
    scenario: Scenario,
    seed: int,
    out: Path | None = None,
    watcher: Watcher | None = None,
    force: bool = False,
) -> dict[str, Any]:
    """Work through a scenario and return its document of results; with `out`, leave the four files there.

    `status` in the document is 'complete', or 'does not fit' with the operator's `message`. An interrupted
    session (KeyboardInterrupt) leaves whole files and goes on up. Raises Mistake for a bad file of
    measurements or a folder that cannot be used, before anything is written.
    """
    watcher = watcher or Watcher()
    heard: list[Listener] = []
    session = open_session(scenario, seed, lambda event: heard[0](event))  # noqa: PLW0108 - the journal is opened after the session
    if out is not None:
        _prepare_folder(out, force)
    document = results.header(scenario, seed) | {"status": "failed", "message": ""}
    done: list[dict[str, Any]] = []
    with Journal(out / JOURNAL if out else None, _journal_header(scenario, seed)) as journal:
        heard.append(journal.heard)
        try:
            for record in work(session.person, session.job, watcher.tick, watcher.begins):
                plan = next(model for model in scenario.models if model.name == record.model.name)
                truth = session.scene.relative_truth(plan)
                done.append(results.of_model(record, session.autograph, truth, plan.published))
            document["status"] = "complete"
        except DoesNotFit as trouble:
            document |= {"status": "does not fit", "message": str(trouble)}
        except KeyboardInterrupt:
            document |= {"status": "interrupted", "message": "the session was interrupted"}
            raise
        finally:
            book = session.person.book
            document |= {
                "models": done,
                "operator": {
                    "hours": round(session.person.clock.now / 3600.0, 3),
                    "lines_over_the_link": journal.events,
                    "book_entries": len(book.entries),
                    "struck_out": sum(bool(entry.struck) for entry in book.entries),
                    "remarks": book.remarks,
                },
            }
            if out is not None:
                _write_whole(out / BOOK, book.as_csv())
                _write_whole(out / MODELS, results.models_csv(done))
                _write_whole(out / RESULTS, as_json(document))
    return document


def _journal_header(scenario: Scenario, seed: int) -> dict[str, Any]:
    return {"scenario": scenario.title, "seed": seed, "variant": scenario.instrument.variant}


def _prepare_folder(out: Path, force: bool) -> None:
    """Make a folder for a session's files. Raises Mistake when it exists, unless forced."""
    try:
        if out.exists() and not out.is_dir():
            raise Mistake(f"{out}: expected a folder, got a file")
        if out.exists() and not force:
            raise Mistake(
                f"{out}: expected a folder that does not exist yet, got one that does (--force writes into it)"
            )
        out.mkdir(parents=True, exist_ok=True)
        for name in (JOURNAL, BOOK, MODELS, RESULTS):
            (out / name).unlink(missing_ok=True)
    except OSError as error:
        raise Mistake(f"{str(out)[:200]}: expected a folder that can be written: {error.strerror}") from error


def _write_whole(path: Path, text: str) -> None:
    temporary = path.with_name(path.name + ".part")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)
