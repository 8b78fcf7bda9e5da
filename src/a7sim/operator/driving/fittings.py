"""Fittings (levers, prisms and collars): required positions, and their check when the view is plainly wrong."""

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from a7sim.batch import Indices
from a7sim.operator.driving.controls import Controls
from a7sim.operator.driving.driver import BoolArray
from a7sim.plotters import REQUIRED_FITTINGS, Variant

FITTING_NAMES: Mapping[str, str] = MappingProxyType(
    {
        "dove": "Dove prisms",
        "triangulation": "triangulation lever",
        "diapositive": "diapositive lever",
        "xcollar": "collar of the X wheel",
        "ycollar": "collar of the Y wheel",
    }
)


def required_fittings(manual: Variant, polarity: str, base: str) -> dict[str, str]:
    """Return the required positions of a plotter's fittings by name, for a polarity of pictures and a base."""
    words = REQUIRED_FITTINGS[polarity, base].as_words()
    return {name: position for name, position in words.items() if name in manual.fittings}


def correct_fittings(controls: Controls, active: Indices) -> BoolArray:
    """Check all fittings and correct the forgotten ones, with a remark.

    Return the sessions ``(m,)`` where a fitting was wrong and all are now as required; a fitting that does not stay
    does not count.
    """
    operators, driver, model = controls.operators, controls.driver, controls.model
    is_corrected, is_still_wrong = np.zeros((2, active.size), dtype=bool)
    for name, position in required_fittings(controls.manual, model.polarity, model.base).items():
        operators.spend(active, operators.observer.seconds_to_look, "looking")
        is_wrong = driver.fitting(active, name) != position
        if is_wrong.any():
            sessions = active[is_wrong]
            controls.spend_setting(sessions)
            driver.set_fitting(sessions, name, position)
            is_still_wrong[is_wrong] |= driver.fitting(sessions, name) != position
            is_corrected |= is_wrong
            operators.remark(sessions, f"{model.name}: the {FITTING_NAMES[name]} had been forgotten: put {position}")
    return is_corrected & ~is_still_wrong
