"""Base of all actions: the console they belong to, and readings that the user types in."""

import re
from collections.abc import Callable
from typing import cast

from a7sim.console.context import ConsoleContext
from a7sim.console.state.readouts import Readouts
from a7sim.console.state.selection import ControlSelection
from a7sim.console.widgets.dialogs import Ask
from a7sim.plotters import Variant

PROJECTORS = {1: "left", 2: "right"}

_READING = r"([XYZ])\s*=?\s*([-+]?[0-9]*\.?[0-9]+)"


class ActionBase:
    """Base class of the console's actions."""

    @property
    def _console(self) -> ConsoleContext:
        return cast("ConsoleContext", self)

    def _at(self) -> tuple[Variant, Readouts]:
        console = self._console
        assert console.met is not None and console.dials is not None
        return console.met.variant, console.dials

    def _hold(self, selection: ControlSelection) -> None:
        console = self._console
        console.selection = selection
        console.refresh_panels()

    def _ask_number(self, question: str, note: str, then: Callable[[float], None]) -> None:
        console = self._console

        def answered(answer: str | None) -> None:
            if answer is None:
                return
            try:
                then(float(answer))
            except ValueError:
                console.say(f"{question}: expected a number, got {answer!r}", refused=True)

        console.push_screen(Ask(question, note=note), answered)

    def _ask_axes(self, question: str, note: str, then: Callable[[list[tuple[str, str]]], None]) -> None:
        console = self._console

        def answered(answer: str | None) -> None:
            if answer is None:
                return
            found = re.findall(_READING, answer.upper())
            if not found or re.sub(_READING + r"[\s,;]*", "", answer.upper()).strip():
                console.say(f"{question}: expected readings {note}, got {answer!r}", refused=True)
            else:
                then(found)

        console.push_screen(Ask(question, note=note), answered)
