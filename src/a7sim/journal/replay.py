"""Replay of a journal on a fresh instrument: all replies and checkpoints are compared."""

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import msgspec

from a7sim.errors import A7SimError
from a7sim.instrument import Autograph, build_autograph
from a7sim.instrument.language import MAX_LINE_LENGTH, LinkEvent, SharedInstrument
from a7sim.instrument.language.shared_instrument import POLL_SECONDS
from a7sim.instrument.language.token_redaction import TOKEN_PLACEHOLDER
from a7sim.journal.checkpoints import Checkpoint, StateDifference, differences, read_checkpoints, state_hash
from a7sim.journal.format import Event, JournalFile
from a7sim.journal.session_files import SCENARIO_SUFFIX, STATES
from a7sim.link.clock import Clock
from a7sim.link.simulated_wait import feed_until_idle
from a7sim.scenario import Scenario, from_data, hash_scenario
from a7sim.scene import build_scene

RECORDED = "record"
"""Command whose journals contain the traffic of a client, and not the waits of the instrument."""


def scenario_of_journal(journalled: JournalFile, known: Scenario | None = None) -> tuple[Scenario, int]:
    """Return the scenario and the seed of a session; the scenario is beside the journal unless known.

    Raises A7SimError if they are not those of the session's start.
    """
    header = journalled.header
    if not knows_scenario(journalled):
        raise A7SimError(
            f"{journalled.location(1)}: expected a session whose scenario is known, got one that names none"
        )
    scenario = known or _read_scenario(journalled)
    try:
        found = hash_scenario(scenario)
    except A7SimError as error:
        raise A7SimError(f"{journalled.location(1)}: {error}") from error
    if found != header.get("scenario_hash"):
        raise A7SimError(
            f"{journalled.location(1)}: expected the scenario and the measurements that the session began with "
            f"(hash {str(header.get('scenario_hash'))[:12]}), got others ({found[:12]})"
        )
    return scenario, header["seed"]


def knows_scenario(journalled: JournalFile) -> bool:
    """Return whether the scenario of the instrument is known."""
    return journalled.header.get("scenario_hash") is not None


def _read_scenario(journalled: JournalFile) -> Scenario:
    """Return the scenario of a journal, which in version 2 is in its header. Raises A7SimError if there is none."""
    path, location = journalled.path.with_suffix(SCENARIO_SUFFIX), journalled.location(1)
    data = journalled.header.get("scenario")
    if data is None:
        location = str(path)
        try:
            data = msgspec.json.decode(path.read_bytes())
        except OSError as error:
            raise A7SimError(f"{path}: expected the scenario of the session: {error.strerror}") from error
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise A7SimError(f"{path}: expected the scenario of the session as JSON, got something else") from error
    try:
        return from_data(data)
    except A7SimError as error:
        raise A7SimError(f"{location}: {error}") from error


@dataclass(frozen=True)
class ReplayDifference:
    """First difference of a replay: the line, the journal's text and the instrument's; '' for none."""

    line: int
    journalled: str
    replayed: str
    parts: tuple[StateDifference, ...] = ()
    """Of the state, at the next checkpoint with a known state."""


