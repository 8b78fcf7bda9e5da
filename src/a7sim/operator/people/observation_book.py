"""The observation book: what the operator wrote down, in order; a struck entry stays."""

import csv
import io
from collections.abc import Callable
from dataclasses import dataclass, field, replace

COLUMNS = ("number", "time_s", "model", "form", "round", "point", "item", "reading", "struck", "remark")


@dataclass(frozen=True)
class BookEntry:
    """A line of the book; `reading` is the text of a counter, `struck` why it was struck out."""

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
    """The entries, and the heading under which the next ones go."""

    entries: list[BookEntry] = field(default_factory=list)
    model: str = ""
    form: str = ""
    round: int = 0
    listener: Callable[[BookEntry], None] | None = None
    """Is told of every entry as it is written, and again as it is struck out."""

    def set_heading(self, model: str, form: str, round: int = 0) -> None:
        """Begin a form; what follows is entered under it."""
        self.model, self.form, self.round = model, form, round

    def add(self, time: float, point: str, item: str, reading: str, remark: str = "") -> int:
        """Enter a reading and return its number."""
        number = len(self.entries) + 1
        entry = BookEntry(number, time, self.model, self.form, self.round, point, item, reading, remark)
        self.entries.append(entry)
        self._tell(entry)
        return number

    def strike_out(self, number: int, why: str) -> None:
        """Strike an entry out; it stays, marked."""
        struck = replace(self.entries[number - 1], struck=why)
        self.entries[number - 1] = struck
        self._tell(struck)

    def _tell(self, entry: BookEntry) -> None:
        if self.listener is not None:
            self.listener(entry)

    def remark(self, time: float, text: str) -> None:
        """Enter a remark."""
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
