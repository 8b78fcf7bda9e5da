"""Attempts from the opening to the end: by a script, by the virtual operator, or interactively."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.journal.format import read_journal
from a7sim.journal.script_runner import ScriptRunner
from a7sim.journal.scripts import Script, read_script
from a7sim.journal.session_files import JOURNAL, write_atomic
from a7sim.table_files import read_text
from a7sim.training.attempt_record import parse_answers
from a7sim.training.environment import AttemptEnvironment, open_environment, resume_environment
from a7sim.training.exercise import OPENING, ExerciseFolder, PlayedRun
from a7sim.training.handouts import make_handout
from a7sim.training.procedures import run_procedure
from a7sim.training.variation import scenario_for

ANSWERS = "answers.txt"
"""Answers written beside the journal, one KEY=VALUE per line."""

HINTS = "hints.txt"
"""Given hints, number and cost per line; the student's progress contains them, too."""

_HINT = re.compile(r"\d+ \d+(\.\d+)?")

STUDENT = "student"
"""Client name under which a script or the virtual operator acts as the student."""


@contextmanager
def start_attempt(
    exercise_folder: ExerciseFolder, seed: int, folder: Path, student: str, mode: str
) -> Iterator[AttemptEnvironment]:
    """Start an attempt in a folder: write its handouts and run its opening. Raises A7SimError."""
    folder.mkdir(parents=True, exist_ok=True)
    hand_out(exercise_folder, seed, folder)
    with open_environment(exercise_folder, seed, folder, student, mode) as environment:
        run_opening(environment)
        yield environment


@contextmanager
def resume_attempt(exercise_folder: ExerciseFolder, seed: int, folder: Path) -> Iterator[AttemptEnvironment]:
    """Resume an attempt. Raises A7SimError."""
    with resume_environment(exercise_folder, seed, folder) as environment:
        if not environment.action_log.opened:
            run_opening(environment)
        yield environment


def hand_out(exercise_folder: ExerciseFolder, seed: int, folder: Path) -> None:
    """Write the handouts of an exercise into a folder."""
    for name, text in make_papers(exercise_folder, seed).items():
        write_atomic(folder / name, text)


def make_papers(exercise_folder: ExerciseFolder, seed: int) -> Mapping[str, str]:
    """Return the handouts of an exercise by file name, empty if it has none."""
    exercise = exercise_folder.exercise
    if not exercise.handout:
        return {}
    return make_handout(exercise.handout, scenario_for(exercise_folder, seed), seed, exercise.handout_options).papers


def run_opening(environment: AttemptEnvironment) -> None:
    """Run the opening of an exercise. Raises A7SimError if it fails."""
    opening = environment.exercise_folder.exercise.opening
    if opening is not None:
        error = play_item(environment, opening, OPENING)
        if error:
            raise A7SimError(f"{environment.exercise_folder.name}: expected the opening to finish: {error}")


def play_item(environment: AttemptEnvironment, played: PlayedRun, client: str = STUDENT) -> str:
    """Run a script or a procedure; return the reason if it did not finish, otherwise an empty text."""
    if played.procedure:
        return run_procedure(environment, played, client, make_papers(environment.exercise_folder, environment.seed))
    return play_script(environment, read_script(environment.exercise_folder.folder / played.script), client)


def play_script(environment: AttemptEnvironment, script: Script, client: str = STUDENT) -> str:
    """Run a script at the instrument of an attempt; return the unmet expectation, otherwise an empty text."""
    unmet = ScriptRunner(script, instrument=environment.instrument, clock=environment.clock).run(client)
    if unmet is not None and client in environment.instrument.clients:
        environment.instrument.close(client, environment.clock.now)
    return str(unmet) if unmet is not None else ""


def seed_for(exercise_folder: ExerciseFolder, played: PlayedRun, default: int = 1) -> int:
    """Return the seed of a run: a script's own, or that of the exercise's reference."""
    if played.seed is not None:
        return played.seed
    if played.script:
        return read_script(exercise_folder.folder / played.script).seed
    reference = exercise_folder.exercise.reference
    return default if played is reference else seed_for(exercise_folder, reference)


def run_attempt(
    exercise_folder: ExerciseFolder, played: PlayedRun, folder: Path, seed: int, student: str = "student"
) -> str:
    """Run an exercise from its opening to its end in a folder; return the reason if it did not finish."""
    folder.mkdir(parents=True, exist_ok=True)
    hand_out(exercise_folder, seed, folder)
    with open_environment(exercise_folder, seed, folder, student, "practice", dict(played.observer)) as environment:
        run_opening(environment)
        return play_item(environment, played)


def write_answers(folder: Path, answers: dict[str, str]) -> dict[str, str]:
    """Add answers to the written ones; return all of them. Raises A7SimError if that fails."""
    all_answers = written_answers(folder) | answers
    write_atomic(folder / ANSWERS, "".join(f"{key}={value}\n" for key, value in all_answers.items()))
    return all_answers


def written_answers(folder: Path) -> dict[str, str]:
    """Return the answers written beside a journal."""
    path = folder / ANSWERS
    if not path.is_file():
        return {}
    answers: dict[str, str] = {}
    for line in read_text(path).splitlines():
        answers |= parse_answers([line])
    return answers


def write_hint(folder: Path, number: int, cost: float) -> None:
    """Record beside the journal that a hint was given, for grading the folder alone."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / HINTS).open("a", encoding="utf-8") as hints:
        hints.write(f"{number} {cost:g}\n")


def written_hints(folder: Path) -> tuple[int, float]:
    """Return the number of hints recorded beside a journal, and their cost."""
    path = folder / HINTS
    lines = read_text(path).splitlines() if path.is_file() else []
    costs = [float(line.split()[1]) for line in lines if _HINT.fullmatch(line)]
    return len(costs), sum(costs)


def attempt_mode(folder: Path) -> tuple[str, str, str]:
    """Return exercise, student and mode of the attempt in a folder, from its journal. Raises A7SimError."""
    settings = read_journal(folder / JOURNAL).header.get("settings", {})
    try:
        return settings["exercise"], settings["student"], settings["mode"]
    except (KeyError, TypeError):
        raise A7SimError(f"{folder}: expected the journal of an attempt at an exercise, got another journal") from None
