"""Names and prose of the project are plain: rules over syntax trees, comments, strings and pages (CONTRIBUTING.md)."""

import ast
import io
import re
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

PROJECT = Path(__file__).parents[1]
ALLOWED = PROJECT / "tests" / "plain_language_allowed.tsv"
"""Lines ``path<TAB>phrase<TAB>reason``: it may only shrink."""
MAX_ALLOWED = 30

FORBIDDEN_NAMES = frozenset(
    {"who", "whoever", "whom", "them", "those", "there", "somebody", "nobody", "everybody", "anybody", "told", "said"}
)
"""Pronouns, adverbs and participles that are no name of a thing."""

SUPERLATIVE = re.compile(r"^_*(MOST|FEWEST|LONGEST|SHORTEST|LARGEST|SMALLEST|FARTHEST|NEAREST|WORST|LEAST)_(?!COUNT)")
"""Limits are called MAX_ or MIN_; the least count of a counter is a term of the field."""

DEMANDED_CLASSES = frozenset({"Serial"})
"""Class names that a library looks up in several modules: pyserial's protocol handlers."""

FORBIDDEN_PHRASES = re.compile(
    r"""\b(?:
        whoever | whomever | somebody | nobody | everybody | anybody
      | so\ (?:many|much|often) | as\ (?:many|much|often)\ as
      | crews? | fleets? | crowds? | deeds? | desks? | chairs? | shelf | shelves
      | the\ house | computing\ room | at\ the\ door | at\ its\ doors?
      | those\ (?:who|that\ are|of\ some) | who\ (?:works|sits)
      | (?:goes|go|went|going|gone)\ on | (?:puts?|putting)\ (?:it\ |them\ )?right | comes?\ to | came\ to
      | lets?\ the\ operator
      | are\ told | is\ told | as\ it\ was\ told
    )\b""",
    re.VERBOSE | re.IGNORECASE,
)
"""Words that docs/glossary.md and CONTRIBUTING.md replace by plain ones."""

CHECKED = ("src", "benchmarks", "docs", "tests")
"""Folders of Python files whose names and prose are checked."""

GENERATED = ("docs/figures/", "docs/studies/", "site/", "tests/journals/", "tests/__snapshots__/")


def python_files() -> list[Path]:
    """Return all Python files but this one, which plants what is forbidden."""
    found = [file for folder in CHECKED for file in sorted((PROJECT / folder).rglob("*.py"))]
    return [file for file in found if file != Path(__file__)]


def pages() -> list[Path]:
    found = [*PROJECT.glob("*.md"), *(PROJECT / "docs").rglob("*.md")]
    found += [file for folder in ("exercises", "scenarios", "studies") for file in (PROJECT / folder).rglob("*.toml")]
    found += [*(PROJECT / "exercises").rglob("*.md")]
    return sorted(file for file in found if not _relative(file).startswith(GENERATED))


def _relative(path: Path) -> str:
    return path.relative_to(PROJECT).as_posix()


def names_in(source: str) -> Iterator[tuple[int, str]]:
    """Yield the line and text of each name that the source binds: variables, parameters, functions and classes."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.id
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node.lineno, node.name
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.attr


def forbidden_names(source: str) -> list[tuple[int, str]]:
    """Return the names of a source that are a pronoun, an adverb, a participle or a superlative limit."""
    return [
        (line, name)
        for line, name in names_in(source)
        if name.lstrip("_").lower() in FORBIDDEN_NAMES or SUPERLATIVE.match(name)
    ]


def prose_of_python(source: str) -> Iterator[tuple[int, str]]:
    """Yield the line and text of every comment and string of a source."""
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.lineno, node.value


def prose_of_page(text: str) -> Iterator[tuple[int, str]]:
    """Yield the paragraphs of a page with the line each begins on."""
    line = 1
    for paragraph in re.split(r"(\n\s*\n)", text):
        yield line, paragraph
        line += paragraph.count("\n")


def forbidden_phrases(prose: Iterator[tuple[int, str]]) -> list[tuple[int, str]]:
    """Return the line and phrase of every forbidden phrase, whatever white space separates its words."""
    return [
        (line + text.count("\n", 0, match.start()), " ".join(match.group().lower().split()))
        for line, text in prose
        for match in FORBIDDEN_PHRASES.finditer(text.replace("\n", " "))
    ]


def allowed() -> dict[tuple[str, str], str]:
    rows = [line.split("\t") for line in ALLOWED.read_text(encoding="utf-8").splitlines() if line]
    return {(path, phrase): reason for path, phrase, reason in rows}


@cache
def phrases_by_file() -> dict[str, list[tuple[int, str]]]:
    found = {_relative(file): forbidden_phrases(prose_of_python(file.read_text("utf-8"))) for file in python_files()}
    found |= {_relative(page): forbidden_phrases(prose_of_page(page.read_text("utf-8"))) for page in pages()}
    return {path: hits for path, hits in found.items() if hits}


def test_no_name_is_a_pronoun_a_participle_or_a_superlative_limit():
    found = {_relative(file): forbidden_names(file.read_text("utf-8")) for file in python_files()}
    assert {path: names for path, names in found.items() if names} == {}


def test_each_class_name_exists_once_in_the_package():
    homes = defaultdict(list)
    for file in sorted((PROJECT / "src").rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text("utf-8"))):
            if isinstance(node, ast.ClassDef):
                homes[node.name].append(_relative(file))
    assert {
        name: files for name, files in homes.items() if len(files) > 1 and name.lstrip("_") not in DEMANDED_CLASSES
    } == {}


def test_prose_has_no_forbidden_phrase_outside_the_allow_list():
    exceptions = allowed()
    found = {
        f"{path}:{line}: {phrase}"
        for path, hits in phrases_by_file().items()
        for line, phrase in hits
        if (path, phrase) not in exceptions
    }
    assert sorted(found) == []


def test_the_allow_list_is_short_has_reasons_and_no_entry_that_nothing_needs():
    exceptions = allowed()
    used = {(path, phrase) for path, hits in phrases_by_file().items() for _, phrase in hits}
    assert len(exceptions) <= MAX_ALLOWED
    assert all(reason.strip() for reason in exceptions.values())
    assert set(exceptions) <= used


@pytest.mark.parametrize(
    "planted",
    [
        "def measure(who): pass",
        "for them in (): pass",
        "class Somebody: pass",
        "MOST_ROUNDS = 3",
        "self.told = 1",
        "_LONGEST_LINE: int = 3",
    ],
)
def test_a_planted_name_is_found(planted):
    assert forbidden_names(planted)


@pytest.mark.parametrize(
    "planted",
    [
        '"""Nobody keeps what a crowd registers."""',
        "x = 1  # as many as there are",
        'help = "Let the operator work."',
        "raise ValueError('who works here')",
    ],
)
def test_a_planted_phrase_is_found(planted):
    assert forbidden_phrases(prose_of_python(planted))


def test_a_phrase_over_a_line_break_is_found():
    assert forbidden_phrases(prose_of_page("One line.\n\nIt prints so\nmany lines.")) == [(3, "so many")]
