"""Header and footer: state of the instrument, and the keys that are available."""

from collections.abc import Iterable, Mapping

from rich.text import Text

from a7sim.console.keymap import Keymap, key_display
from a7sim.console.state.readouts import Readouts
from a7sim.console.state.selection import ControlSelection, element_label
from a7sim.link.client.client import Identity

WIDE_COLUMNS = 100
"""Columns from which the header is complete."""

Hints = tuple[tuple[str, str], ...]
"""Keys as in help, and their descriptions."""


def header_text(identity: Identity, dials: Readouts | None, job: str, seconds: float, width: int) -> str:
    """Return the header: instrument, pictures, job and time."""
    parts = [
        f"Wild {identity.model}  no. {identity.serial}",
        job,
        " | ".join(name or "-" for name in dials.pictures) if dials else "",
        f"base {dials.base}" if dials else "",
        format_elapsed(seconds),
    ]
    roomy = width >= WIDE_COLUMNS
    return ("    " if roomy else "  ").join(part for part in parts if part) + (" at the instrument" if roomy else "")


def format_elapsed(seconds: float) -> str:
    """Return a time as hours, minutes and seconds."""
    whole = int(seconds)
    return f"{whole // 3600}:{whole // 60 % 60:02d}:{whole % 60:02d}"


def key_labels(keymap: Keymap, plain: bool) -> Mapping[str, str]:
    """Return the first key of each action as in help."""
    return {name: key_display(keys[0], plain) for name, keys in keymap.items()}


def hints(
    keys: Mapping[str, str],
    selection: ControlSelection,
    magnification: float,
    point: str | None,
    pricked: bool,
    unstruck: bool,
) -> Hints:
    """Return the available keys: `pricked` with a sketch, `unstruck` with a valid reading."""
    arrows = keys["x_down"] + keys["x_up"] + keys["y_down"] + keys["y_up"]
    offered = (
        (True, keys["help"], "help"),
        (True, keys["bench"], "bench"),
        (True, arrows if len(arrows) == 4 else f"{keys['x_up']} {keys['y_up']} ...", "X Y"),
        (True, f"{keys['z_up']} {keys['z_down']}", "Z"),
        (True, f"{keys['turn_up']} {keys['turn_down']}", element_label(selection.element)),
        (True, f"{keys['finer']} {keys['coarser']}", f"step {selection.step:g}"),
        (pricked, keys["go_to"], "go to"),
        (pricked, keys["record"], f"record {point}" if point else "record"),
        (pricked, keys["magnify"], f"x{magnification:g}"),
        (unstruck, keys["strike"], "strike out"),
        (selection.free, keys["free_hand"], "back to the wheels"),
    )
    return tuple((key, word) for applies, key, word in offered if applies)


def hints_to_watch(keys: Mapping[str, str], magnification: float, playing: bool | None) -> Hints:
    """Return the available keys while watching; `playing` is None without a recording."""
    film = (
        (keys["play"], "pause" if playing else "play"),
        (f"{keys['step_back']} {keys['step_on']}", "step"),
        (f"{keys['last_record']} {keys['next_record']}", "registration"),
        (f"{keys['slower']} {keys['faster']}", "speed"),
        (keys["jump"], "jump"),
    )
    eyes = ((keys["magnify"], f"x{magnification:g}"), (keys["drawing"], "drawing"), (keys["quit"], "leave"))
    return ((keys["help"], "help"), *(film if playing is not None else ()), *eyes)


def hints_line(offered: Iterable[tuple[str, str]]) -> Text:
    """Return hints as a line."""
    return Text("  ", no_wrap=True).join(Text(key, "bold").append(f" {word}", "not bold") for key, word in offered)
