"""Environment of an attempt: the instrument of an exercise with its action log, clock and journal."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from a7sim.errors import A7SimError
from a7sim.instrument.language import LinkEvent, Listener, SharedInstrument
from a7sim.journal.format import JournalFile, read_journal
from a7sim.journal.replay import Replay, ReplayDifference, replay_lines
from a7sim.journal.session_files import JOURNAL
from a7sim.journal.writer import Header, Journal, JournalOptions, make_header_without_scenario, software_version
from a7sim.link.clock import Clock
from a7sim.scenario import Scenario, hash_scenario
from a7sim.scene import Scene, build_scene
from a7sim.training.action_log import ActionLog, LoggedAutograph
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.exercise import ExerciseFolder
from a7sim.training.variation import scenario_for

_CHECKSUM = re.compile(r"(?<=bytes, )crc32 [0-9a-f]{8}")

JOURNAL_COMMAND = "train"
"""Command in the header of an attempt's journal."""


class UnreliableJournalError(A7SimError):
    """Damaged journal, or journal whose replay differs."""


@dataclass(frozen=True)
class AttemptEnvironment:
    """Instrument of an exercise with its surroundings."""

    exercise_folder: ExerciseFolder
    scenario: Scenario
    seed: int
    scene: Scene
    instrument: SharedInstrument
    clock: Clock
    autograph: LoggedAutograph

    @property
    def action_log(self) -> ActionLog:
        """Log of all actions."""
        return self.autograph.action_log

    def record(
        self, written_answers: dict[str, str] | None = None, hidden: dict[str, Any] | None = None
    ) -> AttemptRecord:
        """Return the record of the attempt so far."""
        exercise = self.exercise_folder.exercise
        return AttemptRecord(
            exercise, self.scenario, self.scene, self.autograph, self.action_log, written_answers or {}, hidden or {}
        )

    def snapshot(self) -> "AttemptEnvironment":
        """Return a copy with the same state and without a journal.

        Call it only while no client is connected.
        """
        autograph = LoggedAutograph.from_parts(self.scenario.instrument, self.scene.mountable, self.seed)
        instrument = SharedInstrument(autograph, autograph.action_log.on_link_event)
        instrument.restore(self.instrument.state())
        autograph.action_log.copy_from(self.action_log)
        return replace(self, instrument=instrument, clock=Clock(self.clock.now), autograph=autograph)


def header_for(exercise_folder: ExerciseFolder, scenario: Scenario, seed: int, student: str, mode: str) -> Header:
    """Return the header of an attempt's journal. It contains only the hash of the scenario, which is truth."""
    line = make_header_without_scenario(JOURNAL_COMMAND, exercise=exercise_folder.name, student=student, mode=mode).line
    return Header(
        line | {"title": exercise_folder.exercise.title, "scenario_hash": hash_scenario(scenario), "seed": seed}
    )


def _build_parts(
    exercise_folder: ExerciseFolder, seed: int, observer: dict[str, Any]
) -> tuple[Scenario, Scene, LoggedAutograph]:
    scenario = scenario_for(exercise_folder, seed, observer)
    scene = build_scene(scenario, seed)
    return scenario, scene, LoggedAutograph.from_parts(scenario.instrument, scene.mountable, seed)


def dry_run_environment(exercise_folder: ExerciseFolder, seed: int) -> AttemptEnvironment:
    """Return the environment of an attempt without a journal, before its opening."""
    scenario, scene, autograph = _build_parts(exercise_folder, seed, {})
    return AttemptEnvironment(
        exercise_folder,
        scenario,
        seed,
        scene,
        SharedInstrument(autograph, autograph.action_log.on_link_event),
        Clock(),
        autograph,
    )


