"""Training (issue 8): exercises decide as designed, grades have reasons, and an edited journal is detected."""

from dataclasses import replace

import pytest
from msgspec.structs import replace as changed

from a7sim.journal.format import ChecksumChain, read_journal
from a7sim.training.attempts import resume_attempt, run_attempt, start_attempt, write_answers
from a7sim.training.catalogue import ExerciseError, all_exercises, find_exercise, read_exercise
from a7sim.training.checking import check_exercise
from a7sim.training.environment import UnreliableJournalError
from a7sim.training.exercise import MetricSpec, PlayedRun
from a7sim.training.grading import grade_folder
from a7sim.training.metrics import MetricResult, make_metric
from a7sim.training.variation import attempt_seed, scenario_for

EXERCISES = all_exercises()


@pytest.mark.parametrize(
    ("limits", "mutation"),
    [
        ({"excellent": 1e12, "passing": 1e12}, "its tolerances are unlimited"),
        ({"excellent": -1e12, "passing": -1e12}, "its tolerances are impossible"),
    ],
)
def test_a_criterion_without_effect_is_detected(parallax, limits, mutation):
    """Set a limit for the time of exercise 4 that every run reaches, or none."""
    time = parallax.exercise.criteria[-1]
    criteria = [*parallax.exercise.criteria[:-1], changed(time, **limits)]
    found = check_exercise(changed(parallax, exercise=changed(parallax.exercise, criteria=criteria)))
    dead = [each for each in found.faults if "expected some grade to change" in each]
    assert f"time: expected some grade to change if {mutation}, got no change" in dead
    assert {each.split(":")[0] for each in dead} == {"time"}


def test_exercises_have_unique_numbers_and_are_found_by_them():
    numbers = [each.exercise.number for each in EXERCISES]
    assert len(numbers) == len(set(numbers)) and numbers == sorted(numbers)
    assert all(each.name.startswith(f"{each.exercise.number:02d}-") for each in EXERCISES)
    assert [find_exercise(str(number)) for number in numbers] == EXERCISES


@pytest.fixture(scope="module")
def parallax():
    return find_exercise("4")


@pytest.fixture(scope="module")
def faulty_attempt(parallax, tmp_path_factory):
    folder = tmp_path_factory.mktemp("attempt")
    assert run_attempt(parallax, PlayedRun(script="faulty-by2-left.a7s"), folder, 4) == ""
    return folder


def test_the_sheet_names_the_mistake_with_its_points(parallax, faulty_attempt):
    grade = grade_folder(parallax, 4, faulty_attempt)
    mark = next(each for each in grade.failed if each.id == "at-rest")
    assert not grade.passed
    assert mark.sentence.startswith("by\" was never returned to 0 before reading by' at points 1, 5, 6, 2 and 4: -25.")


def test_an_edited_reply_is_detected_by_replaying_the_journal(parallax, faulty_attempt, tmp_path):
    journal = read_journal(faulty_attempt / "session.jsonl")
    number = next(
        n for n in range(2, len(journal) + 1) if journal.event(n).dir == "<" and journal.event(n).client == "student"
    )
    events = [journal.header, *(journal.event(n) for n in range(2, len(journal) + 1))]
    events[0].pop("crc")
    forged = type(journal.event(number))(**{**_fields(journal.event(number)), "text": "23"})
    events[number - 1] = forged
    chain = ChecksumChain()
    (tmp_path / "session.jsonl").write_bytes(b"".join(chain.line(each) + b"\n" for each in events))
    with pytest.raises(UnreliableJournalError, match=f"line {number}: expected the replayed line, "):
        grade_folder(parallax, 4, tmp_path)


def test_a_journal_of_another_seed_is_rejected(parallax, faulty_attempt):
    with pytest.raises(UnreliableJournalError, match="expected an attempt with"):
        grade_folder(parallax, 5, faulty_attempt)


def _fields(event):
    return {name: getattr(event, name) for name in event.__struct_fields__}


def test_the_journal_of_an_attempt_contains_no_truth(faulty_attempt):
    header = read_journal(faulty_attempt / "session.jsonl").header
    assert "scenario" not in header
    assert [each.name for each in faulty_attempt.iterdir()] == ["session.jsonl"]


