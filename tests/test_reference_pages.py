"""The generated reference pages are up to date and complete (issue 10)."""

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
    import make_reference  # noqa: PLC0415 # the script is in the folder of the pages

    return make_reference


def test_every_page_is_up_to_date(maker, akwanga_folder):
    assert maker.stale(akwanga_folder) == [], "run python docs/make_reference.py"


def test_a_page_with_other_content_is_stale(maker, akwanga_folder, monkeypatch, tmp_path):
    monkeypatch.setattr(maker, "DOCS", tmp_path)
    assert set(maker.stale(akwanga_folder)) == set(maker.pages(akwanga_folder))


def test_a_file_without_a_description_is_an_error(maker, tmp_path):
    (tmp_path / "surprise.csv").write_text("point\n")
    with pytest.raises(ValueError, match=r"surprise\.csv"):
        maker.files.page(tmp_path)


@pytest.mark.parametrize(("page", "root"), [("scenario", Scenario), ("study", StudyDefinition), ("exercise", Exercise)])
def test_every_key_of_a_file_format_is_documented(page, root):
    """Compare with the JSON schema that msgspec makes of the file, an independent source."""
    page_text = (DOCS / "reference" / f"{page}.md").read_text(encoding="utf-8")
    for name, table in msgspec.json.schema(root)["$defs"].items():
        section = page_text.split(f"\n## {name}\n")[1].split("\n## ")[0]
        assert re.findall(r"^\| `(\w+)` \|", section, re.MULTILINE) == list(table["properties"])


def test_every_command_is_documented_with_an_example():
    from a7sim.cli import cli  # noqa: PLC0415 # imported only where it is used

    page_text = (DOCS / "reference" / "commands.md").read_text(encoding="utf-8")
    for verb in cli.list_commands(None):
        section = page_text.split(f"\n## a7sim {verb}\n")[1].split("\n## ")[0]
        assert f"```sh\na7sim {verb}" in section
