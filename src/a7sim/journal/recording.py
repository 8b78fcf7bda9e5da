"""Recording of a session: its journal replayed on a fresh instrument, forwards and backwards, for a viewer."""

import re
from bisect import bisect_left, bisect_right
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import msgspec

from a7sim.errors import A7SimError
from a7sim.instrument.language import LinkEvent, SharedInstrument
from a7sim.journal.find_line import find_line
from a7sim.journal.format import ChecksumChain, Event, JournalFile, read_journal
from a7sim.journal.replay import Replay
from a7sim.journal.script_runner import ScriptRunner
from a7sim.journal.scripts import SUFFIX, find_script, read_script
from a7sim.journal.session_files import JOURNAL
from a7sim.journal.writer import is_registration, make_header
from a7sim.link.client.client import Client
from a7sim.link.client.ports import TIMEOUT_S
from a7sim.link.inprocess import InProcessSerial
from a7sim.scenario import Scenario

_SENT_DIRECTIONS = (">", "!")

_SCREEN_QUERY = re.compile(r"EYEP\w*:PICT\w*\?|COUN\?;:PROJ1:", re.IGNORECASE)
"""Line that draws a screen: it is replayed, and is not a step."""

_POINT = re.compile(r'(?:EYEP\w*(?::STER\w*)?\?|REC(?:ORD)?)\s+"((?:[^"]|"")+)"', re.IGNORECASE)

MAX_REPLAYED_LINES = 200
"""Number of lines that are replayed rather than seeking a later checkpoint."""

_MAX_STEPS_BACK = 200
"""Steps searched backwards for the current point."""


@dataclass(frozen=True)
class Frame:
    """State of a recording: steps are the lines except those that draw a screen; 0 is before the first."""

    step: int
    time: float
    """Simulated s."""
    line: str = ""
    """Last line and its client."""
    point: str | None = None
    """Point that was last viewed or registered."""
    origins: dict[str, float] = field(default_factory=dict)
    """Reading of each counter at the origin of the frame."""
    units: dict[str, float] = field(default_factory=dict)
    """Units per mm of each counter."""
    error: str = ""
    """Difference of the replay from the journal, if any."""


