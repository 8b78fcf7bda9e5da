"""`a7sim train` at the command line: start, hints, grades and exit codes, reports, safe storage of progress."""

import csv
import io
import json
import os
import re
import signal
import sqlite3
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from a7sim.errors import A7SimError
from a7sim.link.client.client import Client
from a7sim.training.attempts import run_attempt
from a7sim.training.catalogue import find_exercise
from a7sim.training.exercise import PlayedRun
from a7sim.training.progress import FILE, MIGRATIONS, Progress
from a7sim.training.submissions import grade_submission, grade_submissions
from a7sim.training.variation import attempt_seed

EXERCISES = Path(__file__).parents[1] / "exercises"
REFERENCE = EXERCISES / "04-parallax" / "reference.a7s"


@pytest.fixture
def train(typed, tmp_path, monkeypatch):
    """Return a function that runs `a7sim train ...` as student ada with an empty home folder."""
    monkeypatch.setenv("A7SIM_HOME", str(tmp_path / "home"))
    monkeypatch.setenv("A7SIM_STUDENT", "ada")
    return lambda *words: typed("train", *words)


def run_reference(train):
    return train("start", 4, "--seed", 4, "--script", REFERENCE)


def test_a_passing_script_has_exit_code_0_and_ticks_the_checklist(train):
    code, out, err = run_reference(train)
    assert (code, err) == (0, "")
    assert out.count("[x]") == 5 and "[ ]" not in out
    code, out, _ = train("grade", 4)
    assert code == 0 and "passed, 100 of 100 points" in out


def test_an_attempt_without_actions_is_graded_with_the_missing_readings_and_exit_code_1(train, tmp_path):
    (tmp_path / "nothing.a7s").write_text('scenario akwanga\nNOTE "where do I begin?"\n')
    assert train("start", 4, "--script", tmp_path / "nothing.a7s")[0] == 0
    code, out, _ = train("grade", "--json")
    document = json.loads(out)
    assert code == 1 and document["passed"] is False
    assert next(m["reason"] for m in document["marks"] if m["id"] == "complete").startswith("24 of 24 registrations")


def test_hints_are_given_in_order_cost_points_and_are_limited(train, tmp_path):
    assert train("hint", 4)[0] == 2
    run_reference(train)
    hints = find_exercise("4").exercise.hints
    for number, hint in enumerate(hints, start=1):
        assert train("hint", 4)[1].startswith(f"hint {number} (-{hint.cost:g} points): {hint.text[:20]}")
    code, _, err = train("hint", 4)
    assert code == 2 and "all 3 were given" in err
    assert "passed, 90 of 100 points" in train("grade", 4)[1]
    (journal,) = (tmp_path / "home").rglob("session.jsonl")
    assert "passed, 90 of 100 points" in train("grade", "--journal", journal.parent, "--seed", 4)[1]


def test_a_damaged_journal_gives_exit_code_3(train, tmp_path):
    run_reference(train)
    (journal,) = (tmp_path / "home").rglob("session.jsonl")
    journal.write_bytes(journal.read_bytes().replace(b"PROJ1:BY 0.14", b"PROJ1:BY 0.15", 1))
    code, _, err = train("grade", 4)
    assert code == 3 and "the journal is damaged" in err


def test_an_exam_gives_no_hints_and_no_ticks_and_is_closed_by_its_grade(train, tmp_path):
    (tmp_path / "nothing.a7s").write_text("scenario akwanga\n*CLS\n")
    out = train("start", 4, "--exam", "--script", tmp_path / "nothing.a7s")[1]
    assert "[ ]" not in out and "exam" in out
    assert "there are no hints" in train("hint")[2]
    assert train("watch")[0] == 2
    assert "expected --exam" in train("start", 4)[2]
    assert train("grade")[0] == 1
    with Progress(tmp_path / "home") as progress:
        last = progress.last("ada")
        assert last.closed and last.seed == attempt_seed("ada", "04-parallax", "exam") != attempt_seed(
            "ada", "04-parallax"
        )


def test_reset_keeps_the_old_attempt_and_starts_a_new_one(train, tmp_path):
    run_reference(train)
    assert "attempt 1 is closed and kept" in train("reset", 4)[1]
    assert "no attempt is open" in train("reset", 4)[1]
    run_reference(train)
    with Progress(tmp_path / "home") as progress:
        first, second = progress.attempts("ada")
    assert first.closed and not second.closed
    assert (first.folder / "session.jsonl").exists() and first.folder != second.folder


def test_only_answers_of_the_exercise_are_accepted(train):
    train("start", 1, "--seed", 1, "--script", EXERCISES / "01-counters" / "reference.a7s")
    assert "expected play=" in train("answer", "slip=3")[2]
    assert train("answer", "play=0.31")[1] == "play=0.31\n"
    assert train("grade")[0] == 1
    assert train("answer", "play=0.07")[0] == 0
    assert train("watch", 1, "--every", "0.1")[0] == 0


