"""Handlers of messages from the instrument thread: state of the console, banner, book, early keys."""

from collections.abc import Callable
from functools import partial
from typing import Any

from textual.message import Message

from a7sim.console.actions.base import ActionBase
from a7sim.console.actions.navigation import CounterOrigins, fetch_sketch
from a7sim.console.actions.preset_recovery import recover_presets
from a7sim.console.drawing.descriptions import describe_error
from a7sim.console.drawing.sketch import Place
from a7sim.console.messages import CommandsRejected, Connected, ConnectionLost, StationMessage, ViewResult
from a7sim.console.state.readouts import Readouts, unquote
from a7sim.console.widgets.book import RecordedEntry, read_book
from a7sim.console.widgets.playback import TICK_S
from a7sim.link.client.client import Client


class StationUpdate(Message):
    """Update from the instrument thread."""

    def __init__(self, news: StationMessage) -> None:
        super().__init__()
        self.news = news


class AnswerReady(Message):
    """Answer to a request, with its callback."""

    def __init__(self, then: Callable[[], None]) -> None:
        super().__init__()
        self.then = then


class MessageHandlers(ActionBase):
    """Requests to the instrument thread, and handlers of its messages."""

    def ask(self, work: Callable[[Client], Any], then: Callable[[Any], None]) -> None:
        """Run a request in the instrument thread, and call back with the answer in the screen's thread."""
        console = self._console

        def order(client: Client) -> None:
            answer = work(client)
            console.post_message(AnswerReady(partial(then, answer)))

        console.thread.submit(order)

    def call_after_orders(self, then: Callable[[], None]) -> None:
        """Call back when all earlier requests are sent and their results shown."""
        self.ask(lambda _: None, lambda _: then())

    def _tell(self, news: StationMessage) -> None:
        self._console.post_message(StationUpdate(news))

    def on_answer_ready(self, done: AnswerReady) -> None:
        """Call back with an answer, unless the screen is closed."""
        if self._console.main.is_there:
            done.then()

    def on_station_update(self, update: StationUpdate) -> None:
        """Show an update, unless the screen is closed."""
        console = self._console
        if not console.main.is_there:
            return
        match update.news:
            case Connected():
                self._meet(update.news)
            case Readouts():
                self._read(update.news)
            case ViewResult():
                console.sight = update.news
                console.draw()
            case CommandsRejected():
                console.say(" · ".join(describe_error(error) for error in update.news.errors), refused=True)
            case ConnectionLost():
                self._lose(update.news)

    def _meet(self, met: Connected) -> None:
        console = self._console
        first = console.met is None
        console.met = met
        console.selection = console.selection.valid_for(met.variant)
        if console.silent is not None:
            console.silent = None
            console.say("the instrument answers again")
        else:
            console.say(console.config.greeting() or "l lays pictures; ? is help")
        if first:
            self._begin(met)
        console.main.warn(None)
        console.call_after_refresh(console.look)

    def _begin(self, met: Connected) -> None:
        """Read the state of the instrument before the console was opened."""
        console = self._console
        past = console.config.history
        watching = console.config.watching
        self.ask(
            lambda client: recover_presets(met.variant, past(), "" if watching else unquote(client.ask("GEAR:HEIG?"))),
            self._recall,
        )
        if console.playback is not None:
            console.playback.go_to(0)
            console.set_interval(TICK_S, console.playback.tick)

    def _recall(self, presets: CounterOrigins) -> None:
        if presets != CounterOrigins():
            self._console.presets = presets

    def _lose(self, silent: ConnectionLost) -> None:
        console = self._console
        if silent != console.silent:
            console.silent = silent
            console.forget_early_keys()
            if console.playback is not None:
                console.playback.interrupted()
            console.main.warn(f"The instrument does not answer: {silent.why}. Trying again every second; q leaves.")

    def _read(self, dials: Readouts) -> None:
        console = self._console
        before, console.dials = console.dials, dials
        for projector, picture in enumerate(dials.pictures, start=1):
            if before is None or before.pictures[projector - 1] != picture:
                self.ask(partial(fetch_sketch, projector, picture), partial(self._sketch, projector))
        if console.config.watching or (before is None and console.config.alone):
            self._keep_book(dials)
        console.refresh_panels()
        if before is None:
            console.press_early_keys()

    def _keep_book(self, dials: Readouts) -> None:
        """Update the book from the recorder."""
        console = self._console
        if (dials.records, dials.struck) != (len(console.entries), sum(entry.struck for entry in console.entries)):
            self.ask(partial(read_book, records=dials.records), self._open_book)

    def _open_book(self, entries: tuple[RecordedEntry, ...]) -> None:
        console = self._console
        console.entries = entries
        console.refresh_panels()

    def _sketch(self, projector: int, points: dict[str, Place]) -> None:
        console = self._console
        console.sketches[projector] = points
        console.refresh_panels()
