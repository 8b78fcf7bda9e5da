"""Playback of a recording: play, pause, step and jump, by the wall clock and by keys."""

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
"""Multiples of the original speed; the last is as fast as possible."""

TICK_S = 0.1
"""Interval between two clock ticks while playing."""

RUN_S = 0.05
"""Duration of replay between two pictures at the highest speed."""


class RequestRunner(Protocol):
    """Protocol: run work in the instrument thread, and call back in the screen's thread."""

    def __call__(self, work: "Callable[[Client], Frame]", then: "Callable[[Frame], None]") -> None:
        """Run the work."""


class Playback:
    """Recording and its playback. `shown` is called with each new frame."""

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
        """Play, from the start if at the end; or pause."""
        self.playing = not self.playing
        self._since = None
        if self.playing and self.frame.step >= self.recording.steps:
            self.go_to(0)

    def pace(self, way: int) -> None:
        """Change the speed."""
        at = SPEEDS.index(self.speed) + way
        self.speed = SPEEDS[min(max(at, 0), len(SPEEDS) - 1)]
        self._since = None

    def go_to(self, step: int) -> None:
        """Move to a step, limited to the existing ones."""
        self._since = None
        aim = self._aim = min(max(step, 0), self.recording.steps)
        self._run(lambda _: self.recording.seek(aim))

    def go_by(self, steps: int) -> None:
        """Pause, and move by a number of steps."""
        self.playing = False
        self.go_to(self._aim + steps)

    def go_to_record(self, way: int) -> bool:
        """Pause, and move to the next registration in a direction; return whether there is one."""
        self.playing = False
        step = self.recording.next_record(self._aim, way)
        if step is not None:
            self.go_to(step)
        return step is not None

    def jump(self, words: str) -> None:
        """Move to the step of a number, a time or the text of a note. Raises A7SimError if there is none."""
        self.go_to(self.recording.find_step(words))

    def tick(self) -> None:
        """Move by the elapsed time."""
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
        """Return the present time of the recording by the wall clock since the last start."""
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
        """Discard a request that was not answered."""
        self.playing, self._running = False, 0

    @property
    def progress(self) -> str:
        """Progress of the recording, with the last line and its client."""
        frame = self.frame
        pace = "max" if math.isinf(self.speed) else f"{self.speed:g}x"
        state = f"playing {pace}" if self.playing else f"paused ({pace})"
        return (
            f"{state}  step {frame.step} of {self.recording.steps}  {format_elapsed(frame.time)}  {frame.line}".rstrip()
        )


def jump_with_message(playback: Playback, words: str) -> str | None:
    """Jump, and return the error message for an unknown position."""
    try:
        playback.jump(words)
    except A7SimError as error:
        return str(error)
    return None