def test_hints_and_answers_are_printed_as_documents_with_json(train):
    train("start", 1, "--seed", 1, "--script", EXERCISES / "01-counters" / "reference.a7s")
    hint = json.loads(train("hint", 1, "--json")[1])
    first = find_exercise("1").exercise.hints[0]
    assert (hint["exercise"], hint["hint"], hint["cost"], hint["text"]) == ("01-counters", 1, first.cost, first.text)
    answer = json.loads(train("answer", "play=0.07", "--json")[1])
    assert (answer["exercise"], answer["answers"]) == ("01-counters", {"play": "0.07"})


def test_a_closed_attempt_accepts_neither_hints_nor_answers(train, tmp_path):
    (tmp_path / "nothing.a7s").write_text("scenario akwanga\n*CLS\n")
    train("start", "--exam", "--script", tmp_path / "nothing.a7s")
    assert "expected --exam, because an exam is open" in train("start", "exam")[2]
    train("grade")
    for words in (("hint",), ("answer", "x=1")):
        code, _, err = train(*words)
        assert code == 2 and "expected an attempt that is open, got one that is closed" in err


def test_a_report_without_attempts_and_a_failed_script_give_error_messages(train, tmp_path):
    assert train("report", "--format", "csv")[2] == "a7sim: student ada: expected attempts to report on, found none\n"
    (tmp_path / "wrong.a7s").write_text("scenario akwanga\nexpect COUN:X? = 9.5\n")
    code, out, err = train("start", 4, "--script", tmp_path / "wrong.a7s")
    assert code == 2 and "[ ]" in out and "9.5" in err
    assert "address of this machine alone" in train("start", 5, "--link", "tcp://8.8.8.8:1")[2]


def test_the_default_student_is_the_login_name(train, monkeypatch):
    monkeypatch.delenv("A7SIM_STUDENT")
    monkeypatch.setattr("getpass.getuser", lambda: "grace")
    assert train("report", "--format", "csv")[2].startswith("a7sim: student grace: ")


def test_a_submitted_attempt_is_graded_from_its_folder(train, tmp_path):
    run_reference(train)
    (journal,) = (tmp_path / "home").rglob("session.jsonl")
    code, _, err = train("grade", "--journal", journal.parent)
    assert code == 3 and "expected an attempt with scenario_hash" in err
    assert train("grade", "--journal", journal.parent, "--seed", 4)[0] == 0
    (tmp_path / "empty").mkdir()
    folders = ["--journal", journal.parent, "--journal", tmp_path / "home", "--journal", tmp_path / "empty"]
    code, out, err = train("grade", "--seed", 4, "--json", *folders)
    handed_in = json.loads(out)["handed_in"]
    assert code == 3 and "expected the journal of a session" in err
    assert [bool(each["grade"]) for each in handed_in] == [True, True, False]
    assert [each["student"] for each in handed_in] == ["ada", "ada", ""]


def test_several_processes_grade_a_class_as_one_process_does(tmp_path, monkeypatch):
    monkeypatch.setattr("a7sim.training.submissions.MAX_SERIAL", 2)
    exercise_folder = find_exercise("14")
    folders = []
    for i in range(4):
        seed = attempt_seed(f"student {i}", exercise_folder.name)
        folders.append(tmp_path / str(i))
        assert (
            run_attempt(exercise_folder, PlayedRun(script="faulty-kind.a7s"), folders[-1], seed, f"student {i}") == ""
        )
    together = grade_submissions(folders, workers=2)
    assert together == [grade_submission(folder) for folder in folders]
    assert [each.student for each in together] == [f"student {i}" for i in range(4)]
    assert not any(each.grade.passed for each in together)


def test_list_shows_an_exercise_with_its_criteria(train):
    out = train("list", "4")[1]
    assert "The drum reads to 0.01 mm" in out and "25  the other by is at zero" in out


def test_reports_of_student_and_class_in_every_form(train, tmp_path, monkeypatch):
    run_reference(train)
    train("grade")
    monkeypatch.setenv("A7SIM_STUDENT", "Bob O'Neill")
    train("start", 4, "--seed", 4, "--script", EXERCISES / "04-parallax" / "faulty-by2-left.a7s")
    train("grade")
    rows = list(csv.DictReader(io.StringIO(train("report", "--class", "--format", "csv")[1])))
    assert [(row["student_id"], row["assignment"], float(row["score"])) for row in rows] == [
        ("Bob O'Neill", "04-parallax", 70.0),
        ("ada", "04-parallax", 100.0),
    ]
    assert list(rows[0])[:4] == ["assignment", "duedate", "timestamp", "student_id"]
    statements = [json.loads(line) for line in train("report", "--class", "--format", "xapi")[1].splitlines()]
    assert [each["verb"]["display"]["en"] for each in statements] == ["passed", "failed"]
    assert statements[1]["result"]["score"] == {"scaled": 0.7, "raw": 70.0, "min": 0, "max": 100.0}
    document = json.loads(train("report", "--class", "--format", "json")[1])
    assert {each["student"] for each in document["grades"]} == {"ada", "Bob O'Neill"}
    for words in (["--class"], []):
        out = tmp_path / f"sheet{len(words)}.html"
        assert train("report", *words, "--out", out)[0] == 0
        text = out.read_text()
        assert "<svg" in text and not re.search(r'(src|href)="(?!#|data:)', text)
    assert "by&quot; was never returned to 0" in text and "Bob O&#x27;Neill" in text


