"""The figure of the packages: the layers of the import contract and the imports between them."""

import tomllib
from pathlib import Path

import grimp

PYPROJECT = Path(__file__).parents[2] / "pyproject.toml"

WIDTH, ROW, BOX, TALL, GAP, MARGIN = 900, 62, 116, 30, 160, 24

COLUMNS = {
    "cli": 2.0, "api": 1.2, "study": 1.5, "training": 2.8, "console": 0.6, "report": 2.0, "session": 1.4,
    "processing": 4.0, "strip_methods": 2.3, "journal": 1.2, "operator": 0.6, "link": 2.2, "result_documents": 3.3,
    "reduction": 3.3, "instrument": 1.7, "scene": 1.7, "geometry": 4.2, "scenario": 2.1, "table_files": 2.75,
    "plotters": 1.1, "bundled": 0.0, "text_tables": 0.76, "standard_points": 1.52, "errors": 2.28, "batch": 3.04,
    "text": 3.8, "deprecation": 4.56,
}  # fmt: skip
"""Column of a package in its layer, chosen so that few lines cross; a package without an entry is on the right."""

STYLE = """<style>
text { font: 13px system-ui, sans-serif; fill: #1d2a2a; text-anchor: middle }
.note { font-size: 12px; fill: #a3431f }
rect { fill: #dfe9e4; stroke: #4c6a62; rx: 5px }
path { fill: none; stroke: #8aa39b; stroke-width: 1.2 }
.link { stroke: #c2571f; stroke-width: 2.4; stroke-dasharray: 7 5 }
@media (prefers-color-scheme: dark) {
text { fill: #dbe7e2 } .note { fill: #f0a070 } rect { fill: #24332f; stroke: #7fa196 } path { stroke: #66807a } .link { stroke: #f0894a }
}
</style>"""


def picture():
    """Return the picture as SVG."""
    layers = _layers()
    at = dict(_places(layers))
    height = MARGIN * 2 + ROW * (len(layers) - 1) + TALL
    shown = [line for upper, lower in needed(imports_between(set(at))) for line in _arrow(at[upper], at[lower])]
    boxes = [line for package, place in at.items() for line in _box(package, place)]
    size = f'viewBox="0 0 {WIDTH} {height}" role="img" aria-label="The packages of a7sim and their imports"'
    return (
        "\n".join([f'<svg xmlns="http://www.w3.org/2000/svg" {size}>', STYLE, *shown, *_link(at), *boxes, "</svg>"])
        + "\n"
    )


def _layers():
    contract = tomllib.loads(PYPROJECT.read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"][0]
    return [[name.strip().removeprefix("a7sim.") for name in layer.split("|")] for layer in contract["layers"]]


def imports_between(packages):
    """Return the pairs (importing package, imported package) of the source tree."""
    graph = grimp.build_graph("a7sim", cache_dir=None)
    found = set()
    for module in graph.modules:
        for other in graph.find_modules_directly_imported_by(module):
            pair = (_package(module), _package(other))
            if set(pair) <= packages and pair[0] != pair[1]:
                found.add(pair)
    return found


def _package(module):
    return module.split(".")[1] if "." in module else ""


def needed(pairs):
    """Return the transitive reduction of the pairs: an import that a longer path implies needs no line."""
    below = {upper: {lower for first, lower in pairs if first == upper} for upper, _ in pairs}
    return sorted(
        (upper, lower)
        for upper, lower in pairs
        if not any(lower in _reached(other, below) for other in below[upper] - {lower})
    )


def _reached(package, below):
    found, waiting = set(), [package]
    while waiting:
        new = below.get(waiting.pop(), set()) - found
        found |= new
        waiting += new
    return found


def _places(layers):
    for row, packages in enumerate(layers):
        for package in packages:
            yield package, (MARGIN + BOX / 2 + COLUMNS.get(package, 3.6) * GAP, MARGIN + row * ROW + TALL / 2)


def _box(package, place):
    x, y = place
    yield f'<rect x="{x - BOX / 2:.0f}" y="{y - TALL / 2:.0f}" width="{BOX}" height="{TALL}"/>'
    yield f'<text x="{x:.0f}" y="{y + 4.5:.0f}">{package}</text>'


def _arrow(upper, lower):
    (x, y), (u, v) = upper, lower
    top, end = y + TALL / 2, v - TALL / 2 - 1
    bend = (end - top) / 2
    yield f'<path d="M{x:.0f} {top:.0f} C{x:.0f} {top + bend:.0f} {u:.0f} {end - bend:.0f} {u:.0f} {end:.0f}"/>'
    yield f'<path d="M{u - 4:.0f} {end - 6:.0f} L{u:.0f} {end:.0f} L{u + 4:.0f} {end - 6:.0f}"/>'


def _link(at):
    """Draw the link of operator and instrument, which exchange lines of text instead of importing each other."""
    (x, y), (u, v) = at["operator"], at["instrument"]
    start, end = x - BOX / 2, u - BOX / 2
    yield f'<path class="link" d="M{start:.0f} {y:.0f} C{start - 60:.0f} {y:.0f} {start - 60:.0f} {v:.0f} {end:.0f} {v:.0f}"/>'
    yield f'<text class="note" x="{start + 24:.0f}" y="{(y + v) / 2 + 8:.0f}">lines of text</text>'
