"""Console of an exercise's instrument with its checklist."""

import sys
import time
from collections.abc import Iterator
from textwrap import fill

from a7sim.cli.console import KEYMAP
from a7sim.cli.prompt import data_folder
from a7sim.errors import A7SimError
from a7sim.journal.format import Event, read_journal
from a7sim.journal.session_files import JOURNAL
from a7sim.link.client.client import Client
from a7sim.link.client.ports import TIMEOUT_S
from a7sim.link.inprocess import InProcessSerial
from a7sim.training.checklist import Checklist
from a7sim.training.environment import AttemptEnvironment
from a7sim.training.exercise import OPENING

GOAL_WIDTH = 64
"""Columns, so that it fits all terminals."""


def open_console(environment: AttemptEnvironment, checklist: Checklist, plain: bool) -> None:
    """Open the console in the environment of an attempt until the student quits. Raises A7SimError without a terminal.

    The simulated clock runs with the wall clock while the console is open.
    """
    try:
        from a7sim.console.app import Console
    except ImportError as error:
        raise A7SimError("start: expected textual to be installed: pip install 'a7sim[console]'") from error
    from a7sim.console.actions.preset_recovery import LoggedLine
    from a7sim.console.config import ConsoleConfig
    from a7sim.console.drawing.job_sheet import JobSheet
    from a7sim.console.drawing.rasterize import DrawingMode
    from a7sim.console.keymap import default_keymap, load_keymap

    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        raise A7SimError("start: expected a terminal, got a file or a pipe (--script and --link need none)")
    began, clock, start_time = time.monotonic(), environment.clock, environment.clock.now

    def advance_clock() -> float:
        clock.advance_to(start_time + time.monotonic() - began)
        return clock.now

    own_keys = data_folder() / KEYMAP
    title = f"exercise {checklist.exercise.number}"
    Console(
        ConsoleConfig(
            lambda: Client(InProcessSerial(instrument=environment.instrument, clock=clock, timeout=TIMEOUT_S)),
            advance_clock,
            where=title,
            sheet=JobSheet(title, environment.scenario.camera),
            keymap=load_keymap(own_keys) if own_keys.exists() else default_keymap(),
            drawing=DrawingMode.WORDS if plain else None,
            theme="contrast" if plain else "enamel",
            tasks=checklist.lines,
            exercise_goal=fill(" ".join(checklist.exercise.goal.split()), GOAL_WIDTH),
            history=lambda: [LoggedLine(each.text, each.dir == "<") for each in _history(checklist)],
        )
    ).run()


def _history(checklist: Checklist) -> Iterator[Event]:
    """Yield the lines and replies of an attempt so far, without its opening."""
    journal = read_journal(checklist.attempt.folder / JOURNAL)
    for number in range(2, len(journal) + 1):
        event = journal.event(number)
        if event.dir in ("<", ">") and event.client != OPENING:
            yield event
