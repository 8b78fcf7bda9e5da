"""Reference pages of scenario, exercise and study files, made from their structs and the strings below the fields."""

import ast
import inspect
from pathlib import Path

import msgspec

from a7sim.scenario import schema as scenario_schema
from a7sim.study import schema as study_schema
from a7sim.study.responses import RESPONSES
from a7sim.training import exercise as exercise_schema
from a7sim.training.metrics import MEASURES

SCENARIO_OPENING = """# Scenario files

A scenario is one TOML file: a flight, its photographs, the plotter, the operator and the work to be done. `a7sim scenario validate FILE` lists each error with its place;
`a7sim scenario schema` prints the JSON Schema for an editor. `--set PATH=VALUE` of `run` and the like changes any value by its path: `observer.parallax_um`, `photos.1.laid`, `plan.bx`.
Angles are gon. Lengths are mm at the instrument and in photographs, m on the ground, and um at photo scale if the name ends in `_um`. A key without a default is required.
"""
EXERCISE_OPENING = """# Exercise files

An exercise is a folder with `exercise.toml`, `text.md` and the scripts that `exercise.toml` names. [The teacher's guide](../teacher-guide.md) has a complete example; `a7sim train check-exercise` lists what is missing. The reasons are in [decision 14](../decisions/0014-training.md).
"""
STUDY_OPENING = """# Study files

A study is one TOML file with one question about one scenario. [The researcher's guide](../researcher-guide.md) explains how to write and run one; the reasons are in [decision 15](../decisions/0015-studies.md).
"""


def scenario_page():
    """Return the page of scenario files."""
    return _page(SCENARIO_OPENING, [scenario_schema], scenario_schema.Scenario)


def exercise_page():
    """Return the page of exercise files."""
    measures = ["", "## Metrics", "", "| metric | value |", "| --- | --- |"]
    measures += [f"| `{name}` | {_first_sentence(each)} |" for name, each in sorted(MEASURES.items())]
    return _page(EXERCISE_OPENING, [exercise_schema], exercise_schema.Exercise) + "\n".join(measures) + "\n"


def study_page():
    """Return the page of study files."""
    responses = ["", "## Responses", "", "| name | unit | meaning |", "| --- | --- | --- |"]
    responses += [f"| `{each.name}` | {each.unit} | {each.meaning} |" for each in RESPONSES.values()]
    return _page(STUDY_OPENING, [study_schema], study_schema.StudyDefinition) + "\n".join(responses) + "\n"


def _first_sentence(measure):
    return inspect.getdoc(measure).split("\n\n")[0].replace("\n", " ").replace("|", "\\|")


def _page(opening, modules, root):
    notes = {name: text for module in modules for name, text in notes_of(module).items()}
    lines = [opening]
    for each in _reached(root):
        lines += _struct_lines(each, notes)
    return "\n".join(lines).rstrip() + "\n"


def notes_of(module):
    """Return the string below each field of each class as {class: {key: text}}; inherited fields are included."""
    tree = ast.parse(Path(inspect.getsourcefile(module)).read_text(encoding="utf-8"))
    classes = {node.name: _notes_in(node) for node in tree.body if isinstance(node, ast.ClassDef)}
    return {
        name: {
            key: text
            for base in reversed(getattr(module, name).__mro__)
            for key, text in classes.get(base.__name__, {}).items()
        }
        for name in classes
    }


def _notes_in(node):
    notes, last = {}, None
    for statement in node.body:
        if isinstance(statement, ast.AnnAssign):
            last = statement.target.id
        elif last and isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant):
            notes[last] = " ".join(str(statement.value.value).split())
            last = None
        else:
            last = None
    return notes


def _reached(root):
    """Return the structs reachable from `root`, root first, each once, in order of first use."""
    found = [root]
    for each in found:
        for key in msgspec.structs.fields(each):
            found += [kind for kind in _structs_in(msgspec.inspect.type_info(key.type)) if kind not in found]
    return found


def _structs_in(kind):
    if isinstance(kind, msgspec.inspect.Metadata):
        return _structs_in(kind.type)
    if isinstance(kind, msgspec.inspect.StructType):
        return [kind.cls]
    inner = [getattr(kind, name) for name in ("item_type", "value_type") if hasattr(kind, name)]
    several = [each for name in ("types", "item_types") for each in getattr(kind, name, ())]
    return list(dict.fromkeys(cls for each in [*inner, *several] for cls in _structs_in(each)))


def _struct_lines(struct, notes):
    yield f"## {struct.__name__}"
    yield ""
    yield inspect.getdoc(struct)
    yield ""
    yield "| key | expected | default | |"
    yield "| --- | --- | --- | --- |"
    for key in msgspec.structs.fields(struct):
        note = notes.get(struct.__name__, {}).get(key.name, "")
        cells = (f"`{key.encode_name}`", expected(msgspec.inspect.type_info(key.type)), _default(key), note)
        yield "| " + " | ".join(cell.replace("|", "\\|").replace("<", "&lt;") for cell in cells) + " |"
    yield ""


PLAIN = {
    msgspec.inspect.FloatType: "a number",
    msgspec.inspect.IntType: "a whole number",
    msgspec.inspect.StrType: "a text",
    msgspec.inspect.BoolType: "true or false",
    msgspec.inspect.AnyType: "any value",
    msgspec.inspect.NoneType: "nothing",
}


def expected(kind):
    """Return a description of the values that a key accepts."""
    if isinstance(kind, msgspec.inspect.Metadata):
        described = (kind.extra_json_schema or {}).get("description")
        return described or expected(kind.type)
    if type(kind) in PLAIN:
        return PLAIN[type(kind)]
    if isinstance(kind, msgspec.inspect.LiteralType):
        return " or ".join(
            f"`{value!r}`".replace("'", '"') if isinstance(value, str) else str(value) for value in kind.values
        )
    if isinstance(kind, msgspec.inspect.StructType):
        return f"[{kind.cls.__name__}](#{kind.cls.__name__.lower()})"
    if isinstance(kind, msgspec.inspect.UnionType):
        return " or ".join(expected(each) for each in kind.types if not isinstance(each, msgspec.inspect.NoneType))
    return _several(kind)


def _several(kind):
    if isinstance(kind, msgspec.inspect.TupleType):
        inner = [expected(each) for each in kind.item_types]
        return f"{len(inner)} of: {inner[0]}" if len(set(inner)) == 1 else ", ".join(inner)
    if isinstance(kind, msgspec.inspect.DictType):
        return f"a table of: {expected(kind.value_type)}"
    return f"a list of: {expected(kind.item_type)}"


def _default(key):
    if key.default_factory is not msgspec.NODEFAULT:
        value = key.default_factory()
        return _written(value)
    return "" if key.default is msgspec.NODEFAULT else _written(key.default)


def _written(value):
    if isinstance(value, msgspec.Struct):
        return "its own defaults"
    if value is None:
        return "none"
    return f"`{msgspec.json.encode(value).decode()}`"
