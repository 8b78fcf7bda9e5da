"""Checkpoints: the state of an instrument now and then, by which a journal is verified and sought in.

States hold what is true of the instrument and nobody at it can see; they stand in a file of their own beside the
journal, which holds their hashes.
"""

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from a7sim.instrument.autograph import State

LINES_PER_CHECKPOINT = 2000
"""Events of the link from checkpoint to checkpoint, where no line waits then."""


class Checkpoint(msgspec.Struct, frozen=True):
    """A state: the line of the journal that has its hash, the simulated time in s, and the state itself."""

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
    """Yield the checkpoints of a file up to the first that is damaged; none where there is no file."""
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
    """A part of a state that is not as it was: where it stands in it, what it was, and what it is."""

    part: str
    before: Any
    after: Any


def differences(was: Any, is_now: Any, part: str = "") -> Iterator[StateDifference]:
    """Yield the parts in which two states differ."""
    if isinstance(was, dict) and isinstance(is_now, dict):
        for key in [*was, *(key for key in is_now if key not in was)]:
            yield from differences(was.get(key), is_now.get(key), f"{part}.{key}" if part else key)
    elif was != is_now:
        yield StateDifference(part, was, is_now)
