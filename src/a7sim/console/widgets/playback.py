"""A film at its pace: played, paused, stepped through and jumped in, as the wall's clock and the keys have it."""

import math
from collections.abc import Callable
from time import monotonic
from typing import TYPE_CHECKING, Protocol

from a7sim.console.widgets.header_footer import format_elapsed
from a7sim.errors import A7SimError
from a7sim.link.client.client import Client

if TYPE_CHECKING:
    from a7sim.journal.recording import Frame, Recording

SPEEDS = (1.0, 10.0, 60.0, math.inf)
"""How many times as fast as it happened; the last as fast as it can be worked."""

TICK_S = 0.1
"""Between two looks at the clock while a film plays."""

RUN_S = 0.05
"""How long a film runs on between two pictures where it runs as fast as it can."""


class RequestRunner(Protocol):
    """Has work done in the station's thread, and what comes of it taken up in the screen's."""

    def __call__(self, work: "Callable[[Client], Frame]", then: "Callable[[Frame], None]") -> None:
        """Ask."""


class Playback:
    """A film, and how it is played. `shown` is called with every frame that it comes to."""

    def __init__(self, recording: "Recording", asks: RequestRunner, shown: "Callable[[Frame], None]") -> None:
        self.recording = recording
        self.frame = recording.frame
        self.playing = False
        self.speed = SPEEDS[0]
        self._asks = asks
        self._shown = shown
        self._aim = recording.frame.step
        self._running = 0
        self._since: tuple[float, float] | None = None

    def play_or_pause(self) -> None:
        """Play, from the beginning where the film is at its end; or pause."""
        self.playing = not self.playing
        self._since = None
        if self.playing and self.frame.step >= self.recording.steps:
            self.go_to(0)

    def pace(self, way: int) -> None:
        """Play at the next speed up or down."""
        at = SPEEDS.index(self.speed) + way
        self.speed = SPEEDS[min(max(at, 0), len(SPEEDS) - 1)]
        self._since = None

    def go_to(self, step: int) -> None:
        """Run to a step, as far as there is one."""
        self._since = None
        aim = self._aim = min(max(step, 0), self.recording.steps)
        self._run(lambda _: self.recording.seek(aim))

    def go_by(self, steps: int) -> None:
        """Pause, and run on or back by so many steps."""
        self.playing = False
        self.go_to(self._aim + steps)

    def go_to_record(self, way: int) -> bool:
        """Pause, and run to the next registration, on or back; return whether there is one."""
        self.playing = False
        step = self.recording.next_record(self._aim, way)
        if step is not None:
            self.go_to(step)
        return step is not None

    def jump(self, words: str) -> None:
        """Run to the step that a number, a time or the text of a note names. Raises Mistake where there is none."""
        self.go_to(self.recording.find_step(words))

    def tick(self) -> None:
        """Run on by what is due."""
        if not self.playing or self._running:
            return
        if self.frame.step >= self.recording.steps:
            self.playing = False
            self._shown(self.frame)
        elif math.isinf(self.speed):
            self._run(self._run_on)
        else:
            step = self.recording.step_at(self._due())
            if step > self.frame.step:
                self._run(lambda _: self.recording.seek(step))

    def _run_on(self, _: Client) -> "Frame":
        until = monotonic() + RUN_S
        return self.recording.advance_until(lambda: monotonic() >= until)

    def _due(self) -> float:
        """Return how late it is in the film by the wall's clock, counted from when it was last set going."""
        if self._since is None:
            self._since = monotonic(), self.frame.time
        wall, filmed = self._since
        return filmed + (monotonic() - wall) * self.speed

    def _run(self, work: "Callable[[Client], Frame]") -> None:
        self._running += 1
        self._asks(work, self._come_to)

    def _come_to(self, frame: "Frame") -> None:
        self._running = max(0, self._running - 1)
        self.frame = frame
        if not self._running:
            self._aim = frame.step
        self._shown(frame)

    def interrupted(self) -> None:
        """Forget what was asked of a film that did not answer."""
        self.playing, self._running = False, 0

    @property
    def progress(self) -> str:
        """How far the film is, and who said what last."""
        frame = self.frame
        pace = "max" if math.isinf(self.speed) else f"{self.speed:g}x"
        state = f"playing {pace}" if self.playing else f"paused ({pace})"
        return (
            f"{state}  step {frame.step} of {self.recording.steps}  {format_elapsed(frame.time)}  {frame.line}".rstrip()
        )


def jump_with_message(playback: Playback, words: str) -> str | None:
    """Jump, and return what is to be said where there is no such place."""
    try:
        playback.jump(words)
    except A7SimError as error:
        return str(error)
    return None
