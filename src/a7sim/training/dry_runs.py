"""Attempts of which nothing is kept, for checks: what begins alike is opened once, and no journal is written."""

from dataclasses import dataclass, field

from a7sim.journal.scripts import Script
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.attempts import play_item, play_script, run_opening, seed_for
from a7sim.training.environment import AttemptEnvironment, dry_run_environment
from a7sim.training.exercise import ExerciseFolder, PlayedRun
from a7sim.training.grading import make_record


@dataclass(frozen=True)
class DryRuns:
    """Attempts at an exercise, each as if the student had sat down at it alone: to the digit what its journal gives."""

    exercise_folder: ExerciseFolder
    _opened: dict[int, AttemptEnvironment] = field(default_factory=dict)
    """Rooms in which the opening is done and nothing else, by seed."""

    def open_environment(self, seed: int) -> AttemptEnvironment:
        """Return a room of its own in which the opening is done. Raises Mistake where it cannot be done."""
        if seed not in self._opened:
            environment = dry_run_environment(self.exercise_folder, seed)
            run_opening(environment)
            self._opened[seed] = environment
        return self._opened[seed].snapshot()

    def run_attempt(self, played: PlayedRun) -> tuple[AttemptRecord, str]:
        """Do the exercise to its end; return the account, and what kept it from its end. Raises Mistake."""
        environment = self.open_environment(seed_for(self.exercise_folder, played))
        error = play_item(environment, played)
        return make_record(environment), error

    def run_and_leave(self, seed: int, script: Script | None, minutes: float = 0.0) -> AttemptRecord:
        """Play a script, if any, come again so many minutes later, and be gone. Raises Mistake."""
        environment = self.open_environment(seed)
        if script is not None:
            play_script(environment, script)
        environment.clock.advance(60.0 * minutes)
        environment.instrument.close(
            environment.instrument.open("late", time=environment.clock.now).client, environment.clock.now
        )
        return make_record(environment)
