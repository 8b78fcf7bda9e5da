"""Coordinate cards of the N.R.C. strip program (T 4.3; Schut 1967), and models as free-format text.

Columns 1-4 strip or model (blank for ground control), 5-9 point, 10-18 X, 19-27 Y, 28-36 Z, each right-justified;
output cards add three fields of nine columns. Order: ground control; a card -1; points of the models that are no
ties, control first; then for every two neighbours a card -2, the centre and the ties as the first has them, a card
-2, the same as the next has them. The first card after a -2 is the projection centre: its number is the
photograph's, and it is named ``<photo>:centre`` here.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from a7sim.errors import A7SimError
from a7sim.geometry import Array
from a7sim.reduction.absolute import Ground
from a7sim.reduction.strips import CENTRE, Model, Strip, in_order, is_centre
from a7sim.table_files import first_line, read_text

FIELDS = (
    ("strip or model", 1, 4),
    ("point", 5, 9),
    ("X", 10, 18),
    ("Y", 19, 27),
    ("Z", 28, 36),
    ("X residual", 37, 45),
    ("Y residual", 46, 54),
    ("Z residual", 55, 63),
)
"""Name, first and last column of each field."""

OUTPUT_COLUMNS = 63
ENDINGS = (".crd", ".cards")
_LIKE_A_CARD = re.compile(r"[ 0-9.+-]+")

GROUND, TIES = "-1", "-2"
"""Control cards: -1 ends the ground control, -2 precedes each set of tie points."""


@dataclass(frozen=True, slots=True)
class Card:
    """A coordinate card: model (empty for ground control), point, three coordinates, residuals if it is output."""

    model: str
    point: str
    coordinates: tuple[float, float, float]
    residuals: tuple[float, float, float] | None = None
    line: int = 0


@dataclass(frozen=True)
class Deck:
    """The cards of a strip: ground control, all three coordinates of each point, and models in the strip's order."""

    ground: Ground
    models: tuple[Model, ...]


def is_deck(path: str | Path, text: str) -> bool:
    """Return whether a file is a deck of cards: by its suffix, otherwise by a first line of blanks and numbers only."""
    ending = Path(path).suffix.lower()
    if ending in ENDINGS:
        return True
    return ending not in (".csv", ".toml") and bool(_LIKE_A_CARD.fullmatch(first_line(text)))


def read_cards(path: str | Path, text: str | None = None) -> Deck:
    """Return the ground control and the models of a deck of cards; `text` saves reading the file again.

    Raises A7SimError with file, line and column for a card that is invalid, one column off, repeated or out of order.
    """
    path = Path(path)
    sections = _sections(path, read_text(path) if text is None else text)
    ground = sections[0][1]
    seen: dict[tuple[str, str], Card] = {}
    for card in ground:
        if card.model:
            raise A7SimError(
                f"{path}, line {card.line}, columns 1-4: expected blanks on ground control, got {card.model!r}"
            )
        _add(path, seen, card, card.point, again=False)
    models: dict[str, dict[str, Card]] = {}
    ties: list[list[Card]] = []
    for kind, cards in sections[1:]:
        for place, card in enumerate(cards):
            if not card.model:
                raise A7SimError(f"{path}, line {card.line}, columns 1-4: expected the number of a model, got blanks")
            if kind == TIES and card.model != cards[0].model:
                raise A7SimError(
                    f"{path}, line {card.line}, columns 1-4: expected model {cards[0].model} as on the centre's card, "
                    f"got {card.model}"
                )
            name = f"{card.point}{CENTRE}" if kind == TIES and place == 0 else card.point
            _add(path, seen, card, name, again=kind == TIES)
            models.setdefault(card.model, {})[name] = card
        if kind == TIES:
            ties.append(cards)
    _check_pairs(path, ties)
    if not models:
        raise A7SimError(f"{path}: expected cards of models after the card {GROUND}, got none")
    points = tuple(card.point for card in ground)
    control = Ground(points, _coordinates(ground), ("control",) * len(points))
    found = [Model(name, tuple(cards), _coordinates(list(cards.values()))) for name, cards in models.items()]
    order = [cards[0].model for cards in ties[::2]] + [cards[0].model for cards in ties[-1:]]
    found.sort(key=lambda model: order.index(model.name) if model.name in order else len(order))
    return Deck(control, tuple(found))