class Recording:
    """Replayed session, and a separate front end of the instrument for viewing it.

    The front end has a shared instrument of its own, so that a viewer is not a client of the session. Seeking and
    viewing must not be concurrent.
    """

    def __init__(self, journalled: JournalFile, scenario: Scenario | None = None) -> None:
        """Create the recording of a journal; its scenario is beside it unless given. Raises A7SimError."""
        self.journalled = journalled
        self._scenario = scenario
        self._numbers: list[int] = []
        self._times: list[float] = []
        self._records: list[int] = []
        self._checkpoints: list[int] = []
        for number in range(2, len(journalled) + 1):
            self._add_line(number, journalled.event(number))
        if not self._numbers:
            raise A7SimError(f"{journalled.path}: expected a session with lines on the link, got none")
        self._replay = Replay(journalled, scenario)
        self._front = SharedInstrument(self._replay.instrument.autograph)
        self._next = 2
        self._error = ""
        self.frame = self._make_frame(0)

    def _add_line(self, number: int, event: Event) -> None:
        if event.kind == "state":
            self._checkpoints.append(number)
        elif event.dir in _SENT_DIRECTIONS and not _SCREEN_QUERY.match(event.text):
            self._numbers.append(number)
            self._times.append(event.t)
            if is_registration(event.text):
                self._records.append(len(self._numbers))

    @property
    def steps(self) -> int:
        """Number of lines that draw no screen."""
        return len(self._numbers)

    def open_client(self) -> Client:
        """Return a client that sees the instrument at the present step."""
        return Client(InProcessSerial(instrument=self._front, timeout=TIMEOUT_S))

    def seek(self, step: int) -> Frame:
        """Move forwards or backwards until a step is complete; 0 is the start."""
        end = self._numbers[step] if step < self.steps else len(self.journalled) + 1
        if self._is_seek_faster(end):
            self._replay = Replay(self.journalled, self._scenario)
            self._next = self._replay.seek(end)
            self._front.autograph = self._replay.instrument.autograph
        while self._next < end:
            difference = self._replay.apply(self._next, self.journalled.event(self._next))
            if difference is not None and not self._error:
                expected, got = difference.journalled or "nothing", difference.replayed or "nothing"
                self._error = f"{self.journalled.location(difference.line)}: expected again {expected}, got {got}"
            self._next += 1
        self.frame = self._make_frame(step)
        return self.frame

    def _is_seek_faster(self, end: int) -> bool:
        """Return whether continuing from a checkpoint is faster than from here."""
        index = bisect_left(self._checkpoints, end) - 1
        return end < self._next or (index >= 0 and self._checkpoints[index] - self._next > MAX_REPLAYED_LINES)

    def advance_until(self, is_enough: Callable[[], bool]) -> Frame:
        """Move forwards, at least one step if possible, until the predicate is true."""
        frame = self.frame
        while frame.step < self.steps:
            frame = self.seek(frame.step + 1)
            if is_enough():
                break
        return frame

    def step_at(self, time: float) -> int:
        """Return the last step completed by a simulated time in s."""
        return bisect_right(self._times, time)

    def next_record(self, step: int, direction: int) -> int | None:
        """Return the next step in a direction with a registration or a strike; None if there is none."""
        index = bisect_right(self._records, step) if direction > 0 else bisect_left(self._records, step) - 1
        return self._records[index] if 0 <= index < len(self._records) else None

    def find_step(self, words: str) -> int:
        """Return the step of a number, a time, @LINE or the text of a note. Raises A7SimError for anything else."""
        if words.isdecimal() and int(words) <= self.steps:
            return int(words)
        line = None if words.isdecimal() else find_line(self.journalled, words)
        if line is None:
            raise A7SimError(
                f"jump to {words}: expected a step up to {self.steps}, a time up to {self._times[-1]:.0f}s, "
                f"@{len(self.journalled)} or the text of a note"
            )
        answers = self.journalled.event(line).dir == "<"
        return min(bisect_left(self._numbers, line) + (not answers), self.steps)

    def _make_frame(self, step: int) -> Frame:
        scales = self._front.autograph.counter_scales
        line_text = ""
        if step:
            event = self.journalled.event(self._numbers[step - 1])
            line_text = f"{event.client}: {event.text}"
        return Frame(
            step,
            self._times[step - 1] if step else 0.0,
            line_text,
            self._point_at(step),
            {axis: origin for axis, (origin, _) in scales.items()},
            {axis: units for axis, (_, units) in scales.items()},
            self._error,
        )

    def _point_at(self, step: int) -> str | None:
        for number in reversed(self._numbers[max(0, step - _MAX_STEPS_BACK) : step]):
            names = _POINT.findall(self.journalled.event(number).text)
            if names:
                return str(names[-1]).replace('""', '"')
        return None


def open_recording(session: str) -> Recording:
    """Return the recording of a session's folder, of a journal, or of a script as it runs. Raises A7SimError."""
    path = Path(session)
    if path.is_dir():
        return Recording(read_journal(path / JOURNAL))
    if session.endswith(SUFFIX) or not path.exists():
        return _record_script(find_script(session))
    return Recording(read_journal(path))


def _record_script(file: Path) -> Recording:
    """Return the recording of a script run to its end, or to its first failed expectation."""
    script = read_script(file)
    events: list[LinkEvent] = []
    ScriptRunner(script, events.append).run()
    chain = ChecksumChain()
    header = chain.line(make_header("replay", script.scenario, script.seed, script=file.name).line)
    lines = [chain.line(Event(each.time, each.client, each.direction, each.text)) for each in events]
    return Recording(JournalFile(file, msgspec.json.decode(header), [header, *lines], b"", chain.crc), script.scenario)
