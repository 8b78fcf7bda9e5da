"""The pages hang together: every page is reached, every link leads somewhere, nothing is fetched (issue 10)."""

import re
import shlex
import subprocess
import sys
from importlib.util import find_spec

import click
import pytest

from a7sim.cli import cli
from tests.support.guide_pages import DOCS, ROOT

PAGES = [ROOT / "README.md", *sorted(DOCS.rglob("*.md"))]
NAV = re.findall(r"^ +- .*: (\S+\.md)$", (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1], re.M)


def anchors_of(text):
    """Return the anchors of a page's headings, as Markdown for the web makes them."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.M), re.M)
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", each.lower()).strip()) for each in headings}


def test_the_navigation_names_pages_that_exist_each_once():
    assert len(set(NAV)) == len(NAV) > 20
    assert [name for name in NAV if not (DOCS / name).is_file()] == []


def test_every_page_is_reached():
    """By the navigation; decisions by their list."""
    reached = {DOCS / name for name in NAV}
    listed = (DOCS / "decisions" / "index.md").read_text(encoding="utf-8")
    reached |= {DOCS / "decisions" / name for name in re.findall(r"\]\((0\S+\.md)\)", listed)}
    assert set(PAGES[1:]) - reached == set()


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(ROOT)) for path in PAGES])
def test_links_lead_somewhere_within_what_is_built(path):
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.M)
    for target in re.findall(r"\]\((?!https?:)([^)\s]+)\)", re.sub(r"`[^`]*`", "", text)):
        place, _, anchor = target.partition("#")
        there = (path.parent / place).resolve() if place else path
        assert there.exists(), target
        assert path.parent == ROOT or there.is_relative_to(DOCS), f"{target} is outside of the site"
        if anchor:
            assert anchor in anchors_of(there.read_text(encoding="utf-8")), target


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(ROOT)) for path in PAGES])
def test_no_diagram_needs_a_script_to_be_drawn(path):
    assert "```mermaid" not in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(ROOT)) for path in PAGES])
def test_every_command_on_a_page_is_one_that_the_command_line_takes(path):
    for line in re.findall(r"^(?:    )?(a7sim [a-z].*)$", path.read_text(encoding="utf-8"), re.M):
        for each in without_alternatives(re.split(r"  #| [<>] ", line)[0]):
            taken(shlex.split(each, comments=True)[1:], line)


def without_alternatives(line):
    """Return a line without what may be left out, once for each of what may stand there: `book|forms`."""
    line = re.sub(r" \[[^\]]*\]", "", line)
    several = re.search(r"(?<= )[a-z]+(?:\|[a-z]+)+(?= |$)", line)
    return [line.replace(several[0], word) for word in several[0].split("|")] if several else [line]


def taken(words, line):
    """Let click read a command without doing it; what a reader has in their folder is not there."""
    command, context = cli, click.Context(cli, info_name="a7sim")
    while isinstance(command, click.Group):
        name, command, words = command.resolve_command(context, words)
        if isinstance(command, click.Group):
            context = click.Context(command, info_name=name, parent=context)
    try:
        command.make_context(command.name, list(words), parent=context)
    except click.exceptions.Exit:
        assert "--help" in line or "--version" in line
    except click.ClickException as refused:
        if refused.format_message().endswith("does not exist."):
            return
        raise AssertionError(f"{line}: {refused.format_message()}") from refused


@pytest.mark.slow
@pytest.mark.skipif(find_spec("mkdocs") is None, reason="mkdocs is not installed: make docs installs it")
def test_the_site_is_built_without_a_warning_and_fetches_nothing(tmp_path):
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path / "site")]
    built = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=120)
    assert built.returncode == 0, built.stderr
    pages = sorted((tmp_path / "site").rglob("*.html"))
    assert len(pages) > 30
    fetches = re.compile(r"""<(?:script|img|link|iframe|source)\b[^>]*?(?:src|href)=["']?(?:https?:)?//[^>]*>""")
    for path in pages:
        assert fetches.findall(path.read_text(encoding="utf-8")) == [], path
    for path in (tmp_path / "site").rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", path.read_text(encoding="utf-8")), path
