"""Handouts of an exercise, and the values that their maker keeps back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from a7sim.scenario import Scenario


@dataclass(frozen=True)
class Handout:
    """Handouts by file name, and the hidden values by the key of the answer."""

    papers: Mapping[str, str] = field(default_factory=dict)
    hidden: Mapping[str, Any] = field(default_factory=dict)


HandoutMaker = Callable[..., Handout]
"""Function of the scenario, the seed and the options of an exercise."""

HANDOUTS: dict[str, HandoutMaker] = {}
"""All makers of handouts by the names in exercises."""


def handout(name: str) -> Callable[[HandoutMaker], HandoutMaker]:
    """Register a maker of handouts under a name."""

    def register(maker: HandoutMaker) -> HandoutMaker:
        HANDOUTS[name] = maker
        return maker

    return register


def make_handout(name: str, scenario: Scenario, seed: int, options: Mapping[str, Any]) -> Handout:
    """Return the handouts of an exercise, the same for the same seed; empty without a maker."""
    return HANDOUTS[name](scenario, seed, **options) if name else Handout()
