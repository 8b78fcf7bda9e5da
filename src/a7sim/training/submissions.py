"""Attempts handed in by a class as folders, graded on all cores."""

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import msgspec

from a7sim.errors import A7SimError
from a7sim.journal.session_files import JOURNAL
from a7sim.training.attempts import attempt_mode, written_hints
from a7sim.training.catalogue import find_exercise
from a7sim.training.grading import Grade, HintsTaken, grade_folder
from a7sim.training.variation import attempt_seed

MAX_SERIAL = 8
"""Number of attempts up to which one process grades them all."""


class Submission(msgspec.Struct, frozen=True):
    """Result of an attempt that was handed in: its grade, or the reason why it has none."""

    folder: str
    student: str = ""
    exercise: str = ""
    grade: Grade | None = None
    error: str = ""


def find_submissions(folders: Sequence[Path]) -> list[Path]:
    """Return the folders of attempts: the named ones, or those within them that contain a journal."""
    found: list[Path] = []
    for folder in folders:
        journal_folders = [] if (folder / JOURNAL).exists() else sorted(path.parent for path in folder.rglob(JOURNAL))
        found += journal_folders or [folder]
    return found


def grade_submissions(folders: Sequence[Path], seed: int | None = None, workers: int | None = None) -> list[Submission]:
    """Grade the attempts in folders, each by its journal alone, in their order.

    Their seeds are those of the students named in their journals, unless one is given.
    """
    grade = partial(grade_submission, seed=seed)
    workers = min(workers or os.cpu_count() or 1, len(folders))
    if workers < 2 or len(folders) <= MAX_SERIAL:
        return [grade(folder) for folder in folders]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        return list(pool.map(grade, folders, chunksize=max(1, len(folders) // (8 * workers))))


def grade_submission(folder: Path, seed: int | None = None) -> Submission:
    """Grade the attempt in a folder; an unreliable journal gets no grade."""
    try:
        exercise, student, mode = attempt_mode(folder)
    except A7SimError as error:
        return Submission(str(folder), error=str(error))
    try:
        used_seed = attempt_seed(student, exercise, mode) if seed is None else seed
        grade = grade_folder(find_exercise(exercise), used_seed, folder, HintsTaken(*written_hints(folder)))
    except A7SimError as error:
        return Submission(str(folder), student, exercise, error=str(error))
    return Submission(str(folder), student, exercise, grade)
