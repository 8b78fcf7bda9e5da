"""Observation book: the entries of the operator in order; an entry that is struck out stays."""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass, field, replace

COLUMNS = ("number", "time_s", "model", "form", "round", "point", "item", "reading", "struck", "remark")


@dataclass(frozen=True)
class BookEntry:
    """Entry of the book; `reading` is the text of a counter, `struck` the reason for which it was struck out."""

    number: int
    time: float
    model: str
    form: str
    round: int
    point: str
    item: str
    reading: str
    remark: str = ""
    struck: str = ""


@dataclass
class ObservationBook:
    """Entries, and the heading of the next ones."""

    entries: list[BookEntry] = field(default_factory=list)
    model: str = ""
    form: str = ""
    round: int = 0
    listener: Callable[[BookEntry], None] | None = None
    """Called with each entry when it is written, and again when it is struck out."""

    def set_heading(self, model: str, form: str, round: int = 0) -> None:
        """Start a form; the next entries belong to it."""
        self.model, self.form, self.round = model, form, round

    def add(self, time: float, point: str, item: str, reading: str, remark: str = "") -> int:
        """Add a reading and return its number."""
        number = len(self.entries) + 1
        entry = BookEntry(number, time, self.model, self.form, self.round, point, item, reading, remark)
        self.entries.append(entry)
        self._notify_listener(entry)
        return number

    def strike_out(self, number: int, reason: str) -> None:
        """Strike an entry out; it stays, marked."""
        struck = replace(self.entries[number - 1], struck=reason)
        self.entries[number - 1] = struck
        self._notify_listener(struck)

    def _notify_listener(self, entry: BookEntry) -> None:
        if self.listener is not None:
            self.listener(entry)

    def remark(self, time: float, text: str) -> None:
        """Add a remark."""
        self.add(time, "", "remark", "", text)

    @property
    def remarks(self) -> list[str]:
        """All remarks in order."""
        return [entry.remark for entry in self.entries if entry.item == "remark"]

    def as_csv(self) -> str:
        """Return the book as CSV with a header line."""
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow(COLUMNS)
        for e in self.entries:
            writer.writerow(
                (
                    e.number,
                    f"{e.time:.1f}",
                    e.model,
                    e.form,
                    e.round or "",
                    e.point,
                    e.item,
                    e.reading,
                    e.struck,
                    e.remark,
                )
            )
        return out.getvalue()