def deck_lines(ground: Ground, models: Sequence[Model], decimals: int = 3) -> list[str]:
    """Return the cards, one per line, of ground control and models with coordinates ``(3, n)``.

    Ground points that are checks or have gaps are left out, and so are centres that no neighbour shares, for which the
    order has no place. Raises A7SimError for numbers that do not fit their columns.
    """
    return [_line(card, decimals) if card else control for card, control in _dealt(ground, models)]


def output_lines(ground: Ground, strip: Strip, decimals: int = 3) -> list[str]:
    """Return the output cards of a strip in the ground system: as the input, with three more fields.

    Control points carry transformed minus ground, tie points and centres the deviation from the mean.
    """
    mean = strip.as_model
    shared = {(model.name, name): deviation for model in strip.models for name, deviation in _shared(strip, model)}
    known = dict(zip(ground.points, ground.coordinates.T, strict=True))
    place = {name: i for i, name in enumerate(mean.points)}
    lines = []
    for card, control in _dealt(ground, strip.models):
        if card is None:
            lines.append(control)
            continue
        name = f"{card.point}{CENTRE}" if control == CENTRE else card.point
        residuals: Array | None = shared.get((card.model, name))
        if residuals is None and name in known and name in place:
            residuals = mean.coordinates[:, place[name]] - known[name]
        extra = None if residuals is None else (float(residuals[0]), float(residuals[1]), float(residuals[2]))
        lines.append(_line(Card(card.model, card.point, card.coordinates, extra), decimals))
    return lines


def write_cards(path: str | Path, lines: Sequence[str]) -> None:
    """Write cards, one per line."""
    Path(path).write_text("".join(f"{line}\n" for line in lines), encoding="ascii")


def free_format_lines(models: Sequence[Model], decimals: int = 4) -> list[str]:
    """Return models in the free format of PAT-M: number, points with X Y Z, -99 after each model.

    The layout is general knowledge of the trade, with no manual at hand. Names must be numbers; a centre
    ``<photo>:centre`` has the number of its photograph. Raises A7SimError for a point of the same number in that model.
    """
    lines = []
    for model in models:
        lines.append(_number(model.name, 9, f"model {model.name}"))
        taken: dict[str, str] = {}
        for i, name in enumerate(model.points):
            number = _number(name.removesuffix(CENTRE), 12, f"model {model.name}, point {name}")
            if number in taken:
                raise A7SimError(
                    f"model {model.name}, point {name}: expected a number of its own, got that of {taken[number]}"
                )
            taken[number] = name
            lines.append(" ".join([number, *(f"{value:.{decimals}f}" for value in model.coordinates[:, i])]))
        lines.append("-99")
    return lines


def _sections(path: Path, text: str) -> list[tuple[str, list[Card]]]:
    """Return the cards between control cards, with the control card before them (none before the first)."""
    sections: list[tuple[str, list[Card]]] = [("", [])]
    for number, card in enumerate(_checked(path, text), start=1):
        line = card.rstrip()
        if not line:
            continue
        fields = _fields(path, number, line)
        if fields[0] in (GROUND, TIES):
            if any(fields[1:]):
                raise A7SimError(f"{path}, line {number}, column 5: expected nothing after a control card {fields[0]}")
            _check_order(path, number, fields[0], sections)
            sections.append((fields[0], []))
        else:
            sections[-1][1].append(_card(path, number, fields))
    if len(sections) == 1:
        raise A7SimError(f"{path}: expected a card {GROUND} after the ground control, got none")
    if sections[-1][0] == TIES and not sections[-1][1]:
        raise A7SimError(f"{path}: expected a centre and tie points after the last card {TIES}, got none")
    return sections


