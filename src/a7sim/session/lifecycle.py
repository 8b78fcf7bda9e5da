"""Lifecycle of a recorded session: options, start, end, and its files."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.instrument import Autograph, build_autograph
from a7sim.instrument.language import Listener, SharedInstrument
from a7sim.journal.session_files import BOOK, RESULTS, write_atomic
from a7sim.journal.writer import Header, Journal, JournalOptions
from a7sim.link.client.client import Client, Port
from a7sim.link.clock import Clock
from a7sim.link.inprocess import InProcessSerial
from a7sim.operator import Job, ModelJob, OperatorGaveUp, Person
from a7sim.reduction import Undetermined
from a7sim.result_documents import Document, as_json
from a7sim.scenario import Scenario
from a7sim.scene import Scene, build_scene
from a7sim.session.result_records import SessionEnd, Status
from a7sim.session.results import operator_document, slips_document
from a7sim.strip_methods.strip import given_control

PortAdapter = Callable[[InProcessSerial], Port]
"""Function between instrument and operator: it takes the instrument's port and returns the operator's."""


def direct(port: InProcessSerial) -> Port:
    """Return the instrument's port unchanged."""
    return port


@dataclass(frozen=True)
class ProgressCallbacks:
    """Callbacks of a session's progress: start of an activity, end of a point."""

    on_activity: Callable[[str], None] = lambda _: None
    on_point: Callable[[], None] = lambda: None


@dataclass(frozen=True)
class RunOptions:
    """Options of a session other than scenario and seed: folder, progress, journal and link."""

    folder: Path | None = None
    """Folder of the files; None if no files are written."""
    force: bool = False
    """Write into a folder that exists already."""
    callbacks: ProgressCallbacks = field(default_factory=ProgressCallbacks)
    journal_options: JournalOptions = field(default_factory=JournalOptions)
    port_adapter: PortAdapter = direct

    def prepare_folder(self, parts: tuple[str, ...] = ()) -> None:
        """Prepare the folder and its subfolders `parts`, unless a session is resumed.

        Raises A7SimError if the folder exists, unless forced, or cannot be written.
        """
        self.journal_options.prepare(self.folder, self.force, parts)

    def for_part(self, name: str) -> "RunOptions":
        """Return the options of a session in the subfolder `name`.

        If a session is resumed, the part is resumed too if its journal has a line; otherwise it starts anew.
        """
        folder = self.folder / name if self.folder is not None else None
        return replace(
            self,
            folder=folder,
            force=self.force or self.journal_options.resumes,
            journal_options=self.journal_options.for_part(folder),
        )


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
    control = _control_coordinates(scenario, scene) if scenario.plan.absolute_orientation else {}
    return Job(scenario.camera, scenario.plan, models, scenario.grid_plate, control)


def _control_coordinates(scenario: Scenario, scene: Scene) -> dict[str, tuple[float, float, float]]:
    given = given_control(scenario, scene)
    return {name: (x, y, z) for name, (x, y, z) in zip(given.points, given.coordinates.T.tolist(), strict=True)}


class RecordedSession:
    """Session whose link events and book entries are written to a journal."""

    def __init__(self, session: Session, journal: Journal, options: RunOptions) -> None:
        self.session = session
        self.options = options
        self.end = SessionEnd()
        """Set at the end of `recording`."""
        self._journal = journal

    @contextmanager
    def recording(
        self,
        header: Header,
        results: Callable[[SessionEnd], Document],
        other_files: Callable[[], Mapping[str, str]] = dict,
        subject: str = "session",
    ) -> Iterator[None]:
        """Record the body in the journal, and set `end` after it.

        `end.status` is 'complete', 'does not fit' with the operator's `message`, 'interrupted', or 'failed' for any
        other exception of the body; only OperatorGaveUp and Undetermined are not raised again. However the body ends,
        the journal, the book, `other_files` by name, and `results` are written completely if there is a folder. The
        message of an interruption names the `subject`.
        """
        person, journal, folder = self.session.person, self._journal, self.options.folder
        status: Status = "failed"
        message = ""
        with journal.recording(folder, header, self.session.instrument):
            person.book.listener = lambda entry: journal.on_book_entry(entry, person.clock.now)
            try:
                yield
                status = "complete"
            except (OperatorGaveUp, Undetermined) as error:
                status, message = "does not fit", str(error)
            except A7SimError as error:
                message = str(error)
                raise
            except KeyboardInterrupt:
                status, message = "interrupted", f"the {subject} was interrupted"
                raise
            finally:
                operator = operator_document(person, journal.lines_over_the_link)
                self.end = SessionEnd(status, message, operator, slips_document(person))
                if folder is not None:
                    files = {BOOK: person.book.as_csv(), **other_files(), RESULTS: as_json(results(self.end))}
                    _write_files(folder, files)


def recorded_session(scenario: Scenario, seed: int, options: RunOptions) -> RecordedSession:
    """Return a session ready to start, with its journal. Raises A7SimError for an invalid file of measurements."""
    journal = Journal(options.journal_options)
    session = open_session(scenario, seed, journal.on_link_event, options.port_adapter)
    return RecordedSession(session, journal, options)


def _write_files(folder: Path, files: Mapping[str, str]) -> None:
    """Write files into a folder; if that fails while another exception is raised, keep the other exception."""
    earlier_error = sys.exception()
    try:
        for name, text in files.items():
            write_atomic(folder / name, text)
    except OSError:
        if earlier_error is None:
            raise
