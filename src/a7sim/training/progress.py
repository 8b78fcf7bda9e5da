"""Progress of students: attempts, hints and grades in one SQLite file, safe with several consoles open."""

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

import msgspec

from a7sim.errors import A7SimError
from a7sim.training.exercise import Exercise, ExerciseFolder, Hint
from a7sim.training.grading import Grade, HintsTaken
from a7sim.training.variation import attempt_seed

FILE = "progress.sqlite"

BUSY_S = 15.0
"""Time in s that a console waits while another one writes."""

PRACTICE, EXAM = "practice", "exam"

MIGRATIONS = (
    """
    CREATE TABLE attempt (
        id INTEGER PRIMARY KEY,
        student TEXT NOT NULL,
        exercise TEXT NOT NULL,
        mode TEXT NOT NULL CHECK (mode IN ('practice', 'exam')),
        number INTEGER NOT NULL,
        seed INTEGER NOT NULL,
        folder TEXT NOT NULL,
        begun TEXT NOT NULL,
        closed TEXT,
        UNIQUE (student, exercise, number)
    ) STRICT;
    CREATE TABLE hint (
        attempt INTEGER NOT NULL REFERENCES attempt (id),
        number INTEGER NOT NULL,
        cost REAL NOT NULL,
        at TEXT NOT NULL,
        PRIMARY KEY (attempt, number)
    ) STRICT;
    CREATE TABLE grade (
        id INTEGER PRIMARY KEY,
        attempt INTEGER NOT NULL REFERENCES attempt (id),
        at TEXT NOT NULL,
        points REAL NOT NULL,
        passed INTEGER NOT NULL,
        document TEXT NOT NULL
    ) STRICT;
    CREATE INDEX grade_of_attempt ON grade (attempt);
    """,
)
"""Migrations of the file from one schema version to the next; the first from an empty file to version 1."""


@dataclass(frozen=True)
class Attempt:
    """Attempt at an exercise."""

    id: int
    student: str
    exercise: str
    mode: str
    number: int
    seed: int
    folder: Path
    begun: str
    closed: str | None
    """Time of closing, as ISO 8601 in UTC; None while it is open."""


@dataclass(frozen=True)
class GradeRecord:
    """Grade with its time and attempt."""

    attempt: Attempt
    at: str
    grade: Grade


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")


