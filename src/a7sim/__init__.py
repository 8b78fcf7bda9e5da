"""A simulated Wild A7 Autograph, the language it is worked in, and the operator who works it.

Importing it teaches pyserial the URL ``a7sim://SCENARIO?seed=N``. What a script takes from it (`__all__`) is imported
when it is asked for.
"""

from importlib import import_module
from typing import Any

import serial

__version__ = "0.1.0"

_HOMES = {
    "Autograph": "a7sim.instrument",
    "Client": "a7sim.link.client",
    "InstrumentError": "a7sim.link.client",
    "A7SimError": "a7sim.errors",
    "Operator": "a7sim.api",
    "Scenario": "a7sim.scenario",
    "Study": "a7sim.api",
    "connect": "a7sim.api",
}
_ROOMS = ("computing", "reduction")

__all__ = [
    "A7SimError",
    "Autograph",
    "Client",
    "InstrumentError",
    "Operator",
    "Scenario",
    "Study",
    "computing",
    "connect",
    "reduction",
]

if "a7sim.link" not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append("a7sim.link")


def __getattr__(name: str) -> Any:
    if name in _ROOMS:
        return import_module(f"a7sim.{name}")
    if name not in _HOMES:
        raise AttributeError(f"module 'a7sim' has no attribute {name!r}")
    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
