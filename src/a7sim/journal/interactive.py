"""Interactive session at an instrument in this process, journalled and resumable."""

from collections.abc import Iterator
from pathlib import Path

from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.journal.format import Event
from a7sim.journal.resuming import ResumableSession, restore_instrument
from a7sim.journal.session_store import COMMAND, new_folder
from a7sim.journal.writer import Journal, JournalOptions, make_header
from a7sim.link.client.client import Client
from a7sim.link.client.ports import TIMEOUT_S
from a7sim.link.clock import Clock
from a7sim.link.inprocess import InProcessSerial
from a7sim.scenario import Scenario
from a7sim.scene import build_scene


class InteractiveSession:
    """Session at the instrument of a scenario, which is built on first use.

    The journal starts in a new folder of the name `folder`, or continues if `resumable` is an earlier session.
    """

    def __init__(
        self, scenario: Scenario, seed: int, folder: Path, clock: Clock, resumable: ResumableSession | None = None
    ) -> None:
        self.clock = clock
        self.resumable = resumable
        self.folder = resumable.journalled.path.parent if resumable else folder
        self._scenario, self._seed = scenario, seed
        self._journal = Journal(JournalOptions(resumes=resumable is not None))
        self._instrument: SharedInstrument | None = None
        self._locked = False

    def open(self) -> Client:
        """Return a client of the instrument. Raises A7SimError if the journal cannot be written or continued."""
        if self._instrument is None:
            self._instrument = self._start() if self.resumable is None else self._resume(self.resumable)
        client = Client(InProcessSerial(instrument=self._instrument, clock=self.clock, timeout=TIMEOUT_S))
        if self._locked:
            client.ask("SYST:LOCK:REQ?")
        return client

    def _start(self) -> SharedInstrument:
        scenario, seed = self._scenario, self._seed
        instrument = SharedInstrument(
            build_autograph(scenario.instrument, build_scene(scenario, seed).mountable, seed),
            self._journal.on_link_event,
        )
        self.folder = new_folder(self.folder)
        self._journal.recording(self.folder, make_header(COMMAND, scenario, seed), instrument)
        return instrument

    def _resume(self, resumable: ResumableSession) -> SharedInstrument:
        instrument, time, lock_holder = restore_instrument(resumable, self._journal, from_checkpoint=True)
        self.clock.advance_to(time)
        self._locked = lock_holder is not None
        return instrument

    def history(self) -> Iterator[Event]:
        """Yield the lines and replies of the resumed session."""
        existing = self.resumable.journalled if self.resumable else None
        for number in range(2, len(existing) + 1 if existing else 0):
            assert existing is not None
            event = existing.event(number)
            if event.dir in ("<", ">"):
                yield event

    def close(self) -> None:
        """Close the journal, which can be resumed. Raises A7SimError if it cannot be completed."""
        if self._instrument is not None:
            self._journal.close(None)
