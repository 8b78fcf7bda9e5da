"""Set-up of a console: a local instrument, a served one, or playback."""

from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from a7sim.cli.link_options import token_from
from a7sim.cli.prompt import data_folder
from a7sim.console.actions.preset_recovery import LoggedLine
from a7sim.console.config import ConsoleConfig, ResumeOffer
from a7sim.console.drawing.job_sheet import JobSheet
from a7sim.console.widgets.header_footer import format_elapsed
from a7sim.errors import A7SimError
from a7sim.link.client.client import Client
from a7sim.link.clock import Clock, WallClock
from a7sim.scenario import Scenario, scenario_name

if TYPE_CHECKING:
    from a7sim.journal.interactive import InteractiveSession
    from a7sim.journal.session_store import SavedSession

SESSIONS_FOLDER = "sessions"


class LocalConsole:
    """Console of a scenario's instrument in this process. The instrument is imported after the first paint."""

    def __init__(self, name: str, scenario: Scenario, seed: int | None, out: Path | None, resume: bool | None) -> None:
        self._name, self._scenario = name, scenario
        self._seed = scenario.seed if seed is None else seed
        self._folder = out or data_folder() / SESSIONS_FOLDER / scenario_name(name)
        self._resume = resume
        self._clock, self._wall = Clock(), WallClock()
        self._resumed: SavedSession | None = None
        self._interactive: InteractiveSession | None = None
        self._greeting = ""
        if resume is not None or (out is not None and out.exists()):
            self._decide_by_options(out)

    def _decide_by_options(self, out: Path | None) -> None:
        last = self._last_session()
        if self._resume:
            if last is None or last.resumable is None:
                reason = last.error if last else "found none"
                raise A7SimError(
                    f"--resume: expected a session of {self._name} at seed {self._seed} in {self._folder}: {reason}"
                )
            self._resume_if_chosen(last, True)
        elif last is None and out is not None and out.exists():
            raise A7SimError(
                f"{out}: expected a folder that does not exist yet, or that of a session of {self._name} at seed "
                f"{self._seed}, got another"
            )

    @property
    def config(self) -> ConsoleConfig:
        """Configuration before the start."""
        return ConsoleConfig(
            self._open_client,
            self._time,
            where=self._name,
            sheet=JobSheet(self._scenario.title, self._scenario.camera),
            resumable=self._resume_offer,
            greeting=lambda: self._greeting,
            history=self._history,
        )

    def _last_session(self) -> "SavedSession | None":
        if not self._folder.exists():
            return None
        from a7sim.journal.session_store import last_session

        return last_session(self._folder, self._scenario, self._seed)

    def _resume_offer(self) -> ResumeOffer | None:
        if self._resume is not None:
            return None
        last = self._last_session()
        if last is None:
            return None
        if last.resumable is None:
            self._greeting = f"new session: the last one cannot be resumed: {last.error}"
            return None
        if not last.has_changes:
            self._resume_if_chosen(last, True)
            self._greeting = ""
            return None
        left_at = datetime.fromtimestamp(last.last_activity).strftime("%Y-%m-%d %H:%M")  # local time
        about = f"{format_elapsed(last.ended_at_s)} at the instrument, left {left_at}, in {last.folder}"
        return ResumeOffer(about, lambda resumes: self._resume_if_chosen(last, resumes))

    def _resume_if_chosen(self, last: "SavedSession", resumes: bool) -> None:
        if resumes:
            self._resumed = last
            self._wall = WallClock(now=last.ended_at_s)
            self._greeting = f"resumed after {format_elapsed(last.ended_at_s)} at the instrument; ? is help"

    def _open_client(self) -> Client:
        """Open the interactive session, which is built on first use."""
        if self._interactive is None:
            from a7sim.journal.interactive import InteractiveSession  # during the first paint of the screen

            session = self._resumed.resumable if self._resumed else None
            self._interactive = InteractiveSession(self._scenario, self._seed, self._folder, self._clock, session)
        return self._interactive.open()

    def _history(self) -> Iterable[LoggedLine]:
        return (
            (LoggedLine(each.text, each.dir == "<") for each in self._interactive.history())
            if self._interactive
            else ()
        )

    def _time(self) -> float:
        self._clock.advance_to(self._wall.now)
        return self._clock.now

    def close(self) -> Path | None:
        """Close the journal; return its folder, None if nothing was started."""
        if self._interactive is None:
            return None
        self._interactive.close()
        return self._interactive.folder


def remote_console(url: str, sheet: JobSheet, token_file: Path | None, watching: bool = False) -> ConsoleConfig:
    """Return the configuration for a served instrument. Raises A7SimError if it does not answer."""
    token = token_from(token_file)
    Client.open(url, token=token).close()
    wall = WallClock()
    return ConsoleConfig(
        lambda: Client.open(url, token=token),
        lambda: wall.now,
        alone=False,
        where=url,
        sheet=sheet,
        watching=watching,
        greeting=_watching_greeting(url) if watching else lambda: "",
    )


def _watching_greeting(url: str) -> Callable[[], str]:
    return lambda: f"watching {url}; ? is help"


def playback_console(session: str) -> ConsoleConfig:
    """Return the configuration for watching a finished session. Raises A7SimError if there is none."""
    from a7sim.journal.recording import open_recording

    recording = open_recording(session)
    title = str(recording.journalled.header.get("title", ""))
    return ConsoleConfig(
        recording.open_client,
        lambda: recording.frame.time,
        where=session,
        sheet=JobSheet(title),
        watching=True,
        recording=recording,
        greeting=lambda: "playback: space plays, . steps, g jumps; ? is help",
    )


def is_url(target: str) -> bool:
    """Return whether the text names a live instrument rather than a finished session."""
    return "://" in target or Path(target).is_char_device()
