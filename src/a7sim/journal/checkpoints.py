"""Checkpoints: states of an instrument by which a journal is verified and searched.

States contain truth about the instrument that cannot be observed at it; they are in a separate file beside the journal,
which contains their hashes.
"""

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from a7sim.instrument.autograph import State

LINES_PER_CHECKPOINT = 2000
"""Events of the link between checkpoints, made when no line waits."""


class Checkpoint(msgspec.Struct, frozen=True):
    """State: the line of the journal with its hash, the simulated time in s, and the state itself."""

    line: int
    t: float
    hash: str
    state: State


def state_hash(state: State) -> str:
    """Return the SHA-256 of a state."""
    return hashlib.sha256(msgspec.json.encode(state, order="sorted")).hexdigest()


def to_lines(checkpoints: Iterable[Checkpoint]) -> bytes:
    """Return checkpoints as lines of JSON."""
    return b"".join(msgspec.json.encode(each) + b"\n" for each in checkpoints)


def read_checkpoints(path: Path) -> Iterator[Checkpoint]:
    """Yield the checkpoints of a file up to the first damaged one; none without a file."""
    try:
        lines = path.read_bytes().splitlines()
    except OSError:
        return
    for line in lines:
        try:
            checkpoint = msgspec.json.decode(line, type=Checkpoint)
        except (msgspec.DecodeError, UnicodeDecodeError):
            return
        if state_hash(checkpoint.state) != checkpoint.hash:
            return
        yield checkpoint


@dataclass(frozen=True)
class StateDifference:
    """Difference of two states: its path, the previous and the present value."""

    part: str
    before: Any
    after: Any


def differences(earlier: Any, later: Any, part: str = "") -> Iterator[StateDifference]:
    """Yield the parts in which two states differ."""
    if isinstance(earlier, dict) and isinstance(later, dict):
        for key in [*earlier, *(key for key in later if key not in earlier)]:
            yield from differences(earlier.get(key), later.get(key), f"{part}.{key}" if part else key)
    elif earlier != later:
        yield StateDifference(part, earlier, later)