def test_the_list_shows_passed_exercises(train):
    run_reference(train)
    train("grade")
    document = json.loads(train("list", "--json")[1])
    four = next(each for each in document["exercises"] if each["number"] == 4)
    assert (four["state"], four["points"], four["attempts"]) == ("passed", 100.0, 1)
    assert re.search(r"4 +See and measure y-parallax +passed +100 +1", train("list")[1])


def test_a_new_exercise_can_be_read_and_check_reports_its_missing_parts(train, tmp_path):
    assert train("new", tmp_path / "30-clouds")[0] == 0
    code, out, err = train("check-exercise", tmp_path / "30-clouds")
    assert code == 1 and err == ""
    assert "hint: expected 2 hints or more, got 1" in out and "faulty: expected 2" in out
    assert train("new", tmp_path / "30-clouds")[0] == 2


def test_check_detects_an_exercise_with_wrong_limits(train, tmp_path):
    folder = tmp_path / "04-parallax"
    folder.mkdir()
    for path in (EXERCISES / "04-parallax").iterdir():
        (folder / path.name).write_text(path.read_text())
    toml = folder / "exercise.toml"
    toml.write_text(toml.read_text().replace("excellent = 12\npass = 30", "excellent = 1\npass = 1e6"))
    code, out, _ = train("check-exercise", folder)
    assert code == 1
    assert re.search(
        r"cleared: expected excellent not below the accuracy of eye and least count, 5\.9\d+, got 1\n", out
    )
    assert "faulty-not-cleared.a7s: expected cleared to fail, got opposed" in out


def test_any_client_can_run_a_served_exercise(tmp_path):
    """With two consoles and a kill -9 the readings are stored, and start resumes the attempt."""
    environment = {**os.environ, "A7SIM_HOME": str(tmp_path), "A7SIM_STUDENT": "ada"}
    command = [sys.executable, "-m", "a7sim", "train", "start", "4", "--link", "tcp://127.0.0.1:0"]
    for number in (1, 2):
        server = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)
        try:
            lines = iter(server.stdout.readline, "")
            url = next(line.split()[1] for line in lines if line.startswith("tcp"))
            with Client.open(url) as client:
                client.send('REC "1011",BY1')
                assert client.ask("REC:COUN?") == str(number)
                second = subprocess.run(
                    command, env=environment, capture_output=True, text=True, timeout=60, check=False
                )
                assert second.returncode == 2 and "Traceback" not in second.stderr
                server.send_signal(signal.SIGKILL)
                server.wait(timeout=30)
        finally:
            server.kill()
            server.wait(timeout=30)
            server.stdout.close()
    with Progress(tmp_path) as progress:
        assert [each.number for each in progress.attempts("ada")] == [1]


def test_two_consoles_store_progress_at_the_same_time_without_loss(tmp_path):
    exercise_folder = find_exercise("4")

    def begin(student):
        with Progress(tmp_path) as progress:
            for _ in range(10):
                progress.begin(student, exercise_folder)

    threads = [threading.Thread(target=begin, args=(name,)) for name in ("ada", "ada", "bob")]
    for each in threads:
        each.start()
    for each in threads:
        each.join()
    with Progress(tmp_path) as progress:
        assert sorted(each.number for each in progress.attempts("ada")) == list(range(1, 21))
        assert len(progress.attempts()) == 30


def test_progress_of_a_newer_version_is_not_changed_and_an_empty_file_is_migrated(tmp_path):
    sqlite3.connect(tmp_path / FILE).close()
    Progress(tmp_path).close()
    database = sqlite3.connect(tmp_path / FILE)
    assert database.execute("PRAGMA user_version").fetchone() == (len(MIGRATIONS),)
    database.execute("PRAGMA user_version = 99")
    database.close()
    with pytest.raises(A7SimError, match="a newer a7sim wrote it"):
        Progress(tmp_path)


def test_train_help_imports_no_heavy_library():
    program = (
        "import atexit, sys; atexit.register(lambda: print(sorted(sys.modules)))\n"
        "sys.argv = ['a7sim', 'train', '--help']; from a7sim.cli import main; main()"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert "check" in done.stdout
    assert not {"'textual'", "'matplotlib'", "'scipy'"} & set(re.findall(r"'\w+'", done.stdout))
