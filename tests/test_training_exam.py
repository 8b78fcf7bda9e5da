"""The examination (issue 8): an own job for each student, no hints, no ticks, a time budget, one grading."""

import re
from pathlib import Path

import pytest

from a7sim.training.catalogue import ExerciseError, find_exercise, read_exercise
from a7sim.training.environment import open_environment
from a7sim.training.exercise import MetricSpec
from a7sim.training.metrics import make_metric
from a7sim.training.progress import Progress
from a7sim.training.variation import scenario_for

EXERCISES = Path(__file__).parents[1] / "exercises"
SOME_SEEDS = range(40)


@pytest.fixture(scope="module")
def exam():
    return find_exercise("exam")


@pytest.fixture
def train(typed, tmp_path, monkeypatch):
    """Return a function that runs `a7sim train ...` as student ada with an empty home folder."""
    monkeypatch.setenv("A7SIM_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("A7SIM_STUDENT", "ada")
    return lambda *words: typed("train", *words)


def test_each_seed_draws_its_own_job_and_always_the_same(exam):
    scenarios = [scenario_for(exam, seed) for seed in SOME_SEEDS]
    assert scenarios == [scenario_for(exam, seed) for seed in SOME_SEEDS]
    models = [each.models[0] for each in scenarios]
    assert {(model.left, model.right) for model in models} == {("101", "102"), ("102", "103")}
    assert {model.base for model in models} == {"inside", "outside"}
    assert {each.photos[0].polarity for each in scenarios} == {"positive", "negative"}
    assert all(len({photo.polarity for photo in each.photos}) == 1 for each in scenarios), (
        "alternatives belong together"
    )
    assert len({(each.terrain.relief, each.camera.c, each.photos[1].omega) for each in scenarios}) == len(scenarios)


def test_the_choice_of_a_group_does_not_change_the_varied_numbers(exam, tmp_path):
    """Groups are drawn after the numbers, so an exercise that gets a group keeps its students' photographs."""
    text = (exam.folder / "exercise.toml").read_text()
    without = re.sub(r"^choose = \[$.*?^\]$", "", text, flags=re.DOTALL | re.MULTILINE)
    assert without != text
    (tmp_path / "exercise.toml").write_text(without)
    bare = read_exercise(tmp_path)
    for seed in range(5):
        one, other = scenario_for(exam, seed), scenario_for(bare, seed)
        assert [each.omega for each in one.photos] == [each.omega for each in other.photos]


def test_a_group_without_alternatives_is_a_mistake(exam, tmp_path):
    text = (exam.folder / "exercise.toml").read_text()
    (tmp_path / "exercise.toml").write_text(re.sub(r"(?s)choose = \[\n.*?\n\]", "choose = [[]]", text, count=1))
    with pytest.raises(ExerciseError, match=r"choose\[0\]: expected one alternative or more"):
        read_exercise(tmp_path)


def test_the_examination_starts_without_an_exercise_name_and_writes_the_job_sheet(train, tmp_path):
    (tmp_path / "nothing.a7s").write_text('scenario akwanga\nNOTE "where do I begin?"\n')
    code, out, _ = train("start", "--exam", "--script", tmp_path / "nothing.a7s")
    assert code == 0 and out.startswith("16 The examination") and ", exam: 0 of 300 minutes" in out
    assert "[ ]" not in out and "[x]" not in out
    paper = re.search(r"your papers: (.*job\.txt)\n", out).group(1)
    with Progress(tmp_path / "home") as progress:
        attempt = progress.last("ada")
    assert attempt.mode == "exam" and paper == str(attempt.folder / "job.txt")
    ordered = scenario_for(find_exercise("exam"), attempt.seed).models[0]
    job = (attempt.folder / "job.txt").read_text()
    assert f"{ordered.left} on the left of the model" in job and f"base {ordered.base}:" in job
    assert "there are no hints" in train("hint")[2]
    assert train("verify")[0] == 1
    assert train("verify")[1].count("not passed") == 1


def test_the_error_message_for_a_missing_exercise_names_the_argument(train):
    code, _, err = train("start")
    assert code == 2 and "train start: expected EXERCISE, such as 4" in err and "--exam for the examination" in err


def test_the_checklist_states_that_the_time_is_up(train, tmp_path):
    (tmp_path / "slow.a7s").write_text("scenario akwanga\nwait 18060\n*CLS\n")
    assert "301 of 300 minutes, the time is up" in train("start", "--exam", "--script", tmp_path / "slow.a7s")[1]
    assert "fail         0/10   within the time given" in train("verify")[1]


def test_fittings_are_graded_by_the_job_sheet(exam, tmp_path):
    """Correct levers do not count if base or pictures differ from the job sheet."""
    ordered = scenario_for(exam, 16).models[0]
    assert ordered.base == "outside"
    with open_environment(exam, 16, tmp_path, "ada", "exam") as environment:
        engine = environment.instrument.open("client2")
        found = make_metric(MetricSpec(measure="wrong-fittings", options={"by_job": True})).evaluate
        engine.feed(f'PHOT1:LOAD "{ordered.left}";:PHOT2:LOAD "{ordered.right}"\n'.encode(), 1.0)
        assert "the base is inside instead of outside" in found(environment.record()).reason
        assert f"projector 1 has {ordered.left} instead of {ordered.right}" in found(environment.record()).reason


def test_files_of_the_student_are_not_listed_as_papers(train, tmp_path):
    (tmp_path / "nothing.a7s").write_text("scenario akwanga\n*CLS\n")
    train("start", 16, "--script", tmp_path / "nothing.a7s")
    train("hint")
    assert train("answer", "x1=4999.31")[0] == 0
    again = train("start", 16, "--script", tmp_path / "nothing.a7s")[1]
    assert again.count("your papers:") == 1 and "answers.txt" not in again and "hints.txt" not in again


def test_an_exam_keeps_its_first_grade_after_later_changes(train, tmp_path):
    script = EXERCISES / "01-counters" / "faulty-misread.a7s"
    train("start", 1, "--exam", "--seed", 1, "--script", script)
    code, out, _ = train("grade", 1)
    assert code == 1
    with Progress(tmp_path / "home") as progress:
        (progress.last("ada").folder / "answers.txt").write_text("play=0.07\n")
    assert train("grade", 1) == (code, out, "")
    with Progress(tmp_path / "home") as progress:
        assert len(progress.grades("ada")) == 1
