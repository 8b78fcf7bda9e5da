"""Keymap: the default keys, and the user's own in TOML."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from textual.keys import Keys

from a7sim.errors import A7SimError
from a7sim.table_files import read_toml

Keymap = Mapping[str, tuple[str, ...]]
"""Names of keys, by action."""

MODIFIERS = ("ctrl", "alt", "shift")


@dataclass(frozen=True, slots=True)
class Action:
    """Action of a key: its name, its default keys, its description, and its group in help."""

    name: str
    keys: tuple[str, ...]
    description: str
    group: str


PLAYBACK_ACTIONS = "watching"
"""Group of actions of playback only."""

VIEW_ACTIONS = ("eyes", "screen")
"""Groups of actions both at the instrument and while watching."""

ACTIONS = (
    Action("x_up", ("right",), "X handwheel, forward", "hands"),
    Action("x_down", ("left",), "X handwheel, back", "hands"),
    Action("y_up", ("up",), "Y handwheel, forward", "hands"),
    Action("y_down", ("down",), "Y handwheel, back", "hands"),
    Action("z_up", ("pageup",), "foot disc, mark up", "hands"),
    Action("z_down", ("pagedown",), "foot disc, mark down", "hands"),
    Action("turn_up", ("+", "="), "turn the element in hand, forward", "hands"),
    Action("turn_down", ("-",), "turn the element in hand, back", "hands"),
    Action("finer", ("[",), "a smaller step", "hands"),
    Action("coarser", ("]",), "a larger step", "hands"),
    Action("free_hand", ("h",), "free hand on and off", "hands"),
    Action("left_side", ("'",), "the left projector's element", "elements"),
    Action("right_side", ('"',), "the right projector's element", "elements"),
    Action("kappa", ("k",), "take up kappa", "elements"),
    Action("phi", ("f",), "take up phi", "elements"),
    Action("omega", ("w",), "take up omega", "elements"),
    Action("by", ("y",), "take up by", "elements"),
    Action("bz", ("z",), "take up bz", "elements"),
    Action("c", ("c",), "take up the principal distance", "elements"),
    Action("bx", ("b",), "take up bx", "elements"),
    Action("common_phi", ("p",), "take up the common phi", "elements"),
    Action("set", ("s",), "set the element in hand to a reading", "elements"),
    Action("drive", ("d",), "run X, Y or Z to a reading", "bench"),
    Action("go_to", ("g",), "drive near a point of the sketch", "bench"),
    Action("bench", ("l",), "pictures, base, fittings, gears", "bench"),
    Action("say", (":",), "say a line of the command language", "bench"),
    Action("play", ("space",), "play and pause", PLAYBACK_ACTIONS),
    Action("step_on", (".",), "on by a line that is said", PLAYBACK_ACTIONS),
    Action("step_back", (",",), "back by a line that is said", PLAYBACK_ACTIONS),
    Action("next_record", (">",), "on to the next registration", PLAYBACK_ACTIONS),
    Action("last_record", ("<",), "back to the registration before", PLAYBACK_ACTIONS),
    Action("faster", ("]",), "play faster", PLAYBACK_ACTIONS),
    Action("slower", ("[",), "play slower", PLAYBACK_ACTIONS),
    Action("jump", ("g",), "to a step, a time, or a note", PLAYBACK_ACTIONS),
    Action("magnify", ("m",), "magnify more", "eyes"),
    Action("reduce", ("M",), "magnify less", "eyes"),
    Action("eyes", ("e",), "both eyes, left, right", "eyes"),
    Action("merge", ("a",), "side by side, anaglyph, flicker", "eyes"),
    Action("drawing", ("v",), "half-blocks, shades, braille, words", "eyes"),
    Action("record", ("enter",), "record a reading", "book"),
    Action("record_as", ("r",), "record under another name", "book"),
    Action("strike", ("x", "backspace"), "strike the last reading out", "book"),
    Action("note", ("n",), "a remark into the journal", "book"),
    Action("panel", ("tab",), "the next panel at the right", "screen"),
    Action("help", ("?",), "help", "screen"),
    Action("quit", ("q",), "leave", "screen"),
)
"""All actions. The keys are the same for all plotters that have the part."""


def actions_for(watching: bool, film: bool = True) -> tuple[Action, ...]:
    """Return the actions at the instrument, or while watching a recording or a live instrument."""
    played = {PLAYBACK_ACTIONS} if film else set()
    return tuple(
        action
        for action in ACTIONS
        if action.group in VIEW_ACTIONS or (action.group in played if watching else action.group != PLAYBACK_ACTIONS)
    )


def default_keymap() -> Keymap:
    """Return the default keys."""
    return {action.name: action.keys for action in ACTIONS}


def sample() -> str:
    """Return a keymap file with the default keys."""
    lines = [
        "# Keys of a7sim console: one or more for each action; an action that is left out keeps its default keys.",
        "[keys]",
    ]
    width = max(len(action.name) for action in ACTIONS)
    for action in ACTIONS:
        keys = ", ".join(f"'{key}'" if '"' in key else f'"{key}"' for key in action.keys)
        lines.append(f"{action.name:<{width}} = [{keys}]  # {action.description}")
    return "\n".join(lines) + "\n"


def load_keymap(path: Path) -> Keymap:
    """Return the keymap of a file; actions that it does not name keep their keys. Raises A7SimError."""
    content = read_toml(path)
    unknown = sorted(set(content) - {"keys"})
    table = content.get("keys", {})
    if unknown or not isinstance(table, dict):
        raise A7SimError(
            f"{path}: expected one table [keys], got {', '.join(unknown) or 'something else of that name'}"
        )
    keymap = {**default_keymap(), **{name: _keys(path, name, given) for name, given in table.items()}}
    _refuse_shared(path, keymap)
    return keymap


def _keys(path: Path, name: str, given: object) -> tuple[str, ...]:
    if name not in default_keymap():
        raise A7SimError(f"{path}: keys.{name}: expected one of {', '.join(default_keymap())}")
    keys = [given] if isinstance(given, str) else given
    if not (isinstance(keys, list) and keys and all(isinstance(key, str) for key in keys)):
        raise A7SimError(f"{path}: keys.{name}: expected a key or a list of keys, got {given!r}")
    for key in keys:
        if not _is_key(key):
            raise A7SimError(f"{path}: keys.{name}: expected a key such as k, +, pageup, f5 or ctrl+k, got {key!r}")
    return tuple(keys)


def _is_key(key: str) -> bool:
    *modifiers, bare = key.split("+") if len(key) > 1 else [key]
    if any(modifier not in MODIFIERS for modifier in modifiers):
        return False
    return (len(bare) == 1 and bare.isprintable()) or bare in set(Keys) or bare == "space"


def _refuse_shared(path: Path, keymap: Keymap) -> None:
    for watching in (False, True):
        actions: dict[str, str] = {}
        for action in actions_for(watching):
            for key in keymap[action.name]:
                other = actions.setdefault(key, action.name)
                if other != action.name:
                    raise A7SimError(f"{path}: expected every key once, got {key!r} for both {other} and {action.name}")


def actions_by_key(keymap: Keymap, watching: bool = False) -> dict[str, str]:
    """Return the action of each key; while watching, also actions of the controls on free keys."""
    at_the_instrument, watched = (
        {key: action.name for action in actions_for(each) for key in keymap[action.name]} for each in (False, True)
    )
    return at_the_instrument | watched if watching else at_the_instrument


def key_name(key: str, character: str | None) -> str:
    """Return the keymap name of a key reported by the terminal."""
    return character if character and character.isprintable() and character != " " else key


_SHOWN = {
    "right": "→",
    "left": "←",
    "up": "↑",
    "down": "↓",
    "pageup": "PgUp",
    "pagedown": "PgDn",
    "enter": "Enter",
    "tab": "Tab",
    "backspace": "Bksp",
}


def key_display(key: str, plain: bool = False) -> str:
    """Return a key as in help; `plain` uses ASCII only."""
    written = _SHOWN.get(key, key)
    return key.capitalize() if plain and not written.isascii() else written