class Replay:
    """Fresh instrument on which the lines of a journal are replayed, from the first or from a checkpoint.

    Scenario and seed may be given instead of those of the journal.
    """

    def __init__(
        self, journalled: JournalFile, known: Scenario | None = None, autograph: Autograph | None = None
    ) -> None:
        header = journalled.header
        settings = header.get("settings", {})
        if autograph is None:
            scenario, seed = scenario_of_journal(journalled, known)
            photographs = build_scene(scenario, seed, header.get("pictures", 1)).mountable
            autograph = build_autograph(scenario.instrument, photographs, seed)
        self.journalled = journalled
        self.instrument = SharedInstrument(
            autograph,
            self._on_link_event,
            TOKEN_PLACEHOLDER if settings.get("login") else None,
            0.0 if settings.get("realtime") else POLL_SECONDS,
            str(header.get("software", "")).removeprefix("a7sim "),
        )
        self.time = 0.0
        self.checkpoints: list[Checkpoint] = []
        """Passed checkpoints with their states in the replay."""
        self._clock = Clock() if header.get("command") == RECORDED else None
        self._replayed: deque[LinkEvent] = deque()
        self._changes = 0

    def _on_link_event(self, event: LinkEvent) -> None:
        if self._clock is None or event.direction == "<":
            self._replayed.append(event)

    def seek(self, line: int) -> int:
        """Move to the last checkpoint before a line with a known state; return the next line."""
        known: list[Checkpoint] = []
        for checkpoint in read_checkpoints(self.journalled.path.with_name(STATES)):
            if checkpoint.line >= line or not self._is_journalled(checkpoint):
                break
            known.append(checkpoint)
        if not known:
            return 2
        *before, last = known
        for each in before:
            self.instrument.autograph.restore_registrations(each.state["autograph"])
        self.instrument.restore(last.state)
        self.checkpoints = known
        self._changes = len(self.instrument.autograph.recorder.changes)
        self.time = last.t
        return last.line + 1

    def _is_journalled(self, checkpoint: Checkpoint) -> bool:
        number = checkpoint.line
        return 1 < number <= len(self.journalled) and self.journalled.event(number).hash == checkpoint.hash

    def apply(self, number: int, event: Event) -> ReplayDifference | None:
        """Replay an event of the journal; return its difference, if any."""
        self.time = event.t
        if event.kind == "state":
            return self._compare_state(number, event)
        if event.kind:
            return None
        if self._clock is not None:
            return self._apply_recorded(number, event)
        if event.dir != "<":
            surplus = self._surplus_output(number)
            self._feed(event)
            if surplus is not None:
                return surplus
        return self._compare_event(number, event)

    def _apply_recorded(self, number: int, event: Event) -> ReplayDifference | None:
        """Compare replies only, in their order: lines may have been sent before the replies arrived."""
        if event.dir == "<":
            return self._compare_event(number, event)
        if event.dir == "-":
            self._replayed.clear()
        self._feed(event)
        return None

    def final_difference(self) -> ReplayDifference | None:
        """Return the instrument's further output at the end of the journal, if any."""
        return self._surplus_output(len(self.journalled) + 1)

    def pending_events(self) -> list[LinkEvent]:
        """Return the instrument's further events at the end of the journal, which stopped before they were written."""
        surplus = list(self._replayed)
        self._replayed.clear()
        return surplus

    def _surplus_output(self, number: int) -> ReplayDifference | None:
        if not self._replayed:
            return None
        replayed_event = self._replayed.popleft()
        self._replayed.clear()
        return ReplayDifference(
            number, "", _format_exchange(replayed_event.client, replayed_event.direction, replayed_event.text)
        )

    def _compare_event(self, number: int, event: Event) -> ReplayDifference | None:
        replayed_event = self._replayed.popleft() if self._replayed else None
        if replayed_event is not None:
            same = (replayed_event.direction, replayed_event.text) == (event.dir, event.text)
            if same and (
                self._clock is not None or (replayed_event.time, replayed_event.client) == (event.t, event.client)
            ):
                return None
        replayed = (
            ""
            if replayed_event is None
            else _format_exchange(replayed_event.client, replayed_event.direction, replayed_event.text)
        )
        return ReplayDifference(number, _format_exchange(event.client, event.dir, event.text), replayed)

    def _feed(self, event: Event) -> None:
        instrument, client = self.instrument, event.client
        if event.dir == "+":
            instrument.open(client, time=event.t)
        elif event.dir == "-":
            instrument.close(client, event.t)
        elif client in instrument.clients:
            engine = instrument.clients[client]
            received = _event_bytes(event)
            if self._clock is None:
                engine.feed(received, event.t)
            else:
                self._clock.advance_to(event.t)
                feed_until_idle(engine, received, self._clock)

    def _compare_state(self, number: int, event: Event) -> ReplayDifference | None:
        state = self.instrument.state(self._changes)
        self._changes = len(self.instrument.autograph.recorder.changes)
        found = state_hash(state)
        self.checkpoints.append(Checkpoint(number, event.t, found, state))
        if found == event.hash:
            return None
        return ReplayDifference(number, f"state {event.hash}", f"state {found}", self._state_parts(number, state))

    def _state_parts(self, number: int, state: dict[str, Any]) -> tuple[StateDifference, ...]:
        for checkpoint in read_checkpoints(self.journalled.path.with_name(STATES)):
            if checkpoint.line == number and self._is_journalled(checkpoint):
                return tuple(differences(checkpoint.state, state))
        return ()

    def state_differences(self, after: int) -> tuple[StateDifference, ...]:
        """Return the differences of the state at the first checkpoint after a line, after replaying up to it."""
        for number in range(after + 1, len(self.journalled) + 1):
            event = self.journalled.event(number)
            if event.kind == "state":
                return self._state_parts(number, self.instrument.state(self._changes))
            self.apply(number, event)
        return ()


def replay_lines(replay: Replay, first: int = 2) -> Iterator[tuple[int, Event, ReplayDifference | None]]:
    """Replay the lines of a journal, from a line on; yield each with its number and its difference."""
    for number in range(first, len(replay.journalled) + 1):
        event = replay.journalled.event(number)
        yield number, event, replay.apply(number, event)


def _event_bytes(event: Event) -> bytes:
    if event.dir == "~":
        return b""
    if event.dir == "!":
        return b"x" * (MAX_LINE_LENGTH + 1) + b"\n"
    return event.text.encode("latin-1", "replace") + (b"\r\n" if event.text.endswith("\r") else b"\n")


def _format_exchange(client: str, direction: str, text: str) -> str:
    return f"{client} {direction} {text}".rstrip()
