"""Writer of a session's journal: all lines on the link and all entries of the book, in order."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from types import TracebackType
from typing import Any

import msgspec

import a7sim
from a7sim.errors import A7SimError
from a7sim.instrument.language import LinkEvent, SharedInstrument
from a7sim.journal.append_file import AppendOnlyFile, Durability, JournalWriteError, write_failure_message
from a7sim.journal.checkpoints import LINES_PER_CHECKPOINT, Checkpoint, state_hash, to_lines
from a7sim.journal.format import SCHEMA_VERSION, ChecksumChain, Event, JournalFile, has_header, read_journal
from a7sim.journal.session_files import JOURNAL, SCENARIO_SUFFIX, STATES, TORN, prepare_folder
from a7sim.operator.people.observation_book import BookEntry
from a7sim.scenario import Scenario, hash_scenario, to_data
from a7sim.scene import PICTURES

_REGISTRATION = re.compile(r"(^|[\s;:])REC(ORD)?(:STR(IKE)?)?\s", re.IGNORECASE)

_MAX_SHOWN_LENGTH = 300


def is_registration(line: str) -> bool:
    """Return whether a line registers a reading or strikes it out."""
    return _REGISTRATION.search(line) is not None


def software_version() -> str:
    """Return name and version of the software that writes journals."""
    return f"a7sim {a7sim.__version__}"


@dataclass(frozen=True)
class Header:
    """Header of a journal, and the scenario, which is in a separate file because it contains truth."""

    line: dict[str, Any]
    scenario: Scenario | None = None


def make_header(command: str, scenario: Scenario, seed: int, **settings: Any) -> Header:
    """Return the header of a journal: all that a session depends on except its lines."""
    line = {
        "schema_version": SCHEMA_VERSION,
        "software": software_version(),
        "command": command,
        "title": scenario.title,
        "scenario_hash": hash_scenario(scenario),
        "seed": seed,
        "variant": scenario.instrument.variant,
        "pictures": PICTURES,
        "settings": settings,
    }
    return Header(line, scenario)


def make_header_without_scenario(command: str, **settings: Any) -> Header:
    """Return the header of a journal for an instrument with an unknown scenario."""
    first = {"schema_version": SCHEMA_VERSION, "software": software_version(), "command": command}
    return Header(first | {"scenario_hash": None, "settings": settings})


@dataclass(frozen=True)
class JournalOptions:
    """Options of a journal: its durability, and whether it continues an existing one."""

    durability: Durability = "records"
    resumes: bool = False
    states: bool = True
    """Whether states are written beside the journal, for seeking in it; they are part of the truth."""

    def prepare(self, folder: Path | None, force: bool, parts: Iterable[str] = ()) -> None:
        """Check that a session and its parts can be written to a folder, unless it is resumed. Raises A7SimError."""
        if folder is not None and not self.resumes:
            prepare_folder(folder, force, parts)

    def for_part(self, folder: Path | None) -> "JournalOptions":
        """Return the options for a part of a session, which may have been interrupted before this part started."""
        is_started = folder is not None and has_header(folder / JOURNAL)
        return replace(self, resumes=self.resumes and is_started)


class Journal:
    """Journal, a listener from its creation and a writer from its opening as a context.

    A resumed session runs again from its start: up to the end of the existing journal, its events are compared with it;
    then writing continues.
    """

    def __init__(self, journal_options: JournalOptions | None = None) -> None:
        self.lines_over_the_link = 0
        self._journal_options = journal_options or JournalOptions()
        self._unwritten: list[LinkEvent] = []
        self._file: AppendOnlyFile | None = None
        self._states: Path | None = None
        self._instrument: SharedInstrument | None = None
        self._existing: JournalFile | None = None
        self._chain = ChecksumChain()
        self._line = 0
        self._time = 0.0
        self._since_checkpoint = 0
        self._changes = 0

    def recording(self, folder: Path | None, header: Header, instrument: SharedInstrument | None) -> "Journal":
        """Start writing, if there is a folder; with checkpoints, if there is an instrument.

        A resumed session saves the truncated tail of its journal. Raises A7SimError if it cannot be written.
        """
        self._instrument = instrument
        if folder is not None:
            if self._journal_options.resumes:
                self._existing = read_journal(folder / JOURNAL)
                save_truncated_tail(self._existing)
            self._open_files(folder, self._existing.size if self._existing else 0, b"")
            try:
                if self._existing is None:
                    _write_scenario(folder, header)
                self._write(header.line)
                for event in self._unwritten:
                    self.on_link_event(event)
            except BaseException:
                self._close()
                raise
        self._unwritten.clear()
        return self

    def resume_at(
        self, existing: JournalFile, instrument: SharedInstrument, checkpoints: list[Checkpoint]
    ) -> "Journal":
        """Continue a journal whose session is restored in an instrument. Raises A7SimError if it cannot be written."""
        save_truncated_tail(existing)
        self._instrument = instrument
        self._open_files(existing.path.parent, existing.size, to_lines(checkpoints))
        self._chain.crc, self._line = existing.crc, len(existing)
        last = checkpoints[-1].line if checkpoints else 1
        self._since_checkpoint = sum(not existing.event(number).kind for number in range(last + 1, len(existing) + 1))
        self._changes = sum(len(each.state["autograph"]["registered"]) for each in checkpoints)
        return self

    def _open_files(self, folder: Path, size: int, states: bytes) -> None:
        self._file = AppendOnlyFile(folder / JOURNAL, self._journal_options.durability, size)
        if self._journal_options.states:
            self._states = folder / STATES
            self._states.write_bytes(states)

    def on_link_event(self, event: LinkEvent) -> None:
        """Write an event on the link. Raises JournalWriteError if that fails, except for a disconnect."""
        try:
            self._write_event(event)
        except JournalWriteError:
            if event.direction != "-":
                raise

    def _write_event(self, event: LinkEvent) -> None:
        if event.direction in "<>":
            self.lines_over_the_link += 1
        if self._file is None:
            if self._instrument is None:
                self._unwritten.append(event)
            return
        at_once, self._time = False, event.time
        if event.direction == ">":
            if (
                self._since_checkpoint >= LINES_PER_CHECKPOINT
                and self._instrument is not None
                and self._instrument.is_idle
            ):
                self._checkpoint(event.time, self._instrument)
            at_once = is_registration(event.text)
        self._since_checkpoint += 1
        self._write(Event(event.time, event.client, event.direction, event.text), at_once)

    def on_book_entry(self, entry: BookEntry, time: float) -> None:
        """Write an entry of the observation book, or its striking out. Raises A7SimError if that fails."""
        if self._file is None:
            return
        self._time = time
        if entry.struck:
            self._write(Event(time, kind="strike", number=entry.number, struck=entry.struck))
        else:
            self._write(
                Event(
                    time,
                    kind="entry",
                    number=entry.number,
                    model=entry.model,
                    form=entry.form,
                    round=entry.round,
                    point=entry.point,
                    item=entry.item,
                    reading=entry.reading,
                    remark=entry.remark,
                )
            )

    def close(self, error: BaseException | None) -> None:
        """Close the journal, with a last checkpoint unless an error occurred. Raises A7SimError if that fails."""
        try:
            if error is None and self._instrument is not None and self._instrument.is_idle and self._since_checkpoint:
                self._checkpoint(self._time, self._instrument)
            if error is None and self._existing is not None and self._line < len(self._existing):
                location = self._existing.location(self._line + 1)
                raise A7SimError(f"{location}: expected the end of the session, got a line that is left over")
        finally:
            self._close()

    def _close(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            file.close()

    def _checkpoint(self, time: float, instrument: SharedInstrument) -> None:
        state = instrument.state(self._changes)
        self._changes = len(instrument.autograph.recorder.changes)
        self._since_checkpoint = 0
        hash_of_state = state_hash(state)
        self._write(Event(time, kind="state", hash=hash_of_state))
        if self._states is not None:
            try:
                with self._states.open("ab") as states:
                    states.write(to_lines([Checkpoint(self._line, time, hash_of_state, state)]))
            except OSError as error:
                raise write_failure_message(self._states, error) from error

    def _write(self, data: Any, at_once: bool = False) -> None:
        if self._file is None:
            return
        line = self._chain.line(data)
        self._line += 1
        if self._existing is not None and self._line <= len(self._existing):
            if line != self._existing.lines[self._line - 1]:
                raise A7SimError(_difference_message(self._existing, self._line, line))
        else:
            self._file.add(line + b"\n", at_once)

    def __enter__(self) -> "Journal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self.close(error)


def write_header_only(folder: Path, header: Header) -> None:
    """Write a journal with only a header, for a folder of folders. Raises A7SimError."""
    file = AppendOnlyFile(folder / JOURNAL)
    _write_scenario(folder, header)
    file.add(ChecksumChain().line(header.line) + b"\n")
    file.close()


def _write_scenario(folder: Path, header: Header) -> None:
    if header.scenario is not None:
        data = msgspec.json.format(msgspec.json.encode(to_data(header.scenario))) + b"\n"
        file = AppendOnlyFile((folder / JOURNAL).with_suffix(SCENARIO_SUFFIX), "always")
        try:
            file.add(data)
        finally:
            file.close()


def save_truncated_tail(existing: JournalFile) -> None:
    """Write the truncated tail of a journal beside it. Raises A7SimError if that fails."""
    if existing.truncated_tail:
        try:
            (existing.path.parent / TORN).write_bytes(existing.truncated_tail)
        except OSError as error:
            raise A7SimError(f"{existing.path}: expected a journal that can be written: {error.strerror}") from error


def _difference_message(existing: JournalFile, number: int, line: bytes) -> str:
    existing_line, new_line = (
        each[:_MAX_SHOWN_LENGTH].decode("utf-8", "replace") for each in (existing.lines[number - 1], line)
    )
    if number == 1:
        return (
            f"{existing.location(number)}: expected a session of {software_version()} and its scenario, "
            f"got another: {existing_line}"
        )
    return f"{existing.location(number)}: expected this session's event, {new_line}, got another, {existing_line}"
