"""Skill profiles: the values of an observer that differ between operators (docs/decisions/0008-operator-skill.md)."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import msgspec

from a7sim.scenario.schema import Observer

_FIRST_ORDER: Mapping[str, Any] = MappingProxyType(
    {
        "parallax_um": 2.5,
        "monocular_um": 2.8,
        "stereo_um": 2.8,
        "height_um": 2.0,
        "repeat_share": 0.3,
        "fiducial_um": 7.0,
        "last_digit_slip": 0.001,
        "blunder_rate": 0.001,
        "wrong_point_rate": 0.0001,
        "wrong_sign_rate": 0.0005,
        "transposed_rate": 0.0005,
        "forgotten_lever_rate": 0.0,
        "not_reread_rate": 0.0001,
        "warm_up": 0.2,
        "warm_up_minutes": 15.0,
        "fatigue_per_hour": 0.0,
        "slip_fatigue_per_hour": 0.1,
        "takes_breaks": True,
        "pace": 0.8,
    }
)

_TRAINED: Mapping[str, Any] = MappingProxyType(
    {
        "parallax_um": 4.0,
        "monocular_um": 4.0,
        "stereo_um": 4.0,
        "height_um": 3.0,
        "repeat_share": 0.4,
        "fiducial_um": 10.0,
        "last_digit_slip": 0.002,
        "blunder_rate": 0.003,
        "wrong_point_rate": 0.0005,
        "wrong_sign_rate": 0.001,
        "transposed_rate": 0.001,
        "forgotten_lever_rate": 0.0005,
        "not_reread_rate": 0.0005,
        "warm_up": 0.3,
        "warm_up_minutes": 15.0,
        "fatigue_per_hour": 0.02,
        "slip_fatigue_per_hour": 0.2,
        "takes_breaks": True,
        "pace": 1.0,
    }
)

_NOVICE: Mapping[str, Any] = MappingProxyType(
    {
        "parallax_um": 8.0,
        "monocular_um": 6.0,
        "stereo_um": 6.0,
        "height_um": 5.0,
        "repeat_share": 0.5,
        "fiducial_um": 12.0,
        "last_digit_slip": 0.004,
        "blunder_rate": 0.005,
        "wrong_point_rate": 0.002,
        "wrong_sign_rate": 0.002,
        "transposed_rate": 0.002,
        "forgotten_lever_rate": 0.002,
        "not_reread_rate": 0.002,
        "warm_up": 0.5,
        "warm_up_minutes": 30.0,
        "fatigue_per_hour": 0.1,
        "slip_fatigue_per_hour": 0.4,
        "takes_breaks": True,
        "break_every_hours": 3.0,
        "pace": 1.8,
    }
)

PROFILES: Mapping[str, Mapping[str, Any]] = MappingProxyType(
    {"novice": _NOVICE, "trained": _TRAINED, "first-order": _FIRST_ORDER}
)


def observer_of_skill(skill: str, **described: Any) -> Observer:
    """Return an observer of a skill, with the values stated for this one."""
    return msgspec.convert({"skill": skill, **PROFILES[skill], **described}, Observer)