class Progress:
    """Progress in a folder, with the attempts' folders beside it."""

    def __init__(self, home: Path) -> None:
        self.home = home
        try:
            home.mkdir(parents=True, exist_ok=True)
            self._database = sqlite3.connect(home / FILE, timeout=BUSY_S, isolation_level=None)
            self._database.execute("PRAGMA journal_mode = WAL")
            self._database.execute("PRAGMA foreign_keys = ON")
            self._migrate()
        except (OSError, sqlite3.Error) as error:
            raise A7SimError(f"{home / FILE}: expected a usable progress file: {error}") from error

    def close(self) -> None:
        """Close the file."""
        self._database.close()

    def __enter__(self) -> "Progress":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _version(self) -> int:
        return int(self._database.execute("PRAGMA user_version").fetchone()[0])

    def _migrate(self) -> None:
        if self._version() < len(MIGRATIONS):
            with self._writing():
                for version in range(self._version(), len(MIGRATIONS)):
                    for statement in MIGRATIONS[version].split(";"):
                        self._database.execute(statement)
                    self._database.execute(f"PRAGMA user_version = {version + 1}")
        if self._version() > len(MIGRATIONS):
            raise A7SimError(
                f"{self.home / FILE}: expected progress of schema version {len(MIGRATIONS)} or older, "
                f"got {self._version()}: a newer a7sim wrote it"
            )

    @contextmanager
    def _writing(self) -> Iterator[None]:
        self._database.execute("BEGIN IMMEDIATE")
        try:
            yield
        except BaseException:
            self._database.execute("ROLLBACK")
            raise
        self._database.execute("COMMIT")

    # --- attempts -------------------------------------------------------------------------------------

    def begin(
        self, student: str, exercise_folder: ExerciseFolder, mode: str = PRACTICE, seed: int | None = None
    ) -> Attempt:
        """Start a new attempt; an open one is closed. Its folder does not exist yet."""
        name = exercise_folder.name
        with self._writing():
            self._close_open(student, name)
            number = 1 + self._one("SELECT count(*) FROM attempt WHERE student = ? AND exercise = ?", student, name)
            used_seed = attempt_seed(student, name, mode) if seed is None else seed
            folder = Path("attempts") / quote(student, safe="") / name / str(number)
            self._database.execute(
                "INSERT INTO attempt (student, exercise, mode, number, seed, folder, begun) "
                "VALUES (?, ?, ?, ?, ?, ?, ?)",
                (student, name, mode, number, used_seed, str(folder), _now()),
            )
        return self.last(student, name)

    def _one(self, query: str, *values: object) -> int:
        return int(self._database.execute(query, values).fetchone()[0])

    def open_attempt(self, student: str, exercise: str) -> Attempt | None:
        """Return the open attempt of a student."""
        found = self._attempts("student = ? AND exercise = ? AND closed IS NULL", student, exercise)
        return found[-1] if found else None

    def last(self, student: str, exercise: str | None = None) -> Attempt:
        """Return a student's last attempt, at an exercise or at all. Raises A7SimError if there is none."""
        found = (
            self._attempts("student = ? AND exercise = ?", student, exercise)
            if exercise
            else self._attempts("student = ?", student)
        )
        if not found:
            at = f" at {exercise}" if exercise else ""
            raise A7SimError(
                f"student {student}: expected an attempt{at}, found none: a7sim train start {exercise or 'EXERCISE'}"
            )
        return found[-1]

    def attempts(self, student: str | None = None) -> list[Attempt]:
        """Return the attempts of a student, or of all, in order of their start."""
        return self._attempts("student = ?", student) if student else self._attempts("1 = 1")

    def _attempts(self, condition: str, *values: object) -> list[Attempt]:
        columns = "id, student, exercise, mode, number, seed, folder, begun, closed"
        rows = self._database.execute(f"SELECT {columns} FROM attempt WHERE {condition} ORDER BY id", values)
        return [
            Attempt(id, student, name, mode, number, seed, self.home / folder, begun, closed)
            for id, student, name, mode, number, seed, folder, begun, closed in rows
        ]

    def end(self, attempt: Attempt) -> None:
        """Close an attempt: it is kept, and the next one starts anew."""
        with self._writing():
            self._close_open(attempt.student, attempt.exercise)

    def _close_open(self, student: str, exercise: str) -> None:
        self._database.execute(
            "UPDATE attempt SET closed = ? WHERE student = ? AND exercise = ? AND closed IS NULL",
            (_now(), student, exercise),
        )

    # --- hints and grades -----------------------------------------------------------------------------

    def next_hint(self, attempt: Attempt, exercise: Exercise) -> tuple[int, Hint]:
        """Return the next hint and its number, counted from 1, and record it.

        Raises A7SimError in an exam, and if all hints were given.
        """
        if attempt.mode == EXAM:
            raise A7SimError(f"{attempt.exercise}: expected an attempt for practice, got an exam: there are no hints")
        with self._writing():
            given = self._one("SELECT count(*) FROM hint WHERE attempt = ?", attempt.id)
            if given >= len(exercise.hints):
                raise A7SimError(f"{attempt.exercise}: expected a hint that is left, got none: all {given} were given")
            hint = exercise.hints[given]
            self._database.execute("INSERT INTO hint VALUES (?, ?, ?, ?)", (attempt.id, given + 1, hint.cost, _now()))
        return given + 1, hint

    def hints_taken(self, attempt: Attempt) -> HintsTaken:
        """Return the number of hints of an attempt, and their cost."""
        query = "SELECT count(*), coalesce(sum(cost), 0) FROM hint WHERE attempt = ?"
        number, cost = self._database.execute(query, (attempt.id,)).fetchone()
        return HintsTaken(int(number), float(cost))

    def record_grade(self, attempt: Attempt, grade: Grade) -> None:
        """Record a grade; it ends an exam."""
        with self._writing():
            self._database.execute(
                "INSERT INTO grade (attempt, at, points, passed, document) VALUES (?, ?, ?, ?, ?)",
                (attempt.id, _now(), grade.points, int(grade.passed), msgspec.json.encode(grade).decode()),
            )
            if attempt.mode == EXAM:
                self._close_open(attempt.student, attempt.exercise)

    def first_grade(self, attempt: Attempt) -> Grade | None:
        """Return the first grade of an attempt, None if there is none."""
        row = self._database.execute(
            "SELECT document FROM grade WHERE attempt = ? ORDER BY id", (attempt.id,)
        ).fetchone()
        return msgspec.json.decode(row[0], type=Grade) if row else None

    def grades(self, student: str | None = None) -> list[GradeRecord]:
        """Return the grades of a student, or of all, in their order."""
        attempts = {each.id: each for each in self.attempts(student)}
        rows = self._database.execute("SELECT attempt, at, document FROM grade ORDER BY id")
        return [
            GradeRecord(attempts[attempt], at, msgspec.json.decode(document, type=Grade))
            for attempt, at, document in rows
            if attempt in attempts
        ]

    def best(self, student: str | None = None) -> dict[tuple[str, str], GradeRecord]:
        """Return the best grade by student and exercise; a passed one precedes any that is not."""
        best: dict[tuple[str, str], GradeRecord] = {}
        for each in self.grades(student):
            key = each.attempt.student, each.attempt.exercise
            rank = (each.grade.passed, each.grade.points)
            if key not in best or rank > (best[key].grade.passed, best[key].grade.points):
                best[key] = each
        return best
