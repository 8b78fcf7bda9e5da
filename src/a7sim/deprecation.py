"""Names of the previous release: each works for one release and warns with `FutureWarning`."""

import warnings
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def warn_renamed(old: str, new: str, stacklevel: int = 2) -> None:
    """Warn the caller of the caller that `old` is now called `new`."""
    warnings.warn(
        f"{old} is now called {new}; the old name will be removed in the next release",
        FutureWarning,
        stacklevel=stacklevel + 1,
    )


def renamed_attributes(module: str, renames: Mapping[str, str]) -> Callable[[str], Any]:
    """Return a module's `__getattr__` that maps old names to new ones.

    `renames` maps each old name to `"new"` in the same module or to `"package.module:new"` elsewhere. The result raises
    AttributeError for any other name.
    """

    def getattribute(name: str) -> Any:
        if name not in renames:
            raise AttributeError(f"module {module!r} has no attribute {name!r}")
        home, _, new = renames[name].rpartition(":")
        warn_renamed(f"{module}.{name}", f"{home or module}.{new}")
        return getattr(import_module(home or module), new)

    return getattribute


class RenamedMember:
    """Old name of a method, class method or property: `old = RenamedMember("new")` in the body of the class."""

    def __init__(self, new: str) -> None:
        self._new = new
        self._names = (new, new)

    def __set_name__(self, owner: type, name: str) -> None:
        self._names = (f"{owner.__name__}.{name}", f"{owner.__name__}.{self._new}")

    def __get__(self, instance: object, owner: type) -> Any:
        warn_renamed(*self._names)
        return getattr(owner if instance is None else instance, self._new)
