"""Time the grading of a class: two hundred students' journals on two cores, and one journal beside its bare replay.

Prints the seconds of the class (to be below 60 on two cores), and how much longer grading takes than replaying.
"""

import tempfile
import time
from pathlib import Path

from figures import Figure, Target, tell

from a7sim.journal.format import read_journal
from a7sim.training.attempts import run_attempt
from a7sim.training.catalogue import find_exercise
from a7sim.training.environment import replay_environment
from a7sim.training.exercise import PlayedRun
from a7sim.training.grading import grade_folder
from a7sim.training.submissions import grade_submissions
from a7sim.training.variation import attempt_seed

STUDENTS, CORES = 200, 2

DONE = (("4", PlayedRun(procedure="measure parallaxes", observer={"skill": "trained"})), ("14", None), ("1", None))
"""A long journal, one whose handouts are generated again, and a short one, in turn."""


def timed(does):
    start = time.perf_counter()
    does()
    return time.perf_counter() - start


def main():
    with tempfile.TemporaryDirectory() as place:
        folders, lines = [], 0
        for i in range(STUDENTS):
            name, played = DONE[i % len(DONE)]
            exercise_folder, student = find_exercise(name), f"student {i}"
            folder = Path(place) / str(i)
            run_attempt(
                exercise_folder,
                played or exercise_folder.exercise.reference,
                folder,
                attempt_seed(student, exercise_folder.name),
                student,
            )
            folders.append(folder)
            lines += len(read_journal(folder / "session.jsonl"))
        seconds = timed(lambda: grade_submissions(folders, workers=CORES))
        exercise_folder, seed, folder = find_exercise("4"), attempt_seed("student 0", "04-parallax"), folders[0]
        journal = folder / "session.jsonl"
        replaying = min(
            timed(lambda: replay_environment(exercise_folder, seed, read_journal(journal))) for _ in range(3)
        )
        grading = min(timed(lambda: grade_folder(exercise_folder, seed, folder)) for _ in range(3))
    print(f"{STUDENTS} journals, {lines} lines, {CORES} processes: {seconds:.1f} s")
    print(f"grading takes {grading / replaying:.2f} times as long as replaying")
    return [
        Figure(f"{STUDENTS} journals graded by {CORES} processes", seconds, "s", target=Target("below", 60)),
        Figure("a journal graded", grading, "s", "its bare replay", grading / replaying),
    ]


if __name__ == "__main__":
    tell(main)
