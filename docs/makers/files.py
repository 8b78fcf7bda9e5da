"""The reference page of a session's files, read from the folder of a session of Akwanga."""

import json

OPENING = """# Files of a session

`run`, `operate`, `compile`, `calibrate` and `bridge` write a folder with `--out DIR`. CSV files have a header line, UTF-8 text, decimal points, and remarks after `#`; names of points and photographs are text.
Lengths are mm in photographs and at the instrument and m on the ground; angles are gon. Each file is written whole or not at all, except the journal, which grows line by line.

The tables below are read from the folder of `a7sim run akwanga --seed 7`.
"""

CONTENTS = {
    "session.jsonl": "The journal: a header, then each line (`>`) and reply (`<`) with its simulated time, connected and disconnected clients (`+`, `-`), and entries of the observation book; each line ends with a checksum over all lines before it. The journal contains no truth. [Decision 12](../decisions/0012-journal.md).",
    "session.scenario.json": "The scenario of the session, with the changes of `--set`. It lists faults and planned slips, so it is truth: do not give it to students.",
    "session.states.jsonl": "The state of the instrument every 2000 events, from which a replay can start. It is truth, too.",
    "book.csv": "The observation book of the operator, with struck-out entries.",
    "models.csv": "Model coordinates and perspective centres; a centre is the point `PHOTO:centre`.",
    "strip.csv": "All points of the strip on the ground.",
    "strip.crd": "The same strip as N.R.C. cards: control, models, ties (thesis 4.3).",
    "strip-output.crd": "The output cards of a strip program, with residuals and deviations in three more fields.",
    "strip-numbers.csv": "The number on the cards of each point.",
    "results.json": "All results, as `--json` prints them; see below.",
}
"""The contents of each file. A file of a session without an entry here is an error."""

ELSEWHERE = """## Files of other commands

| file | written by | contents |
| --- | --- | --- |
| `report.html` | `report` | the report of the session on one self-contained page |
| `case-A` to `case-E`, `strips.csv` | `run --strips all` | the five sessions, each a folder as above, and the accuracy of each combination |
| `comparator-models.csv`, `a8-strip.csv` and the like | scenarios with the methods `comparator` or `a8` | models and strip of each method |
| `residuals.csv` | `calibrate`, `reduce` | residuals at each cross and level; at each point |
| `map.geojson`, `map.svg` | `compile` | contours and lines as data and as a map |
| `session.jsonl.torn` | `--resume` | an incomplete last line of the journal |
| `cells.csv`, `comparisons.csv`, `replicates.csv`, `checkpoint.npz`, `study.html` | `study` | moments of the cells, differences between cells, replicates, checkpoint, page |
| `answers.txt`, `hints.txt` | `train` | answers of the student, and hints taken |
"""

DEPTH = 4


def page(folder):
    """Return the page, read from the folder of a session. Raises KeyError for a file without an entry in `CONTENTS`."""
    names = sorted((path.name for path in folder.iterdir()), key=list(CONTENTS).index)
    lines = [OPENING, "| file | contents | columns |", "| --- | --- | --- |"]
    lines += [f"| `{name}` | {CONTENTS[name]} | {_columns(folder / name)} |" for name in names]
    results = json.loads((folder / "results.json").read_text(encoding="utf-8"))
    lines += [
        "",
        "## results.json",
        "",
        "All keys, indented by level; of a list the first element, of a table keyed by points or photographs the first entry.",
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
    """Return the entries of a table; of a table keyed by points or photographs only the first."""
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
