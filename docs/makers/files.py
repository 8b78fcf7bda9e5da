"""The page of files: what a session of Akwanga leaves in its folder, read from the folder itself."""

import json

OPENING = """# What stands in a session's folder

`--out DIR` of `run`, `operate`, `compile`, `calibrate` and `bridge` leaves a folder. CSV has a header line, UTF-8, decimal points and `#` for remarks; names of points and photographs are text.
Lengths are mm in photographs and at the instrument, m on the ground, angles gon. Every file is there whole or not at all, except the journal, which grows a line at a time.

What follows was read from the folder of `a7sim run akwanga --seed 7`.
"""

TOLD = {
    "session.jsonl": "The journal: a header, then every line (`>`) and reply (`<`) with simulated time, clients that come and go (`+`, `-`), entries of the book; a checksum at each line's end that follows from all before it. It holds no truth. [Decision 12](../decisions/0012-journal.md).",
    "session.scenario.json": "The scenario as it was worked, with what `--set` changed. It lists faults and planted slips, so it is truth: keep it from students.",
    "session.states.jsonl": "The instrument's state every 2000 events, so that a replay can begin there. Truth, too.",
    "book.csv": "The observation book as the operator wrote it, struck entries and all.",
    "models.csv": "Model coordinates and perspective centres; centres are points `PHOTO:centre`.",
    "strip.csv": "All points of the strip on the ground.",
    "strip.crd": "The same strip as N.R.C. cards: control, models, ties (thesis 4.3).",
    "strip-output.crd": "The cards that a strip program gives back, with residuals and deviations in three more fields.",
    "strip-numbers.csv": "Which number on the cards stands for which point.",
    "results.json": "All results, as `--json` prints them; below.",
}
"""What each file is; a file that a session leaves and that is not told of here is an error."""

ELSEWHERE = """## Files of other commands

| file | of | what it is |
| --- | --- | --- |
| `report.html` | `report` | the session on one page that needs nothing beside it |
| `case-A` to `case-E`, `strips.csv` | `run --strips all` | the five sessions, each a folder as above, and the accuracy of every combination |
| `comparator-models.csv`, `a8-strip.csv` and their like | scenarios worked by comparator or as an A8's readings | models and strip of each way |
| `residuals.csv` | `calibrate`, `reduce` | residuals at every cross and level; at every point |
| `map.geojson`, `map.svg` | `compile` | contours and lines as data and as a sheet |
| `session.jsonl.torn` | `--resume` | a last line that was cut off in the middle of being written |
| `cells.csv`, `comparisons.csv`, `replicates.csv`, `checkpoint.npz`, `study.html` | `study` | the cells' moments, what differs between them, the replicates, where to go on, the page |
| `answers.txt`, `hints.txt` | `train` | what a student answered beside the instrument, and the hints they took |
"""

DEPTH = 4
LISTED_AT_MOST = 12


def page(folder):
    """Return the page, told from a session's folder. Raises KeyError for a file that nobody has told of."""
    names = sorted((path.name for path in folder.iterdir()), key=list(TOLD).index)
    lines = [OPENING, "| file | what it is | columns |", "| --- | --- | --- |"]
    lines += [f"| `{name}` | {TOLD[name]} | {_columns(folder / name)} |" for name in names]
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    lines += [
        "",
        "## results.json",
        "",
        "Every name, indented as it stands; of a list the first, of a table whose names are points or photographs the first as well.",
        "",
    ]
    lines += ["```text", *_outline(results), "```", "", ELSEWHERE]
    return "\n".join(lines).rstrip() + "\n"


def _columns(path):
    if path.suffix != ".csv":
        return ""
    header = next(line for line in path.read_text(encoding="utf-8").splitlines() if not line.startswith("#"))
    return f"`{header}`"


def _outline(value, depth=0):
    indent = "  " * depth
    for name, inner in _named(value):
        kinds = {_kind(each) for each in inner.values()} if isinstance(inner, dict) else set()
        if len(kinds) == 1 and kinds != {"table"}:
            yield f"{indent}{name}, each a {kinds.pop()}: {', '.join(inner)}"
        elif isinstance(inner, dict) and inner:
            yield f"{indent}{name}"
            yield from _outline(inner, depth + 1)
        elif isinstance(inner, list) and inner and isinstance(inner[0], dict):
            yield f"{indent}{name} (list)"
            yield from _outline(inner[0], depth + 1)
        else:
            yield f"{indent}{name}: {_kind(inner)}"


def _named(table):
    """Return the names of a table that all documents have: those that are points or photographs only once."""
    alike = {json.dumps(_shape(inner)) for inner in table.values()}
    names = list(table.items())
    if len(names) > 2 and len(alike) == 1 and isinstance(names[0][1], dict):
        return [(f"{names[0][0]} (and so on)", names[0][1])]
    return names


def _shape(value):
    return sorted(value) if isinstance(value, dict) else type(value).__name__


def _kind(value):
    if isinstance(value, list):
        return f"list of {_kind(value[0])}" if value else "list"
    return {str: "text", bool: "true or false", int: "number", float: "number", dict: "table", type(None): "nothing"}[
        type(value)
    ]
