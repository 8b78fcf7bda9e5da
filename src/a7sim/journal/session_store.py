"""Store of a user's sessions: one folder each, to resume the last one or start a new one."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.journal.append_file import is_being_written
from a7sim.journal.format import read_journal
from a7sim.journal.resuming import ResumableSession, find_resumable
from a7sim.journal.session_files import JOURNAL
from a7sim.scenario import Scenario, hash_scenario

COMMAND = "console"


@dataclass(frozen=True)
class SavedSession:
    """Session that was left or interrupted."""

    folder: Path
    resumable: ResumableSession | None
    error: str = ""
    """Reason why it cannot be resumed, if `resumable` is None."""

    @property
    def ended_at_s(self) -> float:
        """Simulated time in s of its end."""
        journalled = self.resumable.journalled if self.resumable else ()
        return self.resumable.journalled.event(len(journalled)).t if self.resumable and len(journalled) > 1 else 0.0

    @property
    def has_changes(self) -> bool:
        """Return whether anything was changed, and not only viewed."""
        if self.resumable is None:
            return False
        journals = self.resumable.journalled
        events = (journals.event(number) for number in range(len(journals), 1, -1))
        return any(event.dir == ">" and _is_change(event.text) for event in events)

    @property
    def last_activity(self) -> float:
        """Wall-clock time of the last event."""
        return (self.folder / JOURNAL).stat().st_mtime


def _is_change(line: str) -> bool:
    return any(unit and "?" not in unit for unit in line.split(";"))


def last_session(folder: Path, scenario: Scenario, seed: int) -> SavedSession | None:
    """Return the last session of a scenario and a seed in a folder of this name, numbered or not, if any."""
    identity = hash_scenario(scenario), seed
    return next(
        (saved for each in _folders_by_time(folder) if (saved := _saved_session(each, *identity)) is not None), None
    )


def _folders_by_time(folder: Path) -> list[Path]:
    journals = [each for each in _numbered_folders(folder).values() if (each / JOURNAL).is_file()]
    return sorted(journals, key=lambda each: (each / JOURNAL).stat().st_mtime, reverse=True)


def _saved_session(folder: Path, scenario_hash: str, seed: int) -> SavedSession | None:
    try:
        header = read_journal(folder / JOURNAL).header
    except A7SimError as error:
        return SavedSession(folder, None, str(error))
    if (header.get("scenario_hash"), header.get("seed")) != (scenario_hash, seed):
        return None
    if is_being_written(folder / JOURNAL):
        return SavedSession(folder, None, f"{folder}: the session is in use")
    try:
        return SavedSession(folder, find_resumable(folder, COMMAND))
    except A7SimError as error:
        return SavedSession(folder, None, str(error))


def new_folder(folder: Path) -> Path:
    """Create a folder of this name, numbered if there are others, and return it. Raises A7SimError if that fails."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        for each in _free_names(folder):
            try:
                each.mkdir()
            except FileExistsError:
                continue
            return each
    except OSError as error:
        raise A7SimError(f"{folder}: expected a folder that can be written: {error.strerror}") from error
    raise AssertionError("there is always another number")


def _numbered_folders(folder: Path) -> dict[int, Path]:
    """Return the folders of this name by number; number 1 has no suffix."""
    if not folder.parent.is_dir():
        return {}
    found = (
        (re.fullmatch(rf"{re.escape(folder.name)}(?:-(\d+))?", each.name), each) for each in folder.parent.iterdir()
    )
    return {int(match[1] or 1): each for match, each in found if match}


def _free_names(folder: Path) -> Iterator[Path]:
    number = max(_numbered_folders(folder), default=0)
    while True:
        number += 1
        yield folder if number == 1 else folder.with_name(f"{folder.name}-{number}")
