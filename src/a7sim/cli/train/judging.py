"""`a7sim train verify` and `watch`: grades."""

import time
from pathlib import Path

import click
import msgspec

from a7sim.cli import EXIT_DIFFERS
from a7sim.cli.train.options import last_attempt, named, of_a_student, progress_in
from a7sim.documents import as_json, head
from a7sim.mistakes import Mistake
from a7sim.session.folder import JOURNAL
from a7sim.training.attempts import ANSWERS, mode_of
from a7sim.training.grading import Grade, as_sentences, graded
from a7sim.training.progress import EXAM, Attempt, Progress
from a7sim.training.room import Unreliable
from a7sim.training.shelf import find_exercise
from a7sim.training.variation import seed_of

EXIT_PASSED, EXIT_NOT_PASSED = 0, 1


@click.command("verify")
@click.argument("exercise", required=False)
@click.option(
    "--journal",
    "folders",
    type=click.Path(path_type=Path, file_okay=False),
    multiple=True,
    help="Grade the attempt in a folder that somebody handed in; nothing is recorded. May be given several times.",
)
@click.option("--seed", type=click.IntRange(min=0), help="Of attempts handed in that were started with a --seed.")
@click.option("--json", "as_document", is_flag=True, help="Print the grade as one JSON document.")
@of_a_student
def verify_(
    exercise: str | None,
    folders: tuple[Path, ...],
    seed: int | None,
    as_document: bool,
    home: Path | None,
    student: str | None,
) -> None:
    """Grade the last attempt: its journal is worked again. Points and reasons; an exam is over with it.

    Example: a7sim train verify 4
    """
    try:
        if folders:
            grades = [_handed_in(folder, seed) for folder in folders]
        else:
            with progress_in(home) as progress:
                attempt = last_attempt(progress, named(student), exercise)
                grades = [_graded(progress, attempt)]
                progress.give(attempt, grades[0])
    except Unreliable as unreliable:
        click.echo(f"a7sim: {unreliable}", err=True)
        raise click.exceptions.Exit(EXIT_DIFFERS) from unreliable
    if as_document:
        documents = [msgspec.to_builtins(each) for each in grades]
        click.echo(as_json(head("train verify") | ({"grades": documents} if folders else documents[0])), nl=False)
    else:
        for grade in grades:
            click.echo("\n".join(as_sentences(grade)))
    raise click.exceptions.Exit(EXIT_PASSED if all(each.passed for each in grades) else EXIT_NOT_PASSED)


def _graded(progress: Progress, attempt: Attempt) -> Grade:
    return graded(find_exercise(attempt.exercise), attempt.seed, attempt.folder, progress.hints_taken(attempt))


def _handed_in(folder: Path, seed: int | None) -> Grade:
    exercise, student, mode = mode_of(folder)
    return graded(find_exercise(exercise), seed_of(student, exercise, mode) if seed is None else seed, folder)


@click.command("watch")
@click.argument("exercise", required=False)
@click.option("--every", type=click.FloatRange(min=0.1, max=3600.0), default=1.0, show_default=True, metavar="SECONDS")
@of_a_student
def watch_(exercise: str | None, every: float, home: Path | None, student: str | None) -> None:
    """Grade the attempt under way again whenever its journal has grown, until it passes or Ctrl-C. Not in an exam.

    Example: a7sim train watch 4
    """
    with progress_in(home) as progress:
        attempt = last_attempt(progress, named(student), exercise)
        if attempt.mode == EXAM:
            raise Mistake(f"{attempt.exercise}: expected an attempt for practice, got an exam")
        seen: tuple[int, ...] = ()
        while True:
            now = _sizes(attempt)
            if now != seen:
                seen = now
                grade = _graded(progress, attempt)
                click.clear()
                click.echo("\n".join(as_sentences(grade)))
                if grade.passed:
                    return
            time.sleep(every)


def _sizes(attempt: Attempt) -> tuple[int, ...]:
    paths = [attempt.folder / name for name in (JOURNAL, ANSWERS)]
    return tuple(path.stat().st_mtime_ns if path.exists() else 0 for path in paths)