def test_an_interrupted_attempt_resumes_where_it_ended(parallax, tmp_path):
    with start_attempt(parallax, 4, tmp_path, "ada", "practice") as environment:
        engine = environment.instrument.open("client2", time=1.0)
        engine.feed(b'PROJ1:BY 0.30\nREC "1011",BY1\n', 2.0)
        engine.feed(b"REC:COUN?\n", 3.0)
    journal = tmp_path / "session.jsonl"
    lines = journal.read_bytes().splitlines(keepends=True)
    cut = next(n for n, line in enumerate(lines) if b"REC:COUN?" in line) + 1
    journal.write_bytes(b"".join(lines[:cut]) + b'{"t":3.0,"cl')
    with resume_attempt(parallax, 4, tmp_path) as environment:
        assert environment.autograph.element("by1") == 0.3
        assert [each.point for each in environment.record().readings] == ["1011"]
        environment.instrument.open(time=environment.clock.now).feed(b'REC "1012",BY1\n', 9.0)
    assert grade_folder(parallax, 4, tmp_path).minutes == pytest.approx(
        (9.0 - environment.action_log.start_time) / 60.0, abs=0.1
    )


def test_two_students_have_different_photographs_and_one_student_always_the_same(parallax):
    ada, bob = (attempt_seed(name, parallax.name) for name in ("ada", "bob"))
    assert ada != bob and ada == attempt_seed("ada", parallax.name)
    assert ada != attempt_seed("ada", parallax.name, "exam")
    first, again, other = (scenario_for(parallax, seed) for seed in (ada, ada, bob))
    assert first == again and first.photos != other.photos


def test_answers_of_the_answer_file_have_precedence_over_notes(tmp_path):
    counters = find_exercise("1")
    assert run_attempt(counters, counters.exercise.reference, tmp_path, 1) == ""
    assert grade_folder(counters, 1, tmp_path).passed
    write_answers(tmp_path, {"play": "0.5"})
    assert [each.id for each in grade_folder(counters, 1, tmp_path).failed] == ["play"]


def test_pictures_are_not_drawn_again_for_a_grade_and_all_else_is_compared(parallax, tmp_path):
    with start_attempt(parallax, 4, tmp_path, "ada", "practice") as environment:
        engine = environment.instrument.open("client2")
        first = engine.feed(b"EYEP1:PICT? 20,10,8;:COUN:X?\n", 1.0)
        engine.feed(b'REC "1011",BY1\n', 2.0)
    assert len(set(first)) > 20, "expected a picture that is not black"
    assert grade_folder(parallax, 4, tmp_path).marks
    with resume_attempt(parallax, 4, tmp_path) as environment:
        assert environment.instrument.open(time=3.0).feed(b"EYEP1:PICT? 20,10,8;:COUN:X?\n", 3.0) == first


BAD = {
    'measure = "minutes"': ('measure = "minuets"', r"criterion\[6\]\.measure: expected one of"),
    'measure = "not-opposed"\ndone': ('measure = "parallax-left"\ndone', r"step\[4\]\.measure: .*: it uses the truth"),
    'fails = "cleared"': ('fails = "clear"', r"faulty\[1\]\.fails: expected one of complete"),
    'id = "at-rest"': ('id = "complete"', "criterion: expected every id once, got 'complete' twice"),
    'reference = { script = "reference.a7s" }': (
        'reference = { script = "reference.a7s", procedure = "interior" }',
        "reference: expected a script or a procedure, got both",
    ),
    'opening = { script = "opening.a7s" }': ("opening = {}", "opening: expected a script or a procedure, got neither"),
    'script = "faulty-by2-left.a7s"': (
        'procedure = "guess"',
        r"faulty\[0\]\.procedure: expected one of .*, got 'guess'",
    ),
    "minutes = 60": ('minutes = 60\nhandout = "sweets"', "handout: expected one of .*, got 'sweets'"),
    "away = 0.02": ('away = "far"', r"criterion\[4\]\.options\.away: expected a number, got \"far\""),
}


@pytest.mark.parametrize("was", BAD)
def test_the_error_message_for_a_mistake_in_an_exercise_names_its_place(parallax, tmp_path, was):
    now, expected = BAD[was]
    text = (parallax.folder / "exercise.toml").read_text()
    assert was in text
    (tmp_path / "exercise.toml").write_text(text.replace(was, now))
    with pytest.raises(ExerciseError, match=expected):
        read_exercise(tmp_path)


