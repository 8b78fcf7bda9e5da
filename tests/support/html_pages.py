"""What a test reads of a page of HTML: its elements, and its tables by caption."""

from dataclasses import dataclass, field
from html.parser import HTMLParser

VOID = {"meta", "link", "br", "img", "path", "use"}


@dataclass
class Table:
    caption: str = ""
    columns: list[str] = field(default_factory=list)
    rows: list[list[str]] = field(default_factory=list)
    scopes: list[str | None] = field(default_factory=list)

    def row(self, name):
        return next(row for row in self.rows if row[0] == name)


class Page(HTMLParser):
    """A page, read strictly: every element is closed in the order in which it was opened."""

    def __init__(self, text):
        super().__init__()
        self.tables, self.elements, self.ids, self.text = [], [], [], []
        self._open, self._cell = [], None
        self.feed(text)
        self.close()
        assert self._open == [], f"left open: {self._open}"

    def table(self, caption):
        return next(table for table in self.tables if table.caption == caption)

    def handle_startendtag(self, tag, attributes):
        self._begun(tag, dict(attributes))

    def handle_starttag(self, tag, attributes):
        self._begun(tag, dict(attributes))
        if tag not in VOID:
            self._open.append(tag)

    def handle_endtag(self, tag):
        if tag in VOID:
            return
        assert self._open and self._open[-1] == tag, f"</{tag}> in {self._open}"
        self._open.pop()
        if tag in ("th", "td", "caption"):
            self._cell = None

    def handle_data(self, data):
        if "style" not in self._open:
            self.text.append(data)
        if self._cell is not None:
            self._cell(data)

    def _begun(self, tag, attributes):
        self.elements.append((tag, attributes))
        self.ids += [attributes["id"]] if "id" in attributes else []
        if tag == "table":
            self.tables.append(Table())
        elif tag == "caption":
            self._cell = self._named
        elif tag == "tr" and "tbody" in self._open:
            self.tables[-1].rows.append([])
        elif tag in ("th", "td"):
            into = self.tables[-1].rows[-1] if "tbody" in self._open else self.tables[-1].columns
            into.append("")
            if tag == "th":
                self.tables[-1].scopes.append(attributes.get("scope"))
            self._cell = lambda data: into.__setitem__(-1, into[-1] + data)

    def _named(self, data):
        self.tables[-1].caption += data
