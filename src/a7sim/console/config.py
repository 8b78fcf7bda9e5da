"""Configuration of a console: instrument, job sheet, keys, and limits of the terminal."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from a7sim.console.actions.preset_recovery import LoggedLine
from a7sim.console.drawing.descriptions import ACUITY_UM
from a7sim.console.drawing.job_sheet import JobSheet
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.console.keymap import Keymap, default_keymap
from a7sim.link.client.client import Client

if TYPE_CHECKING:
    from a7sim.journal.recording import Recording


@dataclass(frozen=True)
class ResumeOffer:
    """Offer to resume an earlier session: its description, and the callback with the decision."""

    about: str
    decide: Callable[[bool], None]


@dataclass(frozen=True)
class ConsoleConfig:
    """Configuration of a console."""

    connect: Callable[[], Client]
    time: Callable[[], float]
    """Returns the seconds at the instrument since the start."""
    alone: bool = True
    """Whether no other client can move this instrument."""
    where: str = ""
    """Scenario or address, for error messages."""
    sheet: JobSheet = field(default_factory=JobSheet)
    keymap: Keymap = field(default_factory=default_keymap)
    drawing: DrawingMode | None = None
    """Drawing mode; None for the best of the terminal."""
    acuity_um: float = ACUITY_UM
    theme: str = "enamel"
    tasks: Callable[[], Sequence[str]] | None = None
    """Returns the tasks, one per line, queried every second; None without tasks."""
    exercise_goal: str = ""
    """Goal of the exercise, shown over the eyepieces until the first key."""
    welcome: bool = False
    """Whether to show the introduction for a first-time user."""
    resumable: Callable[[], ResumeOffer | None] = lambda: None
    """Returns a session to resume, called once the screen is shown."""
    greeting: Callable[[], str] = lambda: ""
    """Returns the message when the instrument first answers."""
    history: Callable[[], Iterable[LoggedLine]] = tuple
    """Returns the lines of the resumed session."""
    watching: bool = False
    """Whether this console only shows an instrument that another client moves."""
    recording: "Recording | None" = None
    """Recording to be watched, if any."""


def speaks_utf8(environment: Mapping[str, str] = os.environ) -> bool:
    """Return whether a terminal shows more than ASCII, by its locale; without a locale it is assumed."""
    named = next((environment[name] for name in ("LC_ALL", "LC_CTYPE", "LANG") if environment.get(name)), "utf-8")
    return "utf" in named.lower()


def best_drawing(utf8: bool, no_color: bool, colour_system: str | None) -> DrawingMode:
    """Return the best drawing mode for a terminal: ASCII without UTF-8, shades with 16 colours or none."""
    if not utf8:
        return DrawingMode.ASCII
    if no_color or colour_system in (None, "standard", "windows"):
        return DrawingMode.SHADES
    return DrawingMode.HALVES
