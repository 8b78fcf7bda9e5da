"""Faults on request, for tests of drivers: lost, late or garbled replies, and dropped connections."""

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
    """Rates of faults of a connection, and its delay."""

    drop_reply: float = 0.0
    """Probability that a reply is lost."""
    garble: float = 0.0
    """Probability that a byte of a reply, except its line end, is replaced."""
    disconnect: float = 0.0
    """Probability that the connection is dropped instead of a reply."""
    delay: float = 0.0
    """Delay of each reply in s."""


def parse_faults(text: str) -> FaultRates:
    """Return the faults of a text such as EXAMPLE. Raises A7SimError."""
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
    """The connection is dropped."""


class FaultInjector:
    """Faults of one connection, drawn from its own generator."""

    def __init__(self, faults: FaultRates, rng: np.random.Generator) -> None:
        self._faults = faults
        self._rng = rng

    def apply(self, reply: bytes) -> bytes:
        """Return the received bytes of a reply, empty if it is lost. Raises ConnectionDropped."""
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
