"""An HTML page as data: its elements, and its tables by caption."""

from collections.abc import Callable
from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = {"meta", "link", "br", "img", "path", "use"}


Attributes = list[tuple[str, str | None]]


@dataclass
class Table:
    """A table: cells as text, `scopes` of its header cells."""

    caption: str = ""
    columns: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    scopes: list[str | None] = field(default_factory=list)

    def row(self, name: str) -> list[str]:
        """Return the row whose first cell is `name`."""
        return next(row for row in self.rows if row[0] == name)


class Page(HTMLParser):
    """A page, read strictly: elements are closed in the reverse order of their opening."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tables: list[Table] = []
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.ids: list[str | None] = []
        self.text: list[str] = []
        self._open: list[str] = []
        self._add_to_cell: Callable[[str], None] | None = None
        self.feed(text)
        self.close()
        assert self._open == [], f"left open: {self._open}"

    def table(self, caption: str) -> Table:
        """Return the first table with a caption."""
        return next(table for table in self.tables if table.caption == caption)

    def handle_startendtag(self, tag: str, attributes: Attributes) -> None:
        """Add an empty element."""
        self._begin(tag, dict(attributes))

    def handle_starttag(self, tag: str, attributes: Attributes) -> None:
        """Open an element."""
        self._begin(tag, dict(attributes))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        """Close an element."""
        if tag in VOID:
            return
        assert self._open and self._open[-1] == tag, f"</{tag}> in {self._open}"
        self._open.pop()
        if tag in ("th", "td", "caption"):
            self._add_to_cell = None

    def handle_data(self, data: str) -> None:
        """Add text to the page and to the open cell."""
        if "style" not in self._open:
            self.text.append(data)
        if self._add_to_cell is not None:
            self._add_to_cell(data)

    def _begin(self, tag: str, attributes: dict[str, str | None]) -> None:
        self.elements.append((tag, attributes))
        self.ids += [attributes["id"]] if "id" in attributes else []
        if tag == "table":
            self.tables.append(Table())
        elif tag == "caption":
            self._add_to_cell = self._add_to_caption
        elif tag == "tr" and "tbody" in self._open:
            self.tables[-1].rows.append([])
        elif tag in ("th", "td"):
            row = self.tables[-1].rows[-1] if "tbody" in self._open else self.tables[-1].columns
            row.append("")
            if tag == "th":
                self.tables[-1].scopes.append(attributes.get("scope"))
            self._add_to_cell = lambda data: row.__setitem__(-1, row[-1] + data)

    def _add_to_caption(self, data: str) -> None:
        self.tables[-1].caption += data
