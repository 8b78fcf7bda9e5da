"""Guides as data: their blocks of code, their commands, and the output that they show."""

import re
import shlex
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"

Command = tuple[list[str], str]
"""Words after `a7sim`, and the remark behind `#`."""

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"`([\w-]+\.(?:a7s|toml|csv))`")


def page(name: str) -> str:
    """Return the text of a page of docs/."""
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def blocks(text: str, kind: str) -> list[str]:
    """Return the blocks of code of one kind."""
    return [body for language, body in _BLOCK.findall(text) if language == kind]


def commands(text: str) -> list[Command]:
    """Return the commands of a page."""
    return [command for block in blocks(text, "sh") for command in _commands_in(block)]


def _commands_in(block: str) -> list[Command]:
    lines = [line for line in block.splitlines() if line.startswith("a7sim ")]
    return [(shlex.split(line, comments=True)[1:], line.partition(" # ")[2]) for line in lines]


@dataclass
class Step:
    """The commands of a block, the files shown before it, and the output shown behind it."""

    commands: list[Command]
    files: dict[str, str]
    shown: list[str] = field(default_factory=list)


def steps(text: str) -> list[Step]:
    """Return the steps of a page; the last file name before a block of another kind is the name of that block."""
    found: list[Step] = []
    files: dict[str, str] = {}
    end = 0
    for block in _BLOCK.finditer(text):
        kind, body = block.groups()
        if kind == "sh":
            found.append(Step(_commands_in(body), files))
            files = {}
        elif kind == "text":
            found[-1].shown += body.splitlines()
        elif names := _FILE.findall(text[end : block.start()]):
            files[names[-1]] = body
        end = block.end()
    return found


def not_shown(lines: list[str], printed: str) -> list[str]:
    """Return the lines of a page that were not printed; blanks are ignored, `...` matches anything."""
    flat = " ".join(printed.split())
    return [line for line in lines if not _found(" ".join(line.split()), flat)]


def _found(line: str, flat: str) -> bool:
    return re.search(".*".join(re.escape(part.strip()) for part in line.split("...")), flat) is not None


def type_in(run: Callable[..., tuple[int | str | None, str, str]], words: list[str], remark: str) -> str:
    """Run a command, assert the exit code that its remark states, and return its output."""
    code, out, err = run(*words)
    assert "Traceback" not in err
    if "opens the console" in remark:
        assert (code, err[-90:].count("expected a terminal, got")) == (2, 1), (words, err)
        return out
    expected = int(found.group(1)) if (found := re.search(r"\(exit code (\d)", remark)) else 0
    assert code == expected, (words, out, err)
    return out
