"""`a7sim train hint`, `answer` and `reset`: actions of a student beside the instrument."""

from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.completers import exercise_argument
from a7sim.cli.train.options import last_attempt, progress_in, student_name, student_options
from a7sim.errors import A7SimError
from a7sim.result_documents import as_json, document_header
from a7sim.text import pluralize
from a7sim.training.attempt_record import parse_answers
from a7sim.training.attempts import write_answers, write_hint
from a7sim.training.catalogue import find_exercise


@click.command("hint")
@click.argument("exercise", required=False, shell_complete=exercise_argument)
@options.as_document
@student_options
def hint_(exercise: str | None, as_document: bool, home: Path | None, student: str | None) -> None:
    """Print the next hint of the present attempt; it costs points and is recorded.

    Example: a7sim train hint 4
    """
    with progress_in(home) as progress:
        attempt = last_attempt(progress, student_name(student), exercise)
        if attempt.closed:
            raise A7SimError(f"{attempt.exercise}: expected an attempt that is open, got one that is closed")
        number, hint = progress.next_hint(attempt, find_exercise(attempt.exercise).exercise)
        write_hint(attempt.folder, number, hint.cost)
    if as_document:
        document = {"exercise": attempt.exercise, "hint": number, "cost": hint.cost, "text": hint.text}
        click.echo(as_json(document_header("train hint") | document), nl=False)
    else:
        click.echo(f"hint {number} (-{pluralize(hint.cost, 'point')}): {hint.text}")


@click.command("answer")
@click.argument("answers", nargs=-1, required=True, metavar="KEY=VALUE...")
@click.option(
    "--exercise",
    metavar="EXERCISE",
    shell_complete=exercise_argument,
    help="Exercise of the answers  [default: the last one started]",
)
@options.as_document
@student_options
def answer_(
    answers: tuple[str, ...], exercise: str | None, as_document: bool, home: Path | None, student: str | None
) -> None:
    """Write answers beside the journal of the present attempt; a later answer replaces an earlier one.

    Example: a7sim train answer play=0.05
    """
    with progress_in(home) as progress:
        attempt = last_attempt(progress, student_name(student), exercise)
    if attempt.closed:
        raise A7SimError(f"{attempt.exercise}: expected an attempt that is open, got one that is closed")
    expected_answers = find_exercise(attempt.exercise).exercise.answers
    for word in answers:
        given = parse_answers([word])
        if not given or next(iter(given)) not in expected_answers:
            known = ", ".join(f"{key}=... ({about})" for key, about in expected_answers.items()) or "no answers"
            raise A7SimError(f"{attempt.exercise}: expected {known}, got {word!r}")
    written = write_answers(attempt.folder, parse_answers(answers))
    if as_document:
        document = {"exercise": attempt.exercise, "answers": dict(written)}
        click.echo(as_json(document_header("train answer") | document), nl=False)
    else:
        click.echo(", ".join(f"{key}={value}" for key, value in written.items()))


@click.command("reset")
@click.argument("exercise", shell_complete=exercise_argument)
@student_options
def reset_(exercise: str, home: Path | None, student: str | None) -> None:
    """Close the present attempt at EXERCISE; it is kept, and the next start is a new attempt.

    Example: a7sim train reset 4
    """
    with progress_in(home) as progress:
        exercise_folder = find_exercise(exercise)
        attempt = progress.open_attempt(student_name(student), exercise_folder.name)
        if attempt is None:
            click.echo(f"{exercise_folder.name}: no attempt is open")
            return
        progress.end(attempt)
        click.echo(f"{exercise_folder.name}: attempt {attempt.number} is closed and kept in {attempt.folder}")
