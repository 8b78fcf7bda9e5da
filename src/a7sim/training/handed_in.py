"""Attempts that a class has handed in as folders, graded on all cores."""

import os
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import msgspec

from a7sim.mistakes import Mistake
from a7sim.session.folder import JOURNAL
from a7sim.training.attempts import mode_of, written_hints
from a7sim.training.grading import Grade, HintsTaken, graded
from a7sim.training.shelf import find_exercise
from a7sim.training.variation import seed_of

ALONE = 8
"""So many are graded before other processes could begin."""


class HandedIn(msgspec.Struct, frozen=True):
    """What came of an attempt that was handed in: its grade, or why it has none."""

    folder: str
    student: str = ""
    exercise: str = ""
    grade: Grade | None = None
    trouble: str = ""


def attempts_in(folders: Sequence[Path]) -> list[Path]:
    """Return the folders of attempts: those named, or where there is no journal those within them that have one."""
    found: list[Path] = []
    for folder in folders:
        within = [] if (folder / JOURNAL).exists() else sorted(path.parent for path in folder.rglob(JOURNAL))
        found += within or [folder]
    return found


def graded_folders(folders: Sequence[Path], seed: int | None = None, workers: int | None = None) -> list[HandedIn]:
    """Grade the attempts in folders, each by its journal alone, in their order.

    Their seeds are those of the students whom their journals name, unless one is given.
    """
    grade = partial(graded_folder, seed=seed)
    workers = min(workers or os.cpu_count() or 1, len(folders))
    if workers < 2 or len(folders) <= ALONE:
        return [grade(folder) for folder in folders]
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        return list(pool.map(grade, folders, chunksize=max(1, len(folders) // (8 * workers))))


def graded_folder(folder: Path, seed: int | None = None) -> HandedIn:
    """Grade the attempt in a folder; a journal that cannot be relied on gets no grade."""
    try:
        exercise, student, mode = mode_of(folder)
    except Mistake as mistake:
        return HandedIn(str(folder), trouble=str(mistake))
    try:
        drawn = seed_of(student, exercise, mode) if seed is None else seed
        grade = graded(find_exercise(exercise), drawn, folder, HintsTaken(*written_hints(folder)))
    except Mistake as mistake:
        return HandedIn(str(folder), student, exercise, trouble=str(mistake))
    return HandedIn(str(folder), student, exercise, grade)
