"""Attempts without files, for checks: common openings run once, and no journal is written."""

from dataclasses import dataclass, field

from a7sim.journal.scripts import Script
from a7sim.training.attempt_record import AttemptRecord
from a7sim.training.attempts import play_item, play_script, run_opening, seed_for
from a7sim.training.environment import AttemptEnvironment, dry_run_environment
from a7sim.training.exercise import ExerciseFolder, PlayedRun
from a7sim.training.grading import make_record


@dataclass(frozen=True)
class DryRuns:
    """Attempts at an exercise, each equal to the digit to an attempt with a journal."""

    exercise_folder: ExerciseFolder
    _opened: dict[int, AttemptEnvironment] = field(default_factory=dict)
    """Environments after the opening, by seed."""

    def open_environment(self, seed: int) -> AttemptEnvironment:
        """Return an environment after the opening. Raises A7SimError if the opening fails."""
        if seed not in self._opened:
            environment = dry_run_environment(self.exercise_folder, seed)
            run_opening(environment)
            self._opened[seed] = environment
        return self._opened[seed].snapshot()

    def run_attempt(self, played: PlayedRun) -> tuple[AttemptRecord, str]:
        """Run the exercise to its end; return the record, and the reason if it did not finish. Raises A7SimError."""
        environment = self.open_environment(seed_for(self.exercise_folder, played))
        error = play_item(environment, played)
        return make_record(environment), error

    def run_and_leave(self, seed: int, script: Script | None, minutes: float = 0.0) -> AttemptRecord:
        """Run a script, if any, and return the record after a number of minutes. Raises A7SimError."""
        environment = self.open_environment(seed)
        if script is not None:
            play_script(environment, script)
        environment.clock.advance(60.0 * minutes)
        environment.instrument.close(
            environment.instrument.open("late", time=environment.clock.now).client, environment.clock.now
        )
        return make_record(environment)
