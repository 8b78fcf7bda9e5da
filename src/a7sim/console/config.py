"""What the console is given when somebody sits down: the instrument, the sheet, the keys, and the terminal's limits."""

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
    """A session that was left or cut off: what it is, and what is called with whether to go on with it."""

    about: str
    decide: Callable[[bool], None]


@dataclass(frozen=True)
class ConsoleConfig:
    """Everything that a console is made of."""

    connect: Callable[[], Client]
    time: Callable[[], float]
    """Seconds at the instrument since somebody sat down."""
    alone: bool = True
    """Whether nobody else can turn at this instrument."""
    where: str = ""
    """The scenario or the address, as errors name it."""
    sheet: JobSheet = field(default_factory=JobSheet)
    keymap: Keymap = field(default_factory=default_keymap)
    drawing: DrawingMode | None = None
    """How pictures are drawn; None for the best that the terminal can."""
    acuity_um: float = ACUITY_UM
    theme: str = "enamel"
    tasks: Callable[[], Sequence[str]] | None = None
    """What there is to do, a line each, asked again every second; None where nobody has set any tasks."""
    exercise_goal: str = ""
    """What is to be reached, told over the eyepieces until the first key."""
    welcome: bool = False
    """Whether to tell a first-time visitor what there is."""
    resumable: Callable[[], ResumeOffer | None] = lambda: None
    """Looks for a session to go on with, once the screen is there."""
    greeting: Callable[[], str] = lambda: ""
    """What is to be said when the instrument first answers."""
    history: Callable[[], Iterable[LoggedLine]] = tuple
    """What was said in the session that is gone on with."""
    watching: bool = False
    """Whether somebody else turns and this console only shows it."""
    recording: "Recording | None" = None
    """The session that is watched, where it is over."""


def speaks_utf8(environment: Mapping[str, str] = os.environ) -> bool:
    """Whether a terminal shows more than ASCII, as the locale tells it; where none is named it is taken to."""
    named = next((environment[name] for name in ("LC_ALL", "LC_CTYPE", "LANG") if environment.get(name)), "utf-8")
    return "utf" in named.lower()


def best_drawing(utf8: bool, no_color: bool, colour_system: str | None) -> DrawingMode:
    """Return the best drawing for a terminal: without UTF-8 in ASCII, with 16 colours or none in shades."""
    if not utf8:
        return DrawingMode.ASCII
    if no_color or colour_system in (None, "standard", "windows"):
        return DrawingMode.SHADES
    return DrawingMode.HALVES
