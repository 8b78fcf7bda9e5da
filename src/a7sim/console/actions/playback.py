"""Playback actions: replay a recording or follow a live instrument. Moving the instrument is disabled."""

from typing import TYPE_CHECKING

from a7sim.console.actions.base import ActionBase
from a7sim.console.actions.navigation import CounterOrigins
from a7sim.console.keymap import PLAYBACK_ACTIONS, VIEW_ACTIONS, actions_for
from a7sim.console.widgets.dialogs import Ask
from a7sim.console.widgets.header_footer import key_labels
from a7sim.console.widgets.playback import Playback, jump_with_message

if TYPE_CHECKING:
    from a7sim.journal.recording import Frame

_PLAYED = {deed.name for deed in actions_for(watching=True) if deed.group == PLAYBACK_ACTIONS}
_LOOKED = {deed.name for deed in actions_for(watching=True) if deed.group in VIEW_ACTIONS}


class PlaybackActions(ActionBase):
    """Actions of playback."""

    def reject_if_watching(self, deed: str = "") -> bool:
        """Return whether an action is disabled while watching, with a message."""
        console = self._console
        if not console.config.watching or deed in _LOOKED or (console.playback is not None and deed in _PLAYED):
            return False
        if console.playback is None:
            why = "there is nothing to play" if deed in _PLAYED else "hands are off"
            console.say(f"{why}: this console only watches {console.config.where}", refused=True)
        else:
            keys = key_labels(console.config.keymap, not console.utf8)
            console.say(f"hands are off: what you watch has been done; {keys['play']} plays and pauses", refused=True)
        return True

    def show_frame(self, frame: "Frame") -> None:
        """Show the present step, and update the state of the console from it."""
        console = self._console
        playback = self._playback()
        console.presets = CounterOrigins(dict(frame.origins), dict(frame.units))
        if frame.point != console.point:
            console.point = frame.point
            console.look()
        if frame.error:
            console.say(frame.error, refused=True)
        elif frame.step == playback.recording.steps:
            console.say("the end of the session")
        self._progress()
        console.refresh_panels()

    def do_play(self) -> None:
        """Play or pause."""
        self._playback().play_or_pause()
        self._progress()

    def do_faster(self) -> None:
        """Play faster."""
        self._playback().pace(1)
        self._progress()

    def do_slower(self) -> None:
        """Play slower."""
        self._playback().pace(-1)
        self._progress()

    def do_step_on(self) -> None:
        """Move forwards by a line."""
        self._playback().go_by(1)

    def do_step_back(self) -> None:
        """Move backwards by a line."""
        self._playback().go_by(-1)

    def do_next_record(self) -> None:
        """Move forwards to the next registration."""
        if not self._playback().go_to_record(1):
            self._console.say("nothing more is registered")

    def do_last_record(self) -> None:
        """Move backwards to the previous registration."""
        if not self._playback().go_to_record(-1):
            self._console.say("nothing is registered before")

    def do_jump(self) -> None:
        """Ask for a position in the session and move to it."""
        console = self._console

        def answered(words: str | None) -> None:
            refused = jump_with_message(self._playback(), words) if words is not None else None
            if refused is not None:
                console.say(refused, refused=True)

        note = "a step (120), a time (0:12:30, 750s), a line of the journal (@99) or the text of a note"
        console.push_screen(Ask("jump to", note=note), answered)

    def _progress(self) -> None:
        console = self._console
        console.main.progress(self._playback().progress)
        console.refresh_panels()

    def _playback(self) -> Playback:
        playback = self._console.playback
        assert playback is not None, "playback actions need a recording"
        return playback
