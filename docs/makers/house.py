"""The picture of the house, from its imports: rooms by the layers that lint-imports holds, and who asks whom for what."""

import tomllib
from pathlib import Path

import grimp

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"

WIDTH, ROW, BOX, TALL, GAP, MARGIN = 720, 68, 112, 30, 160, 24

COLUMNS = {
    "cli": 2.0, "study": 1.5, "training": 2.8, "console": 0.6, "report": 2.0, "session": 1.4, "computing": 3.4,
    "operator": 0.6, "link": 1.7, "documents": 2.8, "reduction": 2.8, "instrument": 1.7, "scene": 1.7,
    "geometry": 3.5, "scenario": 2.0, "files": 2.75, "manual": 1.1,
    "shelves": 0.0, "sheets": 0.72, "standard_points": 1.44, "mistakes": 2.16, "among": 2.88, "wording": 3.6,
}  # fmt: skip
"""Where a room stands in its layer, so that few lines cross; one that is not told of stands on the right."""

STYLE = """<style>
text { font: 13px system-ui, sans-serif; fill: #1d2a2a; text-anchor: middle }
.note { font-size: 12px; fill: #a3431f }
rect { fill: #dfe9e4; stroke: #4c6a62; rx: 5px }
path { fill: none; stroke: #8aa39b; stroke-width: 1.2 }
.wire { stroke: #c2571f; stroke-width: 2.4; stroke-dasharray: 7 5 }
@media (prefers-color-scheme: dark) {
text { fill: #dbe7e2 } .note { fill: #f0a070 } rect { fill: #24332f; stroke: #7fa196 } path { stroke: #66807a } .wire { stroke: #f0894a }
}
</style>"""


def picture():
    """Return the picture as SVG."""
    layers = _layers()
    at = dict(_places(layers))
    height = MARGIN * 2 + ROW * (len(layers) - 1) + TALL
    shown = [line for upper, lower in needed(asked(set(at))) for line in _arrow(at[upper], at[lower])]
    boxes = [line for room, place in at.items() for line in _box(room, place)]
    size = f'viewBox="0 0 {WIDTH} {height}" role="img" aria-label="The rooms of a7sim and what they import"'
    return (
        "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" {size}>', STYLE, *shown, *_wire(at), *boxes, "</svg>"])
        + "\n"
    )


def _layers():
    contract = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"][0]
    return [[name.strip().removeprefix("a7sim.") for name in layer.split("|")] for layer in contract["layers"]]


def asked(rooms):
    """Return which room imports from which: pairs of names, from the source as it stands."""
    graph = grimp.build_graph("a7sim", cache_dir=None)
    found = set()
    for module in graph.modules:
        for other in graph.find_modules_directly_imported_by(module):
            pair = (_room(module), _room(other))
            if set(pair) <= rooms and pair[0] != pair[1]:
                found.add(pair)
    return found


def _room(module):
    return module.split(".")[1] if "." in module else ""


def needed(pairs):
    """Return the pairs that do not follow from others: who asks through another room needs no line of its own."""
    below = {upper: {lower for first, lower in pairs if first == upper} for upper, _ in pairs}
    return sorted(
        (upper, lower)
        for upper, lower in pairs
        if not any(lower in _reached(other, below) for other in below[upper] - {lower})
    )


def _reached(room, below):
    found, waiting = set(), [room]
    while waiting:
        new = below.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


def _places(layers):
    for row, rooms in enumerate(layers):
        for room in rooms:
            yield room, (MARGIN + BOX / 2 + COLUMNS.get(room, 3.6) * GAP, MARGIN + row * ROW + TALL / 2)


def _box(room, place):
    x, y = place
    yield f'<rect x="{x - BOX / 2:.0f}" y="{y - TALL / 2:.0f}" width="{BOX}" height="{TALL}"/>'
    yield f'<text x="{x:.0f}" y="{y + 4.5:.0f}">{room}</text>'


def _arrow(upper, lower):
    (x, y), (u, v) = upper, lower
    top, end = y + TALL / 2, v - TALL / 2 - 1
    bend = (end - top) / 2
    yield f'<path d="M{x:.0f} {top:.0f} C{x:.0f} {top + bend:.0f} {u:.0f} {end - bend:.0f} {u:.0f} {end:.0f}"/>'
    yield f'<path d="M{u - 4:.0f} {end - 6:.0f} L{u:.0f} {end:.0f} L{u + 4:.0f} {end - 6:.0f}"/>'


def _wire(at):
    """Draw what the operator has instead of an import: a line of text to the instrument."""
    (x, y), (u, v) = at["operator"], at["instrument"]
    start, end = x - BOX / 2, u - BOX / 2
    yield f'<path class="wire" d="M{start:.0f} {y:.0f} C{start - 60:.0f} {y:.0f} {start - 60:.0f} {v:.0f} {end:.0f} {v:.0f}"/>'
    yield f'<text class="note" x="{start + 24:.0f}" y="{(y + v) / 2 + 8:.0f}">lines of text</text>'
