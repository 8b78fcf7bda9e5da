"""Attempts of which nothing is kept, for checks: what begins alike is opened once, and no journal is written."""

from dataclasses import dataclass, field

from a7sim.session.scripts import Script
from a7sim.training.account import Account
from a7sim.training.attempts import done, open_, played_script, seed_played
from a7sim.training.exercise import Played, Shelved
from a7sim.training.grading import account_of
from a7sim.training.room import Room, rehearsal_room


@dataclass(frozen=True)
class Rehearsals:
    """Attempts at an exercise, each as if the student had sat down at it alone: to the digit what its journal gives."""

    shelved: Shelved
    _opened: dict[int, Room] = field(default_factory=dict)
    """Rooms in which the opening is done and nothing else, by seed."""

    def opened(self, seed: int) -> Room:
        """Return a room of its own in which the opening is done. Raises Mistake where it cannot be done."""
        if seed not in self._opened:
            room = rehearsal_room(self.shelved, seed)
            open_(room)
            self._opened[seed] = room
        return self._opened[seed].as_it_stands()

    def attempted(self, played: Played) -> tuple[Account, str]:
        """Do the exercise to its end; return the account, and what kept it from its end. Raises Mistake."""
        room = self.opened(seed_played(self.shelved, played))
        trouble = done(room, played)
        return account_of(room), trouble

    def left(self, seed: int, script: Script | None, minutes: float = 0.0) -> Account:
        """Play a script, if any, come again so many minutes later, and be gone. Raises Mistake."""
        room = self.opened(seed)
        if script is not None:
            played_script(room, script)
        room.clock.spend(60.0 * minutes)
        room.desk.close(room.desk.open("late", time=room.clock.now).client, room.clock.now)
        return account_of(room)
