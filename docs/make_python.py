"""Write python.md, the Python API, from the docstrings.

python docs/make_python.py            # writes the page
python docs/make_python.py --check    # exit code 1 if the page is stale
"""

import inspect
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import a7sim

PAGE = Path(__file__).parent / "python.md"

HEAD = """# Python API

A script imports all it needs from `a7sim`. The package imports each public name on first use, and it is typed
(`py.typed`). `docs/make_python.py` writes this page from the docstrings, and a test runs each example. Bad input
raises `a7sim.A7SimError`, whose text is one sentence.
"""

ORDER = (
    *("connect", "Client", "InstrumentError", "Scenario", "Operator", "Study", "Autograph"),
    *("reduction", "processing", "A7SimError"),
)
"""The public names in the order of the page."""


def page() -> str:
    """Return the whole page."""
    return "\n".join([HEAD, *(line for name in ORDER for line in _section(name, getattr(a7sim, name)))]).rstrip() + "\n"


def _section(name: str, what: Any) -> Iterator[str]:
    if isinstance(what, ModuleType):
        yield f"## a7sim.{name}"
        yield from _docstring_lines(what)
        yield from (
            f"- `{each}`: {_sentence(getattr(what, each))}" for each in what.__all__ if _is_documented(what, each)
        )
        yield ""
        return
    yield f"## {name}{_signature(what)}" if inspect.isfunction(what) else f"## {name}"
    yield from _docstring_lines(what)
    if inspect.isclass(what):
        members = list(_members(what))
        yield from members
        if members:
            yield ""


def _is_documented(module: ModuleType, name: str) -> bool:
    what = getattr(module, name)
    return callable(what) and bool(inspect.getdoc(what)) and (inspect.isclass(what) or inspect.isfunction(what))


def _members(kind: type) -> Iterator[str]:
    for name, member in vars(kind).items():
        plain = member.__func__ if isinstance(member, classmethod | staticmethod) else member
        if name.startswith("_") or not inspect.getdoc(plain):
            continue
        if inspect.isfunction(plain):
            yield f"- `{name}{_signature(plain)}`: {_sentence(plain)}"
        elif isinstance(plain, property):
            yield f"- `{name}`: {_sentence(plain)}"


def _signature(function: Any) -> str:
    names = []
    for parameter in inspect.signature(function).parameters.values():
        if parameter.name in ("self", "cls"):
            continue
        if parameter.kind is parameter.KEYWORD_ONLY and "*" not in names:
            names.append("*")
        default = "" if parameter.default is parameter.empty else f"={parameter.default!r}"
        names.append(f"{parameter.name}{default}")
    return f"({', '.join(names)})"


def _sentence(what: Any) -> str:
    first = (inspect.getdoc(what) or "").partition("\n\n")[0]
    return " ".join(first.split())


def _docstring_lines(what: Any) -> Iterator[str]:
    """Yield a docstring with its examples as code."""
    for paragraph in re.split(r"\n\s*\n", inspect.getdoc(what) or ""):
        is_code = paragraph.startswith(">>>")
        yield from ["", "```python", paragraph, "```"] if is_code else ["", paragraph]
    yield ""


def main() -> int:
    if "--check" in sys.argv:
        fresh = PAGE.read_text(encoding="utf-8") == page()
        print("fresh" if fresh else "stale: run python docs/make_python.py")
        return not fresh
    PAGE.write_text(page(), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