@contextmanager
def open_environment(
    exercise_folder: ExerciseFolder,
    seed: int,
    folder: Path,
    student: str,
    mode: str,
    observer: dict[str, Any] | None = None,
) -> Iterator[AttemptEnvironment]:
    """Open the environment of a new attempt with a journal in a folder, before its opening.

    Raises A7SimError if the journal cannot be written.
    """
    scenario, scene, autograph = _build_parts(exercise_folder, seed, observer or {})
    journal = Journal(JournalOptions(states=False))
    instrument = SharedInstrument(autograph, tee_listener(journal.on_link_event, autograph.action_log.on_link_event))
    nominal = scenario_for(exercise_folder, seed)
    with journal.recording(folder, header_for(exercise_folder, nominal, seed, student, mode), instrument):
        yield AttemptEnvironment(exercise_folder, scenario, seed, scene, instrument, Clock(), autograph)


@contextmanager
def resume_environment(exercise_folder: ExerciseFolder, seed: int, folder: Path) -> Iterator[AttemptEnvironment]:
    """Open the environment of an attempt in the state of its journal. Raises UnreliableJournalError, A7SimError."""
    journal_file = read_journal(folder / JOURNAL)
    if journal_file.header.get("software") != software_version():
        raise A7SimError(
            f"{journal_file.location(1)}: expected an attempt of {software_version()} to resume, got one of "
            f"{journal_file.header.get('software')} (a7sim train reset starts a new one)"
        )
    environment, replay = _replay_journal(exercise_folder, seed, journal_file)
    journal = Journal(JournalOptions(resumes=True, states=False)).resume_at(
        journal_file, environment.instrument, replay.checkpoints
    )
    environment.instrument.listener = tee_listener(journal.on_link_event, environment.action_log.on_link_event)
    with journal:
        for event in replay.pending_events():
            journal.on_link_event(event)
        for client in [*environment.instrument.clients]:
            environment.instrument.close(client, environment.clock.now)
        yield environment


def replay_environment(exercise_folder: ExerciseFolder, seed: int, journal_file: JournalFile) -> AttemptEnvironment:
    """Return the environment of an attempt in the state of its journal. Raises UnreliableJournalError."""
    return _replay_journal(exercise_folder, seed, journal_file)[0]


def _replay_journal(
    exercise_folder: ExerciseFolder, seed: int, journal_file: JournalFile
) -> tuple[AttemptEnvironment, Replay]:
    scenario, scene, autograph = _build_parts(exercise_folder, seed, {})
    expected = header_for(exercise_folder, scenario, seed, "", "").line
    for name in ("command", "scenario_hash", "seed"):
        got = journal_file.header.get(name)
        if got != expected[name]:
            raise UnreliableJournalError(
                f"{journal_file.location(1)}: expected an attempt with {name} {expected[name]}, got {got}"
            )
    replay = Replay(journal_file, autograph=autograph)
    autograph.blank_pictures = True
    assert replay.instrument.listener is not None
    replay.instrument.listener = tee_listener(replay.instrument.listener, autograph.action_log.on_link_event)
    for number, _, difference in replay_lines(replay):
        if difference is not None and not _differ_only_in_pictures(difference):
            replayed, journalled = difference.replayed or "nothing", difference.journalled or "nothing"
            raise UnreliableJournalError(
                f"{journal_file.location(number)}: expected the replayed line, {replayed[:200]}, got {journalled[:200]}"
            )
    autograph.blank_pictures = False
    return AttemptEnvironment(
        exercise_folder, scenario, seed, scene, replay.instrument, Clock(replay.time), autograph
    ), replay


def _differ_only_in_pictures(difference: ReplayDifference) -> bool:
    """Return whether two replies differ only in the checksums of pictures, which are not drawn again."""
    journalled, again = (_CHECKSUM.sub("", each) for each in (difference.journalled, difference.replayed))
    return journalled == again != difference.replayed


def tee_listener(first: Listener, second: Listener) -> Listener:
    """Return a listener that calls both."""

    def call_both(event: LinkEvent) -> None:
        first(event)
        second(event)

    return call_both
