"""`a7sim train start`: start an exercise in the console, by a script, or as a server."""

import re
from contextlib import AbstractContextManager
from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.completers import exercise_argument
from a7sim.cli.renamed import command_with_renamed_options
from a7sim.cli.serve import DEFAULT_ADDRESS, ServedInstrument, StartupMessages, serve
from a7sim.cli.train.open_console import open_console
from a7sim.cli.train.options import progress_in, student_name, student_options
from a7sim.errors import A7SimError
from a7sim.journal.scripts import read_script
from a7sim.journal.session_files import JOURNAL
from a7sim.journal.writer import Journal
from a7sim.link.server.addresses import Address, parse_address
from a7sim.link.server.client_session import ServerLimits
from a7sim.link.server.event_loop import run
from a7sim.link.server.serving import Endpoints
from a7sim.result_documents import document_header
from a7sim.training.attempts import play_script, resume_attempt, start_attempt
from a7sim.training.catalogue import find_exercise
from a7sim.training.checklist import Checklist
from a7sim.training.environment import AttemptEnvironment
from a7sim.training.exercise import ExerciseFolder
from a7sim.training.progress import EXAM, PRACTICE, Attempt, Progress

EXAMINATION = "exam"
"""Default exercise of an exam: a part of the name of its folder."""


@click.command("start", cls=command_with_renamed_options({"--anew": "--new"}))
@click.argument("exercise", required=False, shell_complete=exercise_argument)
@click.option(
    "--exam",
    is_flag=True,
    help="No hints and no ticks, one grading, another seed. Without EXERCISE, the examination.",
)
@click.option("--new", is_flag=True, help="Start a new attempt; a present one is closed and kept.")
@options.seed("your own")
@click.option("--script", type=options.FILE, help="Run a script (.a7s).")
@click.option("--link", metavar="tcp://HOST:PORT", help="Serve it at this address instead of opening the console.")
@click.option("--serve", "serves", is_flag=True, help=f"Serve it at tcp://{DEFAULT_ADDRESS}.")
@options.plain
@student_options
def start_(
    exercise: str | None,
    exam: bool,
    new: bool,
    seed: int | None,
    script: Path | None,
    link: str | None,
    serves: bool,
    plain: bool,
    home: Path | None,
    student: str | None,
) -> None:
    """Start EXERCISE, or resume the present attempt: its goal, an automatic checklist, the console.

    Example: a7sim train start 4
    """
    if exercise is None and not exam:
        raise A7SimError(
            "train start: expected EXERCISE, such as 4 (a7sim train list), or --exam for the examination, got none"
        )
    if sum((script is not None, link is not None, serves)) > 1:
        raise A7SimError("train start: expected one of --script, --link and --serve, got several")
    address = _address(link) if link is not None else DEFAULT_ADDRESS if serves else None
    statements = read_script(script) if script is not None else None
    exercise_folder = find_exercise(exercise or EXAMINATION)
    with progress_in(home) as progress:
        attempt = _attempt(progress, exercise_folder, student_name(student), EXAM if exam else PRACTICE, new, seed)
    with _environment(exercise_folder, attempt) as environment:
        checklist = Checklist(environment, attempt)
        if exercise_folder.exercise.paper and statements is None:
            _print_paper_exercise(checklist)
        elif statements is not None:
            error = play_script(environment, statements)
            click.echo("\n".join(checklist.lines()))
            if error:
                raise A7SimError(error)
        elif address is not None:
            click.echo("\n".join(checklist.lines()))
            _serve(environment, address)
        else:
            open_console(environment, checklist, plain)
    click.echo(f"a7sim train grade {exercise_folder.exercise.number} grades the attempt; a7sim train start resumes it")


def _attempt(
    progress: Progress, exercise_folder: ExerciseFolder, student: str, mode: str, new: bool, seed: int | None
) -> Attempt:
    open_attempt = progress.open_attempt(student, exercise_folder.name)
    if open_attempt is not None and not new:
        if open_attempt.mode == mode and seed in (None, open_attempt.seed):
            return open_attempt
        if open_attempt.mode == EXAM:
            raise A7SimError(
                f"{exercise_folder.name}: expected --exam, because an exam is open (grade ends it, --new closes it)"
            )
    return progress.begin(student, exercise_folder, mode, seed)


def _environment(exercise_folder: ExerciseFolder, attempt: Attempt) -> AbstractContextManager[AttemptEnvironment]:
    journal = attempt.folder / JOURNAL
    if journal.exists() and b"\n" in journal.read_bytes():
        return resume_attempt(exercise_folder, attempt.seed, attempt.folder)
    return start_attempt(exercise_folder, attempt.seed, attempt.folder, attempt.student, attempt.mode)


def _address(text: str) -> Address:
    url = re.fullmatch("tcp:(//)?(?P<address>.+)", text)
    if not url:
        raise A7SimError(f"--link: expected tcp://HOST:PORT, got {text!r}")
    parsed = parse_address(url["address"], "--link")
    if not parsed.loopback:
        raise A7SimError(f"--link {text}: expected an address of this machine alone")
    return parsed


def _print_paper_exercise(checklist: Checklist) -> None:
    click.echo("\n".join([*checklist.lines(), "", checklist.environment.exercise_folder.text.strip(), ""]))
    for key, about in checklist.exercise.answers.items():
        click.echo(f"a7sim train answer {key}=...   {about}")


def _serve(environment: AttemptEnvironment, address: Address) -> None:
    head = document_header("train start") | {
        "scenario": environment.exercise_folder.exercise.title,
        "variant": environment.scenario.instrument.variant,
    }
    instrument = ServedInstrument(head, environment.instrument, environment.clock, Journal())
    run(serve(instrument, Endpoints([address]), ServerLimits(), StartupMessages(head, as_document=False, quiet=False)))
