"""Options shared by the training commands: student and folder of the progress."""

import getpass
import os
from pathlib import Path

import click

from a7sim.cli.options import FOLDER, combine_options
from a7sim.cli.prompt import data_folder
from a7sim.errors import A7SimError
from a7sim.training.catalogue import find_exercise
from a7sim.training.progress import Attempt, Progress

HOME_VARIABLE, STUDENT_VARIABLE = "A7SIM_HOME", "A7SIM_STUDENT"

MAX_NAME_LENGTH = 100

_HOME = click.option(
    "--home",
    type=FOLDER,
    metavar="DIR",
    envvar=HOME_VARIABLE,
    help=f"Folder of progress and journals; also {HOME_VARIABLE}  [default: the platform's data folder]",
)
_STUDENT = click.option(
    "--student",
    metavar="NAME",
    envvar=STUDENT_VARIABLE,
    help=f"Name of the student; also {STUDENT_VARIABLE}  [default: the user logged in]",
)

student_options = combine_options(_HOME, _STUDENT)
"""--home, --student."""


def progress_in(home: Path | None) -> Progress:
    """Open the progress in a folder. Raises A7SimError."""
    return Progress(home or data_folder() / "training")


def student_name(student: str | None) -> str:
    """Return the name of a student. Raises A7SimError for an invalid one."""
    if student is None:
        try:
            student = getpass.getuser()
        except (KeyError, OSError):
            student = os.environ.get("USERNAME", "student")
    name = " ".join(student.split())
    if not 1 <= len(name) <= MAX_NAME_LENGTH or not name.isprintable():
        raise A7SimError(f"--student: expected a name of 1 to {MAX_NAME_LENGTH} characters, got {student!r}")
    return name


def last_attempt(progress: Progress, student: str, exercise: str | None) -> Attempt:
    """Return a student's last attempt, at an exercise if one is named. Raises A7SimError if there is none."""
    return progress.last(student, find_exercise(exercise).name if exercise else None)