def _check_order(path: Path, number: int, control: str, sections: Sequence[tuple[str, list[Card]]]) -> None:
    if len(sections) == 1 and control != GROUND:
        raise A7SimError(
            f"{path}, line {number}, columns 1-4: expected {GROUND} before the first {TIES}, got {control}"
        )
    if sections[-1][0] == TIES and not sections[-1][1]:
        raise A7SimError(
            f"{path}, line {number}: expected a centre and tie points after the card {TIES}, got {control}"
        )


def _checked(path: Path, text: str) -> list[str]:
    """Return the lines of a deck. Raises A7SimError unless they are printable ASCII."""
    cards = text.splitlines()
    if not text.strip():
        raise A7SimError(f"{path}: expected cards, got an empty file")
    for number, card in enumerate(cards, start=1):
        odd = next((i for i, each in enumerate(card, start=1) if not (each.isascii() and each.isprintable())), None)
        if odd:
            raise A7SimError(
                f"{path}, line {number}, column {odd}: expected blanks, digits and points, got {card[odd - 1]!r}"
            )
    return cards


def _fields(path: Path, number: int, line: str) -> list[str]:
    """Return the texts of the fields of a card. Raises A7SimError unless each is right-justified in its columns."""
    if len(line) > OUTPUT_COLUMNS:
        raise A7SimError(
            f"{path}, line {number}, column {OUTPUT_COLUMNS + 1}: expected at most {OUTPUT_COLUMNS} columns, "
            f"got {line[OUTPUT_COLUMNS:][:20]!r}"
        )
    texts = []
    for name, first, last in FIELDS:
        cell = line[first - 1 : last]
        text = cell.strip()
        if text and (" " in text or len(cell) < last - first + 1 or cell[-1] == " "):
            raise A7SimError(
                f"{path}, line {number}, columns {first}-{last}: expected {name} right-justified and without blanks, "
                f"got {cell!r} (is the card a column off?)"
            )
        texts.append(text)
    return texts


def _card(path: Path, number: int, fields: Sequence[str]) -> Card:
    for text, (name, first, last) in zip(fields[:2], FIELDS, strict=False):
        if (text or name == "point") and not (text.isdigit() and int(text) > 0):
            raise A7SimError(
                f"{path}, line {number}, columns {first}-{last}: expected {name} as a positive number, got {text!r}"
            )
    extra = any(fields[5:])
    numbers = [
        _value(path, number, text, field)
        for text, field in zip(fields[2:] if extra else fields[2:5], FIELDS[2:], strict=False)
    ]
    return Card(
        fields[0],
        fields[1],
        (numbers[0], numbers[1], numbers[2]),
        (numbers[3], numbers[4], numbers[5]) if extra else None,
        number,
    )


def _value(path: Path, line: int, text: str, field: tuple[str, int, int]) -> float:
    name, first, last = field
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value) or "." not in text or "_" in text:
        raise A7SimError(
            f"{path}, line {line}, columns {first}-{last}: expected {name} with a decimal point, got {text!r}"
        )
    return value


def _add(path: Path, seen: dict[tuple[str, str], Card], card: Card, name: str, again: bool) -> None:
    """Record a card. A tie point may be repeated for the next neighbour with the same coordinates."""
    before = seen.setdefault((card.model, name), card)
    if before is not card and not (again and before.coordinates == card.coordinates):
        of = f"model {card.model}" if card.model else "ground control"
        raise A7SimError(
            f"{path}, line {card.line}, columns 5-9: expected point {name} once in {of}, "
            f"got it{' with other coordinates' if again else ''} as in line {before.line}"
        )


