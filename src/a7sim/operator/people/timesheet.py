"""Timesheet of a batch of operators: simulated seconds by activity and by act."""

from collections import defaultdict
from collections.abc import Mapping
from functools import partial
from types import MappingProxyType
from typing import Literal

import numpy as np

from a7sim.batch import Indices, add_at
from a7sim.geometry import Array

Act = Literal["looking", "turning", "reading", "setting", "driving", "mounting", "computing", "resting", "other"]

_ACTIVITY_OF_ACT: Mapping[str, str] = MappingProxyType({"computing": "computing", "resting": "breaks"})

_ACTIVITY_OF_FORM: Mapping[str, str] = MappingProxyType(
    {
        "": "mounting and interior orientation",
        "preparation": "mounting and interior orientation",
        "interior orientation": "mounting and interior orientation",
        "left perspective centre": "perspective centres",
        "right perspective centre": "perspective centres",
    }
)
"""Forms that count as one activity; each other form is an activity of its own name."""


class Timesheet:
    """Seconds ``(sessions,)`` by activity and by act; each adds up to the total time."""

    def __init__(self, sessions: int) -> None:
        self.by_activity: dict[str, Array] = defaultdict(partial(np.zeros, sessions))
        self.by_act: dict[str, Array] = defaultdict(partial(np.zeros, sessions))

    def add(self, active: Indices, seconds: float, form: str, act: Act) -> None:
        """Add seconds of the active sessions."""
        activity = _ACTIVITY_OF_ACT.get(act) or _ACTIVITY_OF_FORM.get(form, form)
        add_at(seconds, active, self.by_activity[activity])
        add_at(seconds, active, self.by_act[act])

    def activities_of(self, session: int) -> dict[str, float]:
        """Return the seconds of one session by activity, in order of first occurrence."""
        return _seconds_of(self.by_activity, session)

    def acts_of(self, session: int) -> dict[str, float]:
        """Return the seconds of one session by act."""
        return _seconds_of(self.by_act, session)


def _seconds_of(seconds_by_name: Mapping[str, Array], session: int) -> dict[str, float]:
    return {name: float(seconds[session]) for name, seconds in seconds_by_name.items() if seconds[session]}
