"""Papers that an exercise puts into a student's hands, and what their maker keeps back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from a7sim.scenario import Scenario


@dataclass(frozen=True)
class Handout:
    """Papers by file name, and what is to be found out about them, by the key of the answer."""

    papers: Mapping[str, str] = field(default_factory=dict)
    hidden: Mapping[str, Any] = field(default_factory=dict)


HandoutMaker = Callable[..., Handout]
"""What takes the scenario, the seed and the options of an exercise."""

HANDOUTS: dict[str, HandoutMaker] = {}
"""All makers of papers by the names that exercises use."""


def handout(name: str) -> Callable[[HandoutMaker], HandoutMaker]:
    """Register a maker of papers under a name."""

    def registered(maker: HandoutMaker) -> HandoutMaker:
        HANDOUTS[name] = maker
        return maker

    return registered


def make_handout(name: str, scenario: Scenario, seed: int, options: Mapping[str, Any]) -> Handout:
    """Return the papers of an exercise, the same for the same seed; none where it has no maker."""
    return HANDOUTS[name](scenario, seed, **options) if name else Handout()
