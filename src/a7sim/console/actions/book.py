"""Actions of the book: readings recorded and struck out, remarks."""

from a7sim.console.actions.base import ActionBase
from a7sim.console.widgets.book import RecordedEntry, record
from a7sim.console.widgets.dialogs import Ask
from a7sim.link.headers import quote_text, registration_word

STRIKE_REASON = "struck out at the console"


class BookActions(ActionBase):
    """Actions of the book."""

    def do_record(self) -> None:
        """Record a reading of the current point, or ask for its name."""
        console = self._console
        if console.point is not None:
            self._record(console.point)
        else:
            self.do_record_as()

    def do_record_as(self) -> None:
        """Record a reading of a named point."""
        self._console.push_screen(Ask("record: name of the point"), self._record)

    def _record(self, point: str | None) -> None:
        console = self._console
        if point is not None:
            console.point = point
            elements = [registration_word(console.selection.element)]
            console.ask(lambda client: record(client, point, elements), self._recorded)

    def _recorded(self, entry: RecordedEntry | None) -> None:
        console = self._console
        if entry is not None:
            console.entries = (*console.entries, entry)
            console.say(f"recorded {entry.number}: {entry.point}")
            console.refresh_panels()

    def do_strike(self) -> None:
        """Strike out the last valid reading, once all earlier requests are in the book."""
        self._console.call_after_orders(self._strike_last)

    def _strike_last(self) -> None:
        console = self._console
        last = next((entry for entry in reversed(console.entries) if not entry.struck), None)
        if last is None:
            console.say("there is nothing in the book to strike out")
            return
        console.thread.send(f"REC:STR {last.number},{quote_text(STRIKE_REASON)}")
        console.entries = tuple(entry.struck_out() if entry is last else entry for entry in console.entries)
        console.say(f"struck out {last.number}: {last.point}")
        console.refresh_panels()

    def do_note(self) -> None:
        """Write a remark into the journal."""
        console = self._console

        def noted(text: str | None) -> None:
            if text is not None:
                console.thread.send(f"NOTE {quote_text(text)}")
                console.say(f"noted: {text}")

        console.push_screen(Ask("note"), noted)
