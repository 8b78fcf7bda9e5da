"""The reference is made from the things themselves: pages are fresh, and whole (issue 10)."""

import re
from pathlib import Path

import msgspec
import pytest

from a7sim.scenario.schema import Scenario
from a7sim.study.schema import StudyDefinition
from a7sim.training.exercise import Exercise

DOCS = Path(__file__).parents[1] / "docs"


@pytest.fixture
def maker(monkeypatch):
    monkeypatch.syspath_prepend(str(DOCS))
    import make_reference  # noqa: PLC0415 # it is found beside the pages

    return make_reference


def test_every_page_is_fresh(maker, akwanga_folder):
    assert maker.stale(akwanga_folder) == [], "run python docs/make_reference.py"


def test_a_page_that_says_something_else_is_stale(maker, akwanga_folder, monkeypatch, tmp_path):
    monkeypatch.setattr(maker, "DOCS", tmp_path)
    assert set(maker.stale(akwanga_folder)) == set(maker.pages(akwanga_folder))


def test_a_file_that_nobody_has_told_of_is_an_error(maker, tmp_path):
    (tmp_path / "surprise.csv").write_text("point\n")
    with pytest.raises(ValueError, match=r"surprise\.csv"):
        maker.files.page(tmp_path)


@pytest.mark.parametrize(("page", "root"), [("scenario", Scenario), ("study", StudyDefinition), ("exercise", Exercise)])
def test_every_key_that_a_file_may_say_is_told(page, root):
    """Against msgspec's own schema of the file, which is made in another way."""
    told = (DOCS / "reference" / f"{page}.md").read_text(encoding="utf-8")
    for name, table in msgspec.json.schema(root)["$defs"].items():
        section = told.split(f"\n## {name}\n")[1].split("\n## ")[0]
        assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) == list(table["properties"])


def test_every_command_is_told_with_its_example():
    from a7sim.cli import cli  # noqa: PLC0415 # not before it is asked for

    told = (DOCS / "reference" / "commands.md").read_text(encoding="utf-8")
    for verb in cli.list_commands(None):
        section = told.split(f"\n## a7sim {verb}\n")[1].split("\n## ")[0]
        assert f"```sh\na7sim {verb}" in section
