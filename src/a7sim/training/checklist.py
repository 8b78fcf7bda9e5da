"""Checklist of an attempt, ticked automatically by the events at the link."""

from dataclasses import dataclass
from pathlib import Path

from a7sim.training.attempts import ANSWERS, HINTS, written_answers
from a7sim.training.environment import AttemptEnvironment
from a7sim.training.exercise import Exercise
from a7sim.training.metrics import make_metric
from a7sim.training.progress import EXAM, Attempt

TICKED, OPEN = "[x]", "[ ]"

PAPERS = (".csv", ".txt", ".md")
"""Suffixes of handouts."""


@dataclass(frozen=True)
class Checklist:
    """Checklist of an attempt; in an exam it lists the tasks without ticks."""

    environment: AttemptEnvironment
    attempt: Attempt

    @property
    def exercise(self) -> Exercise:
        """The exercise."""
        return self.environment.exercise_folder.exercise

    def ticks(self) -> list[bool]:
        """Return which items are done."""
        record = self.environment.record(written_answers(self.attempt.folder))
        metrics = [make_metric(each) for each in self.exercise.steps]
        return [
            metric.meets(metric.evaluate(record).value, step.done)
            for metric, step in zip(metrics, self.exercise.steps, strict=True)
        ]

    def lines(self) -> list[str]:
        """Return goal and checklist as lines of text."""
        lines = [self.head(), *(f"your papers: {paper}" for paper in self.papers())]
        if self.attempt.mode == EXAM:
            return [*lines, *(f"  -  {each.text}" for each in self.exercise.steps)]
        ticked = zip(self.ticks(), self.exercise.steps, strict=True)
        return [*lines, *(f" {TICKED if done else OPEN} {step.text}" for done, step in ticked)]

    def papers(self) -> list[Path]:
        """Return the handouts in the attempt's folder."""
        files = sorted(self.attempt.folder.iterdir())
        return [path for path in files if path.suffix in PAPERS and path.name not in (ANSWERS, HINTS)]

    def head(self) -> str:
        """Return exercise and time as text."""
        exercise, minutes = self.exercise, self.environment.record().seconds / 60.0
        exam = ", exam" if self.attempt.mode == EXAM else ""
        overrun = ", the time is up" if minutes > exercise.minutes else ""
        return f"{exercise.number} {exercise.title}{exam}: {minutes:.0f} of {exercise.minutes:g} minutes{overrun}"
