"""The guides for students and teachers tell the truth: what they say to type works, their pictures stand (issue 8)."""

import re
import shlex
from pathlib import Path

import pytest

from a7sim.training.attempts import attempted, seed_played
from a7sim.training.shelf import all_exercises, find_exercise

ROOT = Path(__file__).parents[1]
GUIDES = {name: (ROOT / "docs" / f"{name}-guide.md").read_text(encoding="utf-8") for name in ("student", "teacher")}
README = (ROOT / "README.md").read_text(encoding="utf-8")
LARGEST_PICTURE = 150_000


def blocks(text, kind):
    return re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL)


def commands(text):
    """Return what is to be typed: words, and what the remark behind it says."""
    lines = [line for block in blocks(text, "sh") for line in block.splitlines()]
    return [(shlex.split(line, comments=True)[1:], line.partition(" # ")[2]) for line in lines]


@pytest.fixture
def room(typed, tmp_path, monkeypatch):
    """A student's terminal: an exercise of their own making, a folder that others handed in, progress of their own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("A7SIM_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("A7SIM_STUDENT", "ada")
    four = find_exercise("4")
    Path("mine.a7s").write_text((four.folder / "faulty-half.a7s").read_text())
    played = four.exercise.faulty[0]
    attempted(four, played, Path("handed-in/bob"), seed_played(four, played), "bob")
    return typed


def type_in(room, words, remark):
    code, out, err = room(*words)
    assert "Traceback" not in err
    if "opens the console" in remark:
        assert (code, err[-90:].count("expected a terminal to sit at")) == (2, 1), (words, err)
        return out
    expected = int(found.group(1)) if (found := re.search(r"\(exit code (\d)", remark)) else 0
    assert code == expected, (words, out, err)
    return out


def test_what_the_student_is_told_to_type_works(room):
    for words, remark in commands(GUIDES["student"]):
        if "until Ctrl-C" in remark:
            assert "--link" in words and "--link" in room(*words[:2], "--help")[1]
        elif words[1] == "hint":
            assert room(*words)[1].startswith("hint 1 (-2 points)")
        else:
            type_in(room, words, remark)


def test_what_the_teacher_is_told_to_type_works(room):
    """With the worked example written down as it stands in the guide."""
    text = GUIDES["teacher"]
    (toml,) = blocks(text, "toml")
    names = ("reference.a7s", "faulty-once.a7s", "faulty-wrong-base.a7s", "faulty-from-above.a7s")
    scripts = dict(zip(names, blocks(text, "a7s"), strict=True))
    folder = Path("20-set-the-base")
    for words, remark in commands(text):
        if words[1:2] == ["check"] and "exit code" not in remark:
            for path in folder.iterdir():
                path.unlink()
            (folder / "text.md").write_text("Set the base.\n")
            (folder / "exercise.toml").write_text(toml)
            for name, script in scripts.items():
                (folder / name).write_text(script)
        seed = ["--seed", "4"] if words[1] == "verify" else []
        out = type_in(room, [*words, *seed], remark)
        if "holds" in remark:
            assert out.strip() == remark.strip()
        if words[1] == "start" and "--script" in words:
            assert "[x] Register point 1 twice" in out


def test_the_readme_shows_what_training_prints(room):
    section = README.split("## Learn to work it")[1].split("\n## ")[0]
    shown = [line[4:] for line in section.splitlines() if line.startswith("    ")]
    typed = [line for line in shown if line.startswith("a7sim train ")]
    printed = ""
    for line in typed:
        words, remark = shlex.split(line, comments=True)[1:], line.partition(" # ")[2]
        printed += type_in(
            room, [str(ROOT / each) if each.startswith("exercises/") else each for each in words], remark
        )
    flat = " ".join(printed.split())
    sample = [line for line in shown if line and line not in typed]
    assert len(typed) == 3 and len(sample) > 5
    assert [line for line in sample if " ".join(line.removesuffix("...").split()) not in flat] == []


@pytest.mark.parametrize("name", GUIDES)
def test_pictures_are_there_small_and_fetch_nothing(name):
    pictures = re.findall(r"!\[.+?\]\((.+?)\)", GUIDES[name])
    assert pictures
    for each in pictures:
        text = (ROOT / "docs" / each).read_text(encoding="utf-8")
        assert text.lstrip().startswith(("<svg", "<?xml")) and len(text.encode()) < LARGEST_PICTURE
        assert not re.search(r"url\((?!#)|(?:src|href)=\"(?!#)", text), each


def test_every_exercise_has_its_paragraph():
    told = re.findall(r"^(\d+)\. \*\*", GUIDES["student"].split("## The exercises")[1].split("\n## ")[0], re.MULTILINE)
    assert [int(each) for each in told] == [each.exercise.number for each in all_exercises()]


def test_links_of_the_guides_lead_somewhere():
    for name, text in GUIDES.items():
        for target in re.findall(r"(?<!!)\[.+?\]\((?!http)(.+?)\)", text):
            assert (ROOT / "docs" / target.partition("#")[0]).exists(), (name, target)
