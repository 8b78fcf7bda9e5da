"""Transcript of a session, line by line."""

from collections.abc import Callable
from dataclasses import dataclass

from a7sim.instrument.language import LinkEvent, Listener
from a7sim.journal.format import Event

_DIRECTION_TEXTS = {"+": "+ connects", "-": "- disconnects", "~": "~ continues"}


def format_event(event: Event) -> str:
    """Return an event of a journal as a line of text."""
    if event.kind == "entry":
        words = (event.model, event.form, event.point, event.item, event.reading, event.remark)
        return _line(event.t, "book", f"{event.number}: {', '.join(word for word in words if word)}")
    if event.kind == "strike":
        return _line(event.t, "book", f"{event.number} struck out: {event.struck}")
    if event.kind:
        return _line(event.t, event.kind, event.hash)
    return _line(event.t, event.client, f"{_DIRECTION_TEXTS.get(event.dir, event.dir)} {event.text}")


def _line(time: float, source: str, text: str) -> str:
    return f"{time:10.2f} {source:<9} {text}".rstrip()


@dataclass(frozen=True)
class TranscriptListener:
    """Listener that prints each event when it is due, after another listener has handled it."""

    on_line: Callable[[str], None]
    wait_until: Callable[[float], None]
    listener: Listener

    def on_link_event(self, event: LinkEvent) -> None:
        """Print an event on the link."""
        self.listener(event)
        self.wait_until(event.time)
        self.on_line(format_event(Event(event.time, event.client, event.direction, event.text)))
