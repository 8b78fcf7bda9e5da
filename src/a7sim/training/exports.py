"""Exports of grades: nbgrader's columns, one JSON document, xAPI statements as JSON lines."""

import uuid
from collections.abc import Mapping, Sequence
from typing import Any

import msgspec

from a7sim.result_documents import Document, document_header
from a7sim.table_files import to_csv
from a7sim.training.exercise import FULL_MARKS
from a7sim.training.progress import Attempt, GradeRecord

NBGRADER_COLUMNS = (
    "assignment",
    "duedate",
    "timestamp",
    "student_id",
    "last_name",
    "first_name",
    "email",
    "raw_score",
    "late_submission_penalty",
    "score",
    "max_score",
)
"""Of the CSV that `nbgrader export` writes."""

HOME_PAGE = "http://localhost/a7sim"
"""Home page of the students' accounts unless the teacher names one."""

_VERB = "http://adlnet.gov/expapi/verbs/"
_STATEMENTS = uuid.UUID("5d9cfd3b-3a61-5c7e-9a53-7b6a7d1f0a07")
"""Namespace of the statements' ids, so that the same grade is always the same statement."""

_EXTENSIONS = "http://localhost/a7sim/xapi"


def to_nbgrader(best: Mapping[tuple[str, str], GradeRecord]) -> str:
    """Return best grades as CSV in the columns of nbgrader. Hints are deducted; names and due dates are unknown."""
    rows: list[list[str | float | None]] = []
    for (student, exercise), each in sorted(best.items()):
        points = each.grade.points
        rows.append([exercise, None, each.at, student, None, None, None, points, 0.0, points, FULL_MARKS])
    return to_csv(NBGRADER_COLUMNS, rows)


def to_class_document(
    grades: Sequence[GradeRecord], best: Mapping[tuple[str, str], GradeRecord], attempts: Sequence[Attempt]
) -> Document:
    """Return all grades as a document, the best ones by student and exercise first."""
    return document_header("train report") | {
        "best": [_grade_document(each) for _, each in sorted(best.items())],
        "grades": [_grade_document(each) for each in grades],
        "attempts": [
            {
                "student": each.student,
                "exercise": each.exercise,
                "mode": each.mode,
                "number": each.number,
                "begun": each.begun,
                "closed": each.closed,
            }
            for each in attempts
        ],
    }


def _grade_document(each: GradeRecord) -> Document:
    attempt = each.attempt
    attempt_keys = {
        "student": attempt.student,
        "exercise": attempt.exercise,
        "mode": attempt.mode,
        "attempt": attempt.number,
    }
    grade: Document = msgspec.to_builtins(each.grade)
    return attempt_keys | {"at": each.at, "grade": grade}


def to_xapi(grades: Sequence[GradeRecord], home_page: str = HOME_PAGE) -> str:
    """Return grades as xAPI statements, one JSON object per line."""
    return "".join(msgspec.json.encode(_statement(each, home_page)).decode() + "\n" for each in grades)


def _statement(each: GradeRecord, home_page: str) -> dict[str, Any]:
    attempt, grade = each.attempt, each.grade
    verb = "passed" if grade.passed else "failed"
    identity = f"{attempt.student}/{attempt.exercise}/{attempt.number}/{each.at}/{grade.points}"
    return {
        "id": str(uuid.uuid5(_STATEMENTS, identity)),
        "actor": {"objectType": "Agent", "account": {"homePage": home_page, "name": attempt.student}},
        "verb": {"id": _VERB + verb, "display": {"en": verb}},
        "object": {
            "objectType": "Activity",
            "id": f"urn:a7sim:exercise:{attempt.exercise}",
            "definition": {
                "type": "http://adlnet.gov/expapi/activities/assessment",
                "name": {"en": grade.title},
            },
        },
        "result": {
            "score": {"scaled": grade.points / FULL_MARKS, "raw": grade.points, "min": 0, "max": FULL_MARKS},
            "success": grade.passed,
            "completion": True,
            "duration": f"PT{60.0 * grade.minutes:.0f}S",
            "extensions": {f"{_EXTENSIONS}/hints": grade.hints, f"{_EXTENSIONS}/failed": [m.id for m in grade.failed]},
        },
        "context": {"extensions": {f"{_EXTENSIONS}/mode": attempt.mode, f"{_EXTENSIONS}/attempt": attempt.number}},
        "timestamp": each.at,
    }
