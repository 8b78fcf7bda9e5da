"""A simulated Wild A7 Autograph, its command language, and a virtual operator.

Importing the package registers the URL ``a7sim://SCENARIO?seed=N`` with pyserial. The public names (`__all__`) are
imported on first use.
"""

from importlib import import_module
from typing import Any

import serial

__version__ = "0.1.0"

_HOMES = {
    "A7SimError": "a7sim.errors",
    "Autograph": "a7sim.instrument",
    "Client": "a7sim.link.client.client",
    "InstrumentError": "a7sim.link.client.client",
    "Operator": "a7sim.api",
    "Scenario": "a7sim.scenario",
    "Study": "a7sim.api",
    "connect": "a7sim.api",
}
_PACKAGES = ("computing", "processing", "reduction")
_RENAMED = {"InstrumentRefused": "InstrumentError", "Mistake": "A7SimError"}
"""Public names of release 0.1.0: each still works and warns. The module `a7sim.computing` warns itself."""

__all__ = [
    "A7SimError",
    "Autograph",
    "Client",
    "InstrumentError",
    "Operator",
    "Scenario",
    "Study",
    "connect",
    "processing",
    "reduction",
]

if "a7sim.link" not in serial.protocol_handler_packages:
    serial.protocol_handler_packages.append("a7sim.link")


def __getattr__(name: str) -> Any:
    if name in _PACKAGES:
        return import_module(f"a7sim.{name}")
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    if name in _RENAMED:
        from a7sim.deprecation import warn_renamed  # noqa: PLC0415

        warn_renamed(f"a7sim.{name}", f"a7sim.{_RENAMED[name]}")
        return __getattr__(_RENAMED[name])
    raise AttributeError(f"module 'a7sim' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
