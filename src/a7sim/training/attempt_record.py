"""Record of an attempt: its actions and readings with the truth. All grades follow from it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

from a7sim.operator import ModelJob
from a7sim.scenario import Scenario
from a7sim.scene import Scene
from a7sim.session.lifecycle import make_job
from a7sim.training.action_log import ActionLog, LoggedAutograph, Reading, StudentAction
from a7sim.training.exercise import OPENING, Exercise

ANSWER = "answer "
"""Start of a note with an answer at the instrument: NOTE "answer play=0.05"."""


@dataclass(frozen=True)
class AttemptRecord:
    """Record of an attempt."""

    exercise: Exercise
    scenario: Scenario
    scene: Scene
    autograph: LoggedAutograph
    """State at the end of the attempt."""
    action_log: ActionLog
    written_answers: Mapping[str, str] = field(default_factory=dict)
    """Answers written beside the journal."""
    hidden: Mapping[str, Any] = field(default_factory=dict)
    """Values known to the maker of the handout and not handed out."""

    @property
    def actions(self) -> Sequence[StudentAction]:
        """Actions of the student."""
        return [each for each in self.action_log.actions if each.client != OPENING]

    @property
    def readings(self) -> Sequence[Reading]:
        """Registrations of the student that were not struck out."""
        return [each for each in self.action_log.readings if each.client != OPENING and not each.struck]

    @property
    def seconds(self) -> float:
        """Simulated s since the start of the student's work."""
        return max(0.0, self.action_log.now - self.action_log.start_time)

    @cached_property
    def model(self) -> ModelJob:
        """Model of the exercise, as on the job sheet."""
        models = make_job(self.scenario, self.scene).models
        return next(each for each in models if each.name == self.exercise.model)

    @property
    def answers(self) -> dict[str, str]:
        """Answers in notes at the instrument or beside the journal; the latest one counts."""
        noted: dict[str, str] = {}
        for action in self.actions:
            if action.kind == "note" and action.text.lower().startswith(ANSWER):
                noted |= parse_answers(action.text[len(ANSWER) :].split())
        return noted | dict(self.written_answers)

    def name_of(self, point: str) -> str:
        """Return the name of a point given by its position in the model, such as 1, or by its name."""
        return self.model.standard_points.get(point, point)


def parse_answers(words: Sequence[str]) -> dict[str, str]:
    """Return the answers in words such as play=0.05; other words are ignored."""
    pairs = (word.partition("=") for word in words)
    return {key.strip().lower(): value.strip() for key, equals, value in pairs if equals and key.strip()}
