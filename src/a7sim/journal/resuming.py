"""Resuming of an interrupted session from its folder."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from a7sim.errors import A7SimError
from a7sim.instrument.language import SharedInstrument
from a7sim.journal.format import SCHEMA_VERSION, JournalFile, read_journal
from a7sim.journal.replay import Replay, ReplayDifference, replay_lines, scenario_of_journal
from a7sim.journal.session_files import JOURNAL
from a7sim.journal.writer import Journal, software_version
from a7sim.scenario import Scenario


@dataclass(frozen=True)
class ResumableSession:
    """Started session: its journal, and the scenario and the seed in it."""

    journalled: JournalFile
    scenario: Scenario
    seed: int

    @property
    def settings(self) -> dict[str, Any]:
        """Options other than the scenario, by name."""
        return dict(self.journalled.header["settings"])

    def setting(self, name: str) -> Any:
        """Return an option other than the scenario, None if it was not recorded."""
        return self.settings.get(name)


def find_resumable(folder: Path, command: str) -> ResumableSession:
    """Return the session that a command started in a folder. Raises A7SimError if it cannot be resumed."""
    journalled = read_journal(folder / JOURNAL)
    for name, expected in (("command", command), ("software", software_version())):
        got = journalled.header.get(name)
        if got != expected:
            raise A7SimError(f"{journalled.location(1)}: expected a session of {expected} to resume, got one of {got}")
    version = journalled.header["schema_version"]
    if version != SCHEMA_VERSION:
        raise A7SimError(
            f"{journalled.location(1)}: expected schema_version {SCHEMA_VERSION} to resume, got {version}, "
            "which can be replayed only"
        )
    return ResumableSession(journalled, *scenario_of_journal(journalled))


class RestoredInstrument(NamedTuple):
    """Instrument in the state of a journal, without its clients: the time in s, and the holder of the lock."""

    instrument: SharedInstrument
    time: float
    lock_holder: str | None


def restore_instrument(
    resumable: ResumableSession, journal: Journal, from_checkpoint: bool = False
) -> RestoredInstrument:
    """Return an instrument in the state of its journal; the journal continues.

    All events, or those behind the last checkpoint, are replayed. Raises A7SimError if the replay differs.
    """
    replay = Replay(resumable.journalled)
    first = replay.seek(len(resumable.journalled) + 1) if from_checkpoint else 2
    for number, _, difference in replay_lines(replay, first):
        if difference is not None:
            raise A7SimError(f"{resumable.journalled.location(number)}: {_difference_message(difference)}")
    instrument = replay.instrument
    instrument.listener = journal.resume_at(resumable.journalled, instrument, replay.checkpoints).on_link_event
    for event in replay.pending_events():
        journal.on_link_event(event)
    lock_holder = instrument.lock_holder
    for client in [*instrument.clients]:
        instrument.close(client, replay.time)
    return RestoredInstrument(instrument, replay.time, lock_holder)


def _difference_message(difference: ReplayDifference) -> str:
    expected, got = difference.journalled or "nothing", difference.replayed or "nothing"
    return f"expected the instrument's event, {got}, got another, {expected}"
