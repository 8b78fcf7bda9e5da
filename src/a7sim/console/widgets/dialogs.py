"""Dialogs over the screen: a question, a choice, and help."""

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import BindingType
from textual.containers import Vertical, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Input, OptionList, Static
from textual.widgets.option_list import Option

from a7sim.console.keymap import Keymap, actions_for, key_display

_LEAVING: list[BindingType] = [("escape", "leave", "back")]


class Ask(ModalScreen[str | None]):
    """Question with an input line; escape cancels."""

    BINDINGS: ClassVar[list[BindingType]] = _LEAVING

    def __init__(self, question: str, answer: str = "", note: str = "") -> None:
        super().__init__()
        self._question, self._answer, self._note = question, answer, note

    def compose(self) -> ComposeResult:
        """Compose the question."""
        with Vertical(id="dialog") as dialog:
            dialog.border_title = self._question
            yield Input(self._answer, compact=True)
            yield Static(self._note or "Enter does it, Esc leaves it", classes="note", markup=False)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return the answer."""
        self.dismiss(event.value.strip() or None)

    def action_leave(self) -> None:
        """Cancel."""
        self.dismiss(None)


class Choose(ModalScreen[str | None]):
    """Choice of named items; escape cancels."""

    BINDINGS: ClassVar[list[BindingType]] = _LEAVING

    def __init__(self, question: str, choices: Sequence[tuple[str, str]], note: str = "") -> None:
        super().__init__()
        self._question, self._choices, self._note = question, choices, note

    def compose(self) -> ComposeResult:
        """Compose the choices: pairs of returned value and text."""
        with Vertical(id="dialog") as dialog:
            dialog.border_title = self._question
            if self._note:
                yield Static(self._note, classes="note", markup=False)
            yield OptionList(*(Option(Text(words), id=name) for name, words in self._choices))

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Return the chosen value."""
        self.dismiss(event.option.id)

    def action_leave(self) -> None:
        """Cancel."""
        self.dismiss(None)


class HelpPage(ModalScreen[None]):
    """Help: all keys, by group."""

    BINDINGS: ClassVar[list[BindingType]] = [*_LEAVING, ("q", "leave", "back"), ("question_mark", "leave", "back")]

    def __init__(self, keymap: Keymap, plain: bool, watching: bool, film: bool) -> None:
        super().__init__()
        self._text = help_text(keymap, plain, watching, film)

    def compose(self) -> ComposeResult:
        """Compose the page."""
        with VerticalScroll(id="dialog") as dialog:
            dialog.border_title = "help"
            yield Static(self._text, markup=False)

    def action_leave(self) -> None:
        """Close."""
        self.dismiss(None)


_HOW_TO = """\
Two eyes look at two photographs of the same ground. The dot in the
middle is the floating mark; the pictures move under it. Where a
projector is not oriented, the two images of a point differ in height:
that is y-parallax. Take up an element and turn it until they agree.

A BEGINNING
  l          lay both pictures, centre them, set c
  b s        bx, to the base of the model; d runs Z to its height
  g          drive near a point
  PgUp PgDn  until the images agree sideways
  y + -      by', until they agree in height
  Enter      record; x strikes a reading out

Every press of a key is one step; [ and ] change the step. 0.002 turns a
drum between two counts, as the eye wants it. With free hand X and Y
move without the handwheels and their collars. The mouse wheel turns any
drum. Ctrl+P lists everything by name, themes too; Ctrl+Q leaves.
"""


_HOW_TO_WATCH = """\
Playback: you see both eyepieces, the counters, the elements and the book
of the session. Moving the instrument is disabled; the view is your own.
"""


def help_text(keymap: Keymap, plain: bool, watching: bool = False, film: bool = True) -> str:
    """Return the help text."""
    lines = [_HOW_TO_WATCH if watching else _HOW_TO]
    actions = actions_for(watching, film)
    for group in dict.fromkeys(action.group for action in actions):
        lines.append(group.upper())
        for action in actions:
            if action.group == group:
                keys = " ".join(key_display(key, plain) for key in keymap[action.name])
                lines.append(f"  {keys:<10} {action.description}")
        lines.append("")
    return "\n".join(lines)
