"""Faults on request, for people who test drivers: replies that get lost, late or garbled, lines that are cut."""

import math
import re
from dataclasses import dataclass

import numpy as np

from a7sim.errors import A7SimError

EXAMPLE = "drop-reply:0.01,delay:50ms,garble:0.001,disconnect:0.0005"

MAX_DELAY = 60.0
"""s."""

_DELAY = re.compile(r"(\d+(?:\.\d+)?)(ms|s)")


@dataclass(frozen=True, slots=True)
class FaultRates:
    """How often a line fails its client, and how late it is."""

    drop_reply: float = 0.0
    """Probability that a reply is lost whole."""
    garble: float = 0.0
    """Probability of each byte of a reply, but not of its line end, to arrive as another."""
    disconnect: float = 0.0
    """Probability that the line is cut where a reply was due."""
    delay: float = 0.0
    """s by which every reply is late."""


def parse_faults(text: str) -> FaultRates:
    """Return the faults that a text such as EXAMPLE names. Raises Mistake."""
    found: dict[str, float] = {}
    for part in text.split(","):
        name, _, value = part.strip().partition(":")
        key = name.replace("-", "_")
        if name not in ("drop-reply", "garble", "disconnect", "delay"):
            raise A7SimError(f"--fault: expected drop-reply, delay, garble or disconnect as in {EXAMPLE}, got {part!r}")
        if key in found:
            raise A7SimError(f"--fault: expected {name} once, got it twice in {text!r}")
        found[key] = _delay(value) if name == "delay" else _probability(name, value)
    return FaultRates(**found)


def _probability(name: str, text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0.0 <= value <= 1.0:
        raise A7SimError(f"--fault {name}: expected a probability from 0 to 1, got {text!r}")
    return value


def _delay(text: str) -> float:
    found = _DELAY.fullmatch(text)
    seconds = float(found[1]) * (1e-3 if found[2] == "ms" else 1.0) if found else math.inf
    if seconds > MAX_DELAY:
        raise A7SimError(f"--fault delay: expected up to {MAX_DELAY:g}s, such as 50ms or 1.5s, got {text!r}")
    return seconds


class ConnectionDropped(Exception):
    """The line is cut."""


class FaultInjector:
    """What one line does to the replies that it carries, drawn from a generator of its own."""

    def __init__(self, faults: FaultRates, rng: np.random.Generator) -> None:
        self._faults = faults
        self._rng = rng

    def apply(self, reply: bytes) -> bytes:
        """Return what arrives of a reply, nothing where it is lost. Raises Cut."""
        cut, dropped = self._rng.random(2)
        if cut < self._faults.disconnect:
            raise ConnectionDropped
        if dropped < self._faults.drop_reply:
            return b""
        return self._garbled(reply) if self._faults.garble else reply

    def _garbled(self, reply: bytes) -> bytes:
        sent = np.frombuffer(reply, np.uint8)
        struck = self._rng.random(len(sent)) < self._faults.garble
        struck[-1] = False
        arrived = sent ^ np.where(struck, self._rng.integers(1, 256, len(sent), np.uint8), 0).astype(np.uint8)
        return arrived.tobytes()
