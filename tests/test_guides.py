"""Pages with commands: the commands run and print the shown output, and the pictures exist (issues 8, 10)."""

import re
from pathlib import Path

import pytest

from a7sim.training.attempts import run_attempt, seed_for
from a7sim.training.catalogue import all_exercises, find_exercise
from tests.support.guide_pages import ROOT, blocks, commands, not_shown, page, steps, type_in

GUIDES = {name: page(f"{name}-guide") for name in ("student", "teacher")}
PAGES_IN_STEPS = ("tutorial", "running", "sessions", "researcher-guide")
PAGES_WITH_PICTURES = {**GUIDES, "tutorial": page("tutorial")}
README = (ROOT / "README.md").read_text(encoding="utf-8")
MAX_PICTURE_BYTES = 160_000


@pytest.fixture
def student_terminal(typed, tmp_path, monkeypatch):
    """Return a student's terminal with an own exercise, a folder of attempts handed in, and own progress."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("A7SIM_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("A7SIM_STUDENT", "ada")
    four = find_exercise("4")
    Path("mine.a7s").write_text((four.folder / "faulty-half.a7s").read_text())
    played = four.exercise.faulty[0]
    run_attempt(four, played, Path("handed-in/bob"), seed_for(four, played), "bob")
    return typed


def test_the_commands_of_the_student_guide_run(student_terminal):
    for words, remark in commands(GUIDES["student"]):
        if "until Ctrl-C" in remark:
            assert "--link" in words and "--link" in student_terminal(*words[:2], "--help")[1]
        elif words[1] == "hint":
            assert student_terminal(*words)[1].startswith("hint 1 (-2 points)")
        else:
            type_in(student_terminal, words, remark)


def test_the_commands_of_the_teacher_guide_run(student_terminal):
    """The worked example is written as the guide shows it."""
    text = GUIDES["teacher"]
    (toml,) = blocks(text, "toml")
    names = ("reference.a7s", "faulty-once.a7s", "faulty-wrong-base.a7s", "faulty-from-above.a7s")
    scripts = dict(zip(names, blocks(text, "a7s"), strict=True))
    folder = Path("20-set-the-base")
    for words, remark in commands(text):
        if words[1:2] == ["check-exercise"] and "exit code" not in remark:
            for path in folder.iterdir():
                path.unlink()
            (folder / "text.md").write_text("Set the base.\n")
            (folder / "exercise.toml").write_text(toml)
            for name, script in scripts.items():
                (folder / name).write_text(script)
        seed = ["--seed", "4"] if words[1] == "grade" else []
        out = type_in(student_terminal, [*words, *seed], remark)
        if "holds" in remark:
            assert out.strip() == remark.strip()
        if words[1] == "start" and "--script" in words:
            assert "[x] Register point 1 twice" in out


@pytest.mark.slow
@pytest.mark.parametrize("name", PAGES_IN_STEPS)
def test_the_commands_of_a_page_print_the_shown_output(student_terminal, name):
    for step in steps(page(name)):
        for file, text in step.files.items():
            Path(file).write_text(text, encoding="utf-8")
        printed = "".join(type_in(student_terminal, words, remark) for words, remark in step.commands)
        assert not_shown(step.shown, printed) == [], step.commands


def test_a_line_that_is_not_printed_is_detected():
    assert not_shown(["a  b", "...", "a ... d"], "a b\n c d\n") == []
    assert not_shown(["b ... a"], "a b") == ["b ... a"]


def test_the_commands_of_the_readme_print_the_shown_output(student_terminal):
    """Its scripts are in the clone; the reason of an operator that gives up is on the error line, too."""
    readme_steps = steps(README)
    assert len(readme_steps) == 5
    for step in readme_steps:
        printed = ""
        for words, remark in step.commands:
            here = [str(ROOT / each) if each.startswith("exercises/") else each for each in words]
            printed += type_in(student_terminal, here, remark)
        assert not_shown(step.shown, printed) == [], step.commands


@pytest.mark.parametrize("name", PAGES_WITH_PICTURES)
def test_pictures_exist_are_small_and_fetch_nothing(name):
    pictures = re.findall(r"!\[.+?\]\((.+?)\)", PAGES_WITH_PICTURES[name])
    assert pictures
    for each in pictures:
        text = (ROOT / "docs" / each).read_text(encoding="utf-8")
        assert text.lstrip().startswith(("<svg", "<?xml")) and len(text.encode()) < MAX_PICTURE_BYTES
        assert not re.search(r"url\((?!#)|(?:src|href)=\"(?!#)", text), each


def test_every_exercise_has_a_paragraph():
    numbers = re.findall(
        r"^(\d+)\. \*\*", GUIDES["student"].split("## The exercises")[1].split("\n## ")[0], re.MULTILINE
    )
    assert [int(each) for each in numbers] == [each.exercise.number for each in all_exercises()]