def test_metrics_have_reasons_in_words_with_numbers(parallax, tmp_path):
    """Evaluate typed lines; rejected commands and struck readings are ignored."""
    with start_attempt(parallax, 4, tmp_path, "ada", "practice") as environment:
        engine = environment.instrument.open("client2", time=5.0)
        lines = (
            b'PROJ1:BY 0.30;:REC "1011",BY1\n',
            b'PROJector1:BY:TURN -0.04;:RECord "1011",BY1\n',
            b'PROJ1:BY 99;:REC "1021",BY2;:REC:STR 3,"wrong point"\n',
            b'NOTE "answer play=0.07 Slip=none";:DRIV:X 3\n',
        )
        for line in lines:
            engine.feed(line, 6.0)
        record = environment.record({"play": "0.08"})

        def found(name, **options):
            return make_metric(MetricSpec(measure=name, options=options)).evaluate(record)

        assert found("spread", handles=["by1"]) == MetricResult(0.04, "by' at point 1 read from 0.26 to 0.30")
        assert found("missing-readings", points=["2"]) == MetricResult(1.0, "1 of 1 registration missing: 2")
        assert found("wrong-approach", handles=["by1"]).value == 1.0
        assert found("handles-moved", handles=["by1", "by2"]) == MetricResult(1.0, "by' moved")
        assert found("run-by-motor", handles=["X"]).value == 0.0
        assert found("not-opposed").value is None
        assert record.answers == {"play": "0.08", "slip": "none"}


def test_a_registration_is_a_pointing_unless_its_element_was_turned_at_the_point(parallax, tmp_path):
    """The console registers the element in use, so a named element does not exclude a pointing."""
    with start_attempt(parallax, 4, tmp_path, "ada", "practice") as environment:
        engine = environment.instrument.open("client2", time=5.0)

        def missing_after(*lines):
            for line in lines:
                engine.feed(line + b"\n", 6.0)
            options = {"points": ["1"], "each": 4}
            return (
                make_metric(MetricSpec(measure="missing-pointings", options=options))
                .evaluate(environment.record())
                .value
            )

        assert missing_after(b"DRIV:X 50", b"PROJ1:BY 0.3", b"DRIV:X 1", b'REC "1011",BY1') == 3.0
        assert missing_after(b"PROJ1:BY 0.4;:WHE:Y 0.4", b'REC "1011",BY1') == 3.0
        assert missing_after(b'REC "1011",BY2') == 2.0
        assert missing_after(b'REC "1011"') == 1.0


def test_a_missing_or_non_numeric_answer_is_reported_and_has_no_value(parallax, tmp_path):
    """Compare answers with the hidden values; blanks and capitals of words are ignored."""
    with start_attempt(parallax, 4, tmp_path, "ada", "practice") as environment:
        environment.instrument.open("client2", time=5.0).feed(b'DRIV:X 20;:REC "1011"\n', 6.0)
        blank = environment.record({})
        hidden = {"base": 92.5, "height": 300.0, "sign": ["minus", "-"]}

    def found(name, answers, **options):
        record = replace(blank, written_answers=answers, hidden=hidden)
        return make_metric(MetricSpec(measure=name, options=options)).evaluate(record)

    both = {"keys": ["base", "height"]}
    assert found("answers-off", {"base": "92", "height": "301"}, **both) == MetricResult(
        1.0, "height was answered 301, the largest deviation"
    )
    assert found("answers-off", {"base": "92"}, **both) == MetricResult(None, "height: not answered")
    assert found("answers-off", {"base": "x", "height": "1"}, **both) == MetricResult(
        None, "base: expected a number, got 'x'"
    )
    assert found("answers-off", {"base": "92", "height": "inf"}, **both) == MetricResult(
        None, "height: expected a number, got 'inf'"
    )
    assert found("answer-off", {"base": "92"}, key="base", true="base") == MetricResult(0.5, "base was answered 92")
    assert found("answer-off", {}, key="base", true="base") == MetricResult(None, "base: not answered")
    assert found("answer-off", {"base": "x"}, key="base", true="base") == MetricResult(
        None, "base: expected a number, got 'x'"
    )
    assert found("answer-off", {"base": "1"}, key="base", true="nowhere").value is None
    assert found("answer-wrong", {"sign": " Minus"}, keys=["sign"]) == MetricResult(0.0, "sign: right")
    assert found("answer-wrong", {"sign": "plus"}, keys=["sign", "base"]) == MetricResult(
        2.0, "not answered: base; sign: plus is wrong"
    )
    place = {"point": "1", "keys": ["x", "y"]}
    assert found("place-by-scales", {"x": "1"}, **place) == MetricResult(None, "expected numbers for x and y")
    assert found("place-by-scales", {"x": "1", "y": "2"}, **place | {"point": "2"}) == MetricResult(
        None, "nothing was registered at 2"
    )
