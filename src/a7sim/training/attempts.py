"""An attempt from the opening to its end: by a script, by the virtual operator, or by whoever sits down."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from a7sim.errors import A7SimError
from a7sim.session.journal_format import read_journal
from a7sim.session.script_runner import ScriptRunner
from a7sim.session.scripts import Script, read_script
from a7sim.session.session_files import JOURNAL, write_atomic
from a7sim.table_files import read_text
from a7sim.training.attempt_record import parse_answers
from a7sim.training.environment import AttemptEnvironment, open_environment, resume_environment
from a7sim.training.exercise import OPENING, ExerciseFolder, PlayedRun
from a7sim.training.handouts import make_handout
from a7sim.training.procedures import run_procedure
from a7sim.training.variation import scenario_for

ANSWERS = "answers.txt"
"""Answers that were written down beside the journal, a KEY=VALUE a line."""

HINTS = "hints.txt"
"""Hints that were given, their number and what they cost, a line each; the student's progress has them too."""

_HINT = re.compile(r"\d+ \d+(\.\d+)?")

STUDENT = "student"
"""The client as which a script or the virtual operator plays the student."""


@contextmanager
def start_attempt(
    shelved: ExerciseFolder, seed: int, folder: Path, student: str, mode: str
) -> Iterator[AttemptEnvironment]:
    """Begin an attempt in a folder: its papers are handed out and its opening is done. Raises Mistake."""
    folder.mkdir(parents=True, exist_ok=True)
    hand_out(shelved, seed, folder)
    with open_environment(shelved, seed, folder, student, mode) as room:
        run_opening(room)
        yield room


@contextmanager
def resume_attempt(shelved: ExerciseFolder, seed: int, folder: Path) -> Iterator[AttemptEnvironment]:
    """Go on with an attempt that was left, or cut off. Raises Mistake."""
    with resume_environment(shelved, seed, folder) as room:
        if not room.action_log.opened:
            run_opening(room)
        yield room


def hand_out(shelved: ExerciseFolder, seed: int, folder: Path) -> None:
    """Put the papers of an exercise into a folder."""
    for name, text in make_papers(shelved, seed).items():
        write_atomic(folder / name, text)


def make_papers(shelved: ExerciseFolder, seed: int) -> Mapping[str, str]:
    """Return the papers of an exercise by file name, none where it has none."""
    exercise = shelved.exercise
    if not exercise.handout:
        return {}
    return make_handout(exercise.handout, scenario_for(shelved, seed), seed, exercise.handout_options).papers


def run_opening(room: AttemptEnvironment) -> None:
    """Do the opening of an exercise. Raises Mistake where it cannot be done."""
    opening = room.shelved.exercise.opening
    if opening is not None:
        trouble = play_item(room, opening, OPENING)
        if trouble:
            raise A7SimError(f"{room.shelved.name}: the opening cannot be done: {trouble}")


def play_item(room: AttemptEnvironment, played: PlayedRun, client: str = STUDENT) -> str:
    """Let a script or a procedure be played; return what kept it from its end, empty where nothing did."""
    if played.procedure:
        return run_procedure(room, played, client, make_papers(room.shelved, room.seed))
    return play_script(room, read_script(room.shelved.folder / played.script), client)


def play_script(room: AttemptEnvironment, script: Script, client: str = STUDENT) -> str:
    """Play a script at the instrument of an attempt; return what it expected in vain, empty where nothing."""
    not_met = ScriptRunner(script, desk=room.desk, clock=room.clock).run(client)
    if not_met is not None and client in room.desk.clients:
        room.desk.close(client, room.clock.now)
    return str(not_met) if not_met is not None else ""


def seed_for(shelved: ExerciseFolder, played: PlayedRun, otherwise: int = 1) -> int:
    """Return the seed with which something is played: a script's own, or that of the exercise's reference."""
    if played.seed is not None:
        return played.seed
    if played.script:
        return read_script(shelved.folder / played.script).seed
    reference = shelved.exercise.reference
    return otherwise if played is reference else seed_for(shelved, reference)


def run_attempt(shelved: ExerciseFolder, played: PlayedRun, folder: Path, seed: int, student: str = "somebody") -> str:
    """Do an exercise from its opening to its end in a folder; return what kept it from its end."""
    folder.mkdir(parents=True, exist_ok=True)
    hand_out(shelved, seed, folder)
    with open_environment(shelved, seed, folder, student, "practice", dict(played.observer)) as room:
        run_opening(room)
        return play_item(room, played)


def write_answers(folder: Path, answers: dict[str, str]) -> dict[str, str]:
    """Add answers to those that were written down; return all of them. Raises Mistake where that fails."""
    known = written_answers(folder) | answers
    write_atomic(folder / ANSWERS, "".join(f"{key}={value}\n" for key, value in known.items()))
    return known


def written_answers(folder: Path) -> dict[str, str]:
    """Return the answers that were written down beside a journal."""
    path = folder / ANSWERS
    if not path.is_file():
        return {}
    answers: dict[str, str] = {}
    for line in read_text(path).splitlines():
        answers |= parse_answers([line])
    return answers


def write_hint(folder: Path, number: int, cost: float) -> None:
    """Note beside the journal that a hint was given, for whoever grades the folder alone."""
    folder.mkdir(parents=True, exist_ok=True)
    with (folder / HINTS).open("a", encoding="utf-8") as hints:
        hints.write(f"{number} {cost:g}\n")


def written_hints(folder: Path) -> tuple[int, float]:
    """Return how many hints are noted beside a journal, and what they cost."""
    path = folder / HINTS
    lines = read_text(path).splitlines() if path.is_file() else []
    costs = [float(line.split()[1]) for line in lines if _HINT.fullmatch(line)]
    return len(costs), sum(costs)


def attempt_mode(folder: Path) -> tuple[str, str, str]:
    """Return exercise, student and mode of the attempt in a folder, as its journal names them. Raises Mistake."""
    settings = read_journal(folder / JOURNAL).header.get("settings", {})
    try:
        return settings["exercise"], settings["student"], settings["mode"]
    except (KeyError, TypeError):
        raise A7SimError(f"{folder}: expected the journal of an attempt at an exercise, got another") from None
