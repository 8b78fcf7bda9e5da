"""The documents: every page is in the navigation, every link has a target, no page fetches from other servers."""

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
    """Return the anchors that MkDocs makes of the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```$", "", text, flags=re.DOTALL | re.M), re.M)
    return {re.sub(r"[\s-]+", "-", re.sub(r"[^\w\s-]", "", each.lower()).strip()) for each in headings}


def test_the_navigation_names_each_page_once_and_each_page_exists():
    assert len(set(NAV)) == len(NAV) > 20
    assert [name for name in NAV if not (DOCS / name).is_file()] == []


def test_every_page_is_in_the_navigation():
    """Decisions are in their own list."""
    reached = {DOCS / name for name in NAV}
    listed = (DOCS / "decisions" / "index.md").read_text(encoding="utf-8")
    reached |= {DOCS / "decisions" / name for name in re.findall(r"\]\((0\S+\.md)\)", listed)}
    assert set(PAGES[1:]) - reached == set()


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(ROOT)) for path in PAGES])
def test_every_link_has_a_target_within_the_site(path):
    text = re.sub(r"^```.*?^```$", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.M)
    for target in re.findall(r"\]\((?!https?:)([^)\s]+)\)", re.sub(r"`[^`]*`", "", text)):
        file, _, anchor = target.partition("#")
        target_file = (path.parent / file).resolve() if file else path
        assert target_file.exists(), target
        assert path.parent == ROOT or target_file.is_relative_to(DOCS), f"{target} is outside of the site"
        if anchor:
            assert anchor in anchors_of(target_file.read_text(encoding="utf-8")), target


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(ROOT)) for path in PAGES])
def test_no_diagram_needs_a_script(path):
    assert "```mermaid" not in path.read_text(encoding="utf-8")


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(ROOT)) for path in PAGES])
def test_every_command_on_a_page_is_valid(path):
    for line in re.findall(r"^(?:    )?(a7sim [a-z].*)$", path.read_text(encoding="utf-8"), re.M):
        for each in without_alternatives(re.split(r"  #| [<>] ", line)[0]):
            parse(shlex.split(each, comments=True)[1:], line)


def without_alternatives(line):
    """Return a line without optional parts, once for each alternative of words such as `book|forms`."""
    line = re.sub(r" \[[^\]]*\]", "", line)
    several = re.search(r"(?<= )[a-z]+(?:\|[a-z]+)+(?= |$)", line)
    return [line.replace(several[0], word) for word in several[0].split("|")] if several else [line]


def parse(words, line):
    """Parse a command with click without running it; ignore a missing file of the reader."""
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
def test_the_site_is_built_without_a_warning_and_fetches_from_no_other_server(tmp_path):
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
