"""Self-contained page of HTML: headings, paragraphs, tables and figures."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from html import escape
from importlib.resources import files
from string import Template

LINE_END = "\n"


@dataclass(frozen=True)
class Heading:
    """Heading within a chapter."""

    text: str


@dataclass(frozen=True)
class Paragraph:
    """Text with its line ends. A `loud` paragraph is highlighted."""

    text: str
    loud: bool = False


@dataclass(frozen=True)
class TableBlock:
    """Table; the first cell of a row names it. Columns in `left` contain words, the others numbers."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    left: frozenset[int] = frozenset({0})


@dataclass(frozen=True)
class PageFigure:
    """Figure: its markup, with an accessible name, and its caption."""

    markup: str
    caption: str
    wide: bool = False


@dataclass(frozen=True)
class Details:
    """Parts that are shown on demand, and always in print."""

    summary: str
    parts: Sequence["Part"]


Part = Heading | Paragraph | TableBlock | PageFigure | Details


@dataclass(frozen=True)
class Chapter:
    """Chapter of a report."""

    title: str
    parts: list[Part] = field(default_factory=list)


def page(title: str, lead: Sequence[Part], chapters: Sequence[Chapter]) -> str:
    """Return a whole page as HTML."""
    links = "".join(f'<li><a href="#c{i}">{escape(each.title)}</a></li>' for i, each in enumerate(chapters, 1))
    body = "".join(_chapter(i, each) for i, each in enumerate(chapters, 1))
    template = Template(files("a7sim.report").joinpath("page.html").read_text(encoding="utf-8"))
    return template.substitute(title=escape(title), lead=_parts(lead), contents=links, chapters=body)


def _chapter(number: int, chapter: Chapter) -> str:
    heading = f'<h2 id="h{number}">{escape(chapter.title)}</h2>'
    return f'<section id="c{number}" aria-labelledby="h{number}">\n{heading}\n{_parts(chapter.parts)}</section>\n'


def _parts(parts: Iterable[Part]) -> str:
    return "".join(_markup(parts))


def _markup(parts: Iterable[Part]) -> Iterator[str]:
    """Yield the markup of parts; consecutive narrow figures are side by side where there is space."""
    together: list[str] = []
    for part in parts:
        if isinstance(part, PageFigure) and not part.wide:
            together.append(_figure(part))
            continue
        if together:
            yield f'<div class="beside">{"".join(together)}</div>\n'
            together = []
        yield _one(part)
    if together:
        yield f'<div class="beside">{"".join(together)}</div>\n'


def _one(part: Part) -> str:
    match part:
        case Heading(text):
            return f"<h3>{escape(text)}</h3>\n"
        case Paragraph(text, loud):
            kind = ' class="loud"' if loud else ""
            return f"<p{kind}>{escape(text).replace(LINE_END, '<br>')}</p>\n"
        case TableBlock():
            return _table(part)
        case PageFigure():
            return _figure(part)
        case Details(summary, inner):
            return f"<details><summary>{escape(summary)}</summary>\n{_parts(inner)}</details>\n"


def _figure(picture: PageFigure) -> str:
    if picture.wide:
        label = escape(picture.caption)
        drawn = f'<div class="wide" tabindex="0" role="region" aria-label="{label}">{picture.markup}</div>'
    else:
        drawn = picture.markup
    return f"<figure>{drawn}<figcaption>{escape(picture.caption)}</figcaption></figure>\n"


def _table(sheet: TableBlock) -> str:
    head = "".join(
        f'<th scope="col"{_side(sheet, i)}>{escape(name)}</th>' if name else "<td></td>"
        for i, name in enumerate(sheet.columns)
    )
    body = "".join(_row(sheet, row) for row in sheet.rows)
    table = (
        f"<table><caption>{escape(sheet.caption)}</caption><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    )
    return f'<div class="scroll" tabindex="0" role="region" aria-label="{escape(sheet.caption)}">{table}</div>\n'


def _row(sheet: TableBlock, row: Sequence[str]) -> str:
    name, *values = row
    cells = "".join(f"<td{_side(sheet, i)}>{escape(value)}</td>" for i, value in enumerate(values, 1))
    return f'<tr><th scope="row">{escape(name)}</th>{cells}</tr>\n'


def _side(sheet: TableBlock, column: int) -> str:
    return ' class="words"' if column in sheet.left else ""
