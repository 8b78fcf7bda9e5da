"""`a7sim train grade` and `watch`: grades."""

import time
from pathlib import Path

import click
import msgspec

from a7sim.cli import EXIT_DIFFERS, options
from a7sim.cli.completers import exercise_argument
from a7sim.cli.train.options import last_attempt, progress_in, student_name, student_options
from a7sim.errors import A7SimError
from a7sim.journal.session_files import JOURNAL
from a7sim.result_documents import as_json, document_header
from a7sim.training.attempts import ANSWERS
from a7sim.training.catalogue import find_exercise
from a7sim.training.environment import UnreliableJournalError
from a7sim.training.grading import Grade, grade_folder, grade_lines
from a7sim.training.progress import EXAM, Attempt, Progress
from a7sim.training.submissions import Submission, find_submissions, grade_submissions

EXIT_PASSED, EXIT_NOT_PASSED = 0, 1


@click.command("grade")
@click.argument("exercise", required=False, shell_complete=exercise_argument)
@click.option(
    "--journal",
    "folders",
    type=click.Path(path_type=Path, file_okay=False, exists=True),
    metavar="DIR",
    multiple=True,
    help="Grade the attempts submitted in a folder or its subfolders; nothing is recorded. Repeatable.",
)
@options.seed("that of each submitted attempt")
@options.as_document
@student_options
def grade_(
    exercise: str | None,
    folders: tuple[Path, ...],
    seed: int | None,
    as_document: bool,
    home: Path | None,
    student: str | None,
) -> None:
    """Grade the last attempt by replaying its journal: points and reasons. The first grade ends an exam.

    Example: a7sim train grade 4
    """
    if folders:
        raise click.exceptions.Exit(
            _report_submissions(grade_submissions(find_submissions(folders), seed), as_document)
        )
    with progress_in(home) as progress:
        attempt = last_attempt(progress, student_name(student), exercise)
        exam_grade = progress.first_grade(attempt) if attempt.mode == EXAM else None
        try:
            grade = exam_grade or _grade_attempt(progress, attempt)
        except UnreliableJournalError as unreliable:
            click.echo(f"a7sim: {unreliable}", err=True)
            raise click.exceptions.Exit(EXIT_DIFFERS) from unreliable
        if exam_grade is None:
            progress.record_grade(attempt, grade)
    if as_document:
        click.echo(as_json(document_header("train verify") | msgspec.to_builtins(grade)), nl=False)
    else:
        click.echo("\n".join(grade_lines(grade)))
    raise click.exceptions.Exit(EXIT_PASSED if grade.passed else EXIT_NOT_PASSED)


def _report_submissions(submissions: list[Submission], as_document: bool) -> int:
    """Print the results of attempts that were handed in; return the exit code."""
    if as_document:
        documents = [msgspec.to_builtins(each) for each in submissions]
        click.echo(as_json(document_header("train verify") | {"handed_in": documents}), nl=False)
    for each in submissions:
        if each.grade is None:
            click.echo(f"a7sim: {each.error}", err=True)
        elif not as_document:
            click.echo(f"{each.folder}: {each.student}")
            click.echo("\n".join(grade_lines(each.grade)))
    if any(each.grade is None for each in submissions):
        return EXIT_DIFFERS
    return EXIT_PASSED if all(each.grade and each.grade.passed for each in submissions) else EXIT_NOT_PASSED


def _grade_attempt(progress: Progress, attempt: Attempt) -> Grade:
    return grade_folder(find_exercise(attempt.exercise), attempt.seed, attempt.folder, progress.hints_taken(attempt))


@click.command("watch")
@click.argument("exercise", required=False, shell_complete=exercise_argument)
@click.option(
    "--every",
    type=options.NumberType(min=0.1, max=3600.0),
    default=1.0,
    show_default=True,
    metavar="SECONDS",
    help="Interval between checks of the journal.",
)
@student_options
def watch_(exercise: str | None, every: float, home: Path | None, student: str | None) -> None:
    """Grade the present attempt again whenever its journal grows, until it passes or Ctrl-C. Not in an exam.

    Example: a7sim train watch 4
    """
    with progress_in(home) as progress:
        attempt = last_attempt(progress, student_name(student), exercise)
        if attempt.mode == EXAM:
            raise A7SimError(f"{attempt.exercise}: expected an attempt for practice, got an exam")
        last_sizes: tuple[int, ...] = ()
        while True:
            sizes = _sizes(attempt)
            if sizes != last_sizes:
                last_sizes = sizes
                grade = _grade_attempt(progress, attempt)
                click.clear()
                click.echo("\n".join(grade_lines(grade)))
                if grade.passed:
                    return
            time.sleep(every)


def _sizes(attempt: Attempt) -> tuple[int, ...]:
    paths = [attempt.folder / name for name in (JOURNAL, ANSWERS)]
    return tuple(path.stat().st_mtime_ns if path.exists() else 0 for path in paths)
