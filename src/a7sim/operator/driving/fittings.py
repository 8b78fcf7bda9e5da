"""The levers, prisms and collars: where they belong, and looking at them when the picture is plainly wrong."""

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
    """Return by name where the fittings that a plotter has belong, for pictures of a polarity and a base."""
    words = REQUIRED_FITTINGS[polarity, base].as_words()
    return {name: position for name, position in words.items() if name in manual.fittings}


def correct_fittings(controls: Controls, active: Indices) -> BoolArray:
    """Look at every lever and put right those that were forgotten, with a remark.

    Return for whom there was one ``(m,)`` and all now stands as the table asks; a lever that does not stay is no help.
    """
    operators, driver, model = controls.operators, controls.driver, controls.model
    mended, astray = np.zeros((2, active.size), dtype=bool)
    for name, position in required_fittings(controls.manual, model.polarity, model.base).items():
        operators.spend(active, operators.observer.seconds_to_look, "looking")
        wrong = driver.fitting(active, name) != position
        if wrong.any():
            them = active[wrong]
            controls.spend_setting(them)
            driver.set_fitting(them, name, position)
            astray[wrong] |= driver.fitting(them, name) != position
            mended |= wrong
            operators.remark(them, f"{model.name}: the {FITTING_NAMES[name]} had been forgotten: put {position}")
    return mended & ~astray
