"""Observation book on the forms of the thesis (3.2.1): relative orientation, model coordinates, perspective centre.

A form is a table: one line per point, the readings of an item side by side with their mean, settings and struck
readings below.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby

from a7sim.errors import A7SimError
from a7sim.journal.session_files import BOOK
from a7sim.operator.people.observation_book import BookEntry
from a7sim.report.page import Paragraph, Part, TableBlock
from a7sim.report.session_folder import SessionFolder
from a7sim.result_documents import Document

PAGE_BREAK = "\f"

TITLES = {
    "relative orientation": "FORM FOR NUMERICAL RELATIVE ORIENTATION",
    "model coordinates": "FORM FOR RECORDING MODEL COORDINATES",
    "left perspective centre": "FORM FOR PERSPECTIVE-CENTRE POSITION DETERMINATION",
    "right perspective centre": "FORM FOR PERSPECTIVE-CENTRE POSITION DETERMINATION",
}

EMPIRICAL = "FORM FOR EMPIRICAL RELATIVE ORIENTATION"

REPEATED = {"by1", "by2"}
"""Items read several times in numerical relative orientation."""

ROMAN = ("I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X")

SIGNS = {"1": "′", "2": "″"}


@dataclass(frozen=True)
class Column:
    """Column of a form: item, number of the reading, and the texts from the top."""

    item: str
    which: str
    cells: Sequence[str]

    @property
    def width(self) -> int:
        """Width in print; the item's name may extend over its next readings."""
        return max(map(len, [self.which or self.item, *self.cells]))


@dataclass(frozen=True)
class Form:
    """Filled form: heading, columns, and the lines below."""

    title: str
    caption: str
    head: Sequence[str]
    columns: Sequence[Column]
    foot: Sequence[str]

    def as_text(self) -> str:
        """Return the form as plain text."""
        table = _lines(self.columns) if self.columns else ()
        return "\n".join([self.title, "", *self.head, "", *table, *self.foot, ""])

    def as_parts(self) -> list[Part]:
        """Return the form as parts of a page."""
        parts: list[Part] = [Paragraph("\n".join(self.head))]
        if self.columns:
            names = [f"{column.item} {column.which}".strip() for column in self.columns]
            rows = list(zip(*(column.cells for column in self.columns), strict=True))
            parts.append(TableBlock(self.caption, names, rows))
        return parts + ([Paragraph("\n".join(self.foot))] if self.foot else [])


def forms_text(kept: SessionFolder) -> str:
    """Return all forms of a session as plain text, with page breaks. Raises A7SimError without a book."""
    if not kept.book:
        raise A7SimError(f"{kept.folder / BOOK}: expected an observation book with entries, got none")
    with kept.reading_results():
        return PAGE_BREAK.join(form.as_text() for form in make_forms(kept))


def make_forms(kept: SessionFolder) -> Iterator[Form]:
    """Yield the forms of a session in their order."""
    for (model, form, number), entries in groupby(kept.book, key=lambda entry: (entry.model, entry.form, entry.round)):
        yield _filled(kept.document, model, form, number, list(entries))


def _filled(document: Document, model: str, form: str, number: int, entries: Sequence[BookEntry]) -> Form:
    found = next((each for each in document.get("models", ()) if each["model"] == model), None)
    round_of = f", round {number}" if number else ""
    observed = [entry for entry in entries if entry.point and entry.reading]
    in_order = {entry.item for entry in observed} - REPEATED if form == "relative orientation" else set()
    title = EMPIRICAL if in_order else TITLES.get(form, f"FORM FOR {form.upper() or 'REMARKS'}")
    name = f"model {model}, {form}{round_of}" if model else form
    head = [f"{document['scenario']}    {name}"]
    if found is not None:
        head.append(f"photographs {found['left']} and {found['right']}    base {found['base']}")
    head.append(f"begun {_clock(entries[0].time)}    ended {_clock(entries[-1].time)}    hours of the session")
    parallaxes = _parallaxes(found, form, number) if found is not None else {}
    columns = list(_as_it_went(observed) if in_order else _columns(observed, parallaxes)) if observed else []
    return Form(title, name[:1].upper() + name[1:], head, columns, [*_below(entries), *_result(found, form)])


def _clock(seconds: float) -> str:
    return f"{int(seconds) // 3600:02d}:{int(seconds) // 60 % 60:02d}:{int(seconds) % 60:02d}"


def _parallaxes(model: Document, form: str, number: int) -> dict[str, float]:
    """Return the parallaxes of a round, by point; those of the round after the last are the residuals."""
    orientation = model["relative_orientation"]
    if form != "relative orientation" or orientation["procedure"] != "numerical" or orientation["rough_iterations"]:
        return {}
    rounds = orientation["rounds"]
    by_label = rounds[number - 1]["parallax_mm"] if number <= len(rounds) else orientation["residual_parallax_mm"]
    return {model["standard_points"].get(label, label): p for label, p in by_label.items()}