def _check_pairs(path: Path, ties: Sequence[Sequence[Card]]) -> None:
    """Raise A7SimError unless the sets of ties are pairs of the same centre and points."""
    if len(ties) % 2:
        raise A7SimError(
            f"{path}, line {ties[-1][0].line}: expected the ties of model {ties[-1][0].model} again as the next model "
            f"has them, after a card {TIES}, got the end"
        )
    for first, second in zip(ties[::2], ties[1::2], strict=True):
        if first[0].model == second[0].model:
            raise A7SimError(
                f"{path}, line {second[0].line}, columns 1-4: expected the next model, got {first[0].model} again"
            )
        if first[0].point != second[0].point:
            raise A7SimError(
                f"{path}, line {second[0].line}, columns 5-9: expected the common centre {first[0].point} first, "
                f"got {second[0].point}"
            )
        here, second_points = {card.point for card in first[1:]}, {card.point for card in second[1:]}
        for cards, others, model in ((first, second_points, second[0].model), (second, here, first[0].model)):
            alone = next((card for card in cards[1:] if card.point not in others), None)
            if alone:
                raise A7SimError(
                    f"{path}, line {alone.line}, columns 5-9: expected tie point {alone.point} in model {model} too, "
                    "got none"
                )


def _coordinates(cards: Sequence[Card]) -> Array:
    return np.array([card.coordinates for card in cards], dtype=float).reshape((-1, 3)).T


def _dealt(ground: Ground, models: Sequence[Model]) -> Iterator[tuple[Card | None, str]]:
    """Yield coordinate cards (marked `CENTRE` for a centre) and control cards in the order of the program."""
    chain = in_order(models)
    ties = [sorted(set(a.points) & set(b.points)) for a, b in pairwise(chain)]
    for (a, b), names in zip(pairwise(chain), ties, strict=True):
        if sum(is_centre(name) for name in names) != 1:
            raise A7SimError(f"models {a.name} and {b.name}: expected one common projection centre (<photo>{CENTRE})")
    control = set()
    for name, coordinates, role in zip(ground.points, ground.coordinates.T, ground.roles, strict=True):
        if role != "check" and np.isfinite(coordinates).all():
            control.add(name)
            yield _dealt_card("", name, coordinates), ""
    yield None, _control_card(GROUND)
    for i, model in enumerate(chain):
        tied = set(ties[i - 1] if i else ()) | set(ties[i] if i < len(ties) else ())
        alone = [name for name in model.points if name not in tied and not is_centre(name)]
        for name in sorted(alone, key=lambda name: name not in control):
            yield _dealt_card(model.name, name, model.at([name])[:, 0]), ""
    for (a, b), names in zip(pairwise(chain), ties, strict=True):
        for model in (a, b):
            yield None, _control_card(TIES)
            for name in sorted(names, key=lambda name: not is_centre(name)):
                card = _dealt_card(model.name, name.removesuffix(CENTRE), model.at([name])[:, 0])
                yield card, CENTRE if is_centre(name) else ""


def _dealt_card(model: str, point: str, coordinates: Array) -> Card:
    where = f"model {model}, point {point}" if model else f"ground point {point}"
    if model:
        _number(model, 4, f"model {model}")
    return Card(model, _number(point, 5, where), (float(coordinates[0]), float(coordinates[1]), float(coordinates[2])))


def _control_card(control: str) -> str:
    return f"{control:>4}"


def _line(card: Card, decimals: int) -> str:
    line = f"{card.model:>4}{card.point:>5}"
    for name, value in zip(("X", "Y", "Z") * 2, (*card.coordinates, *(card.residuals or ())), strict=False):
        text = f"{value:9.{decimals}f}"
        if len(text) > 9:
            of = f"model {card.model}" if card.model else "ground control"
            raise A7SimError(
                f"{of}, point {card.point}: expected {name} to fit nine columns with {decimals} decimals, got {text}"
            )
        line += text
    return line


def _number(text: str, columns: int, where: str) -> str:
    if not (text.isascii() and text.isdigit() and int(text) > 0 and len(text) <= columns):
        raise A7SimError(f"{where}: expected a positive number of at most {columns} digits, got {text!r}")
    return text


def _shared(strip: Strip, model: Model) -> Iterator[tuple[str, Array]]:
    """Yield the deviations ``(3,)`` from the mean of the points that another model of the strip also contains."""
    count: Mapping[str, int] = {name: sum(name in other.points for other in strip.models) for name in model.points}
    deviations = strip.deviations(model)
    for i, name in enumerate(model.points):
        if count[name] > 1:
            yield name, deviations[:, i]
