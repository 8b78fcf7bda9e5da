"""Going on with a session that was cut off, from what its folder holds."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from a7sim.instrument.language import Desk
from a7sim.mistakes import Mistake
from a7sim.scenario import Scenario
from a7sim.session.folder import JOURNAL
from a7sim.session.journal import Journal, software
from a7sim.session.lines import Journalled, read_journal
from a7sim.session.replaying import Difference, Replay, replayed, scenario_of_journal


@dataclass(frozen=True)
class Begun:
    """A session that was begun: what its journal holds, and the scenario and the seed that stand there."""

    journalled: Journalled
    scenario: Scenario
    seed: int

    def setting(self, name: str) -> Any:
        """Return what was asked for beside the scenario, None where nothing was said of it."""
        return self.journalled.header["settings"].get(name)


def begun_in(folder: Path, command: str) -> Begun:
    """Return the session that a command began in a folder. Raises Mistake where that cannot be gone on with."""
    journalled = read_journal(folder / JOURNAL)
    for name, expected in (("command", command), ("software", software())):
        got = journalled.header.get(name)
        if got != expected:
            raise Mistake(f"{journalled.where(1)}: expected a session of {expected} to go on with, got one of {got}")
    return Begun(journalled, *scenario_of_journal(journalled))


def served_again(begun: Begun, journal: Journal) -> tuple[Desk, float]:
    """Return the desk of a served instrument as its journal leaves it, its clients gone, and the time there in s.

    The journal goes on.

    Raises Mistake where what the journal holds does not happen again.
    """
    replay = Replay(begun.journalled)
    for number, _, difference in replayed(replay):
        if difference is not None:
            raise Mistake(f"{begun.journalled.where(number)}: {_not_again(difference)}")
    desk = replay.desk
    desk.listener = journal.continued(begun.journalled, desk, replay.checkpoints).heard
    for event in replay.unsaid():
        journal.heard(event)
    for client in [*desk.clients]:
        desk.close(client, replay.time)
    return desk, replay.time


def _not_again(difference: Difference) -> str:
    expected, got = difference.journalled or "nothing", difference.replayed or "nothing"
    return f"expected what the instrument does again, {got}, got another's, {expected}"