def _as_it_went(observed: Sequence[BookEntry]) -> Iterator[Column]:
    """Yield readings in their order: each refers to a model changed by the previous one."""
    yield Column("point", "", [entry.point for entry in observed])
    yield Column("time", "", [_clock(entry.time) for entry in observed])
    yield Column("item", "", [_shown(entry.item) for entry in observed])
    yield Column("reading", "", [entry.reading for entry in observed])


def _columns(observed: Sequence[BookEntry], parallaxes: Mapping[str, float]) -> Iterator[Column]:
    points = list(dict.fromkeys(entry.point for entry in observed))
    yield Column("point", "", points)
    kept = valid_readings(observed)
    for item in dict.fromkeys(entry.item for entry in observed):
        by_point = [kept.get((point, item), []) for point in points]
        most = max(map(len, by_point))
        for i in range(most):
            cells = [readings[i] if i < len(readings) else "" for readings in by_point]
            yield Column(_shown(item), _roman(i) if most > 1 else "", cells)
        if most > 1:
            yield Column(_shown(item), "mean", [f"{mean(each):.3f}" if each else "" for each in by_point])
    if parallaxes:
        yield Column("p", "", [f"{parallaxes[point]:+.3f}" if point in parallaxes else "" for point in points])


def valid_readings(entries: Iterable[BookEntry]) -> dict[tuple[str, str], list[str]]:
    """Return the readings that were not struck out by point and item."""
    readings: dict[tuple[str, str], list[str]] = {}
    for entry in entries:
        if entry.point and entry.reading and not entry.struck:
            readings.setdefault((entry.point, entry.item), []).append(entry.reading)
    return readings


def mean(readings: Sequence[str]) -> float:
    """Return the mean of one or more readings."""
    return sum(map(float, readings)) / len(readings)


def _roman(i: int) -> str:
    return ROMAN[i] if i < len(ROMAN) else str(i + 1)


def _shown(item: str) -> str:
    """Return the heading of an item: by1 as by′, `X left at Z 4900.00` as X at 4900.00."""
    for side in ("left", "right"):
        item = item.replace(f" {side} at Z ", " at ")
    symbols = {"kappa": "κ", "phi": "φ", "omega": "ω", "by": "by", "bz": "bz", "c": "c"}
    name, number = item[:-1], item[-1:]
    return symbols[name] + SIGNS[number] if name in symbols and number in SIGNS else item


def _below(entries: Sequence[BookEntry]) -> Iterator[str]:
    settings = [entry for entry in entries if not entry.point and entry.reading]
    if settings:
        words = (f"{_shown(entry.item.removeprefix('set '))} {entry.reading}" for entry in settings)
        yield f"set: {'   '.join(words)}"
    for entry in entries:
        if entry.struck:
            yield f"struck out: {entry.reading}  {_shown(entry.item)} of {entry.point or 'no point'}: {entry.struck}"
    yield from (f"remark: {entry.remark}" for entry in entries if entry.remark)


def _result(model: Document | None, form: str) -> Iterator[str]:
    """Yield the centre computed from a form."""
    side, _, what = form.partition(" ")
    if model is None or what != "perspective centre":
        return
    centre = model["perspective_centres"][side]
    for name in ("X0", "Y0", "Z0", "T0"):
        yield f"{name} = {centre[name]:.3f} ± {centre[f'sigma_{name}']:.3f}"
    yield f"R.M.S. = {centre['rms']:.5f}"


def _lines(columns: Sequence[Column]) -> Iterator[str]:
    """Yield columns as lines under a heading of two: item, and number of the reading."""
    groups = [list(group) for _, group in groupby(columns, key=lambda column: column.item)]
    widths = [column.width for column in columns]
    yield "  ".join(_over(group) for group in groups).rstrip()
    rule = "-" * (sum(widths) + 2 * len(widths) - 2)
    if any(column.which for column in columns):
        yield _row([column.which for column in columns], widths)
    yield rule
    yield from (_row(cells, widths) for cells in zip(*(column.cells for column in columns), strict=True))
    yield rule


def _row(cells: Sequence[str], widths: Sequence[int]) -> str:
    first, *others = zip(cells, widths, strict=True)
    return "  ".join([first[0].ljust(first[1]), *(cell.rjust(width) for cell, width in others)]).rstrip()


def _over(group: Sequence[Column]) -> str:
    """Return the common heading of a group of columns, as wide as they are."""
    width = sum(column.width for column in group) + 2 * len(group) - 2
    item = group[0].item
    return item.ljust(width) if item == "point" else item.center(width)
