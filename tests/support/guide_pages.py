"""Pages that tell people what to type: their blocks, their commands, and what they show that comes of it."""

import re
import shlex
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"

_BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
_FILE = re.compile(r"`([\w-]+\.(?:a7s|toml|csv))`")


def page(name):
    return (DOCS / f"{name}.md").read_text(encoding="utf-8")


def blocks(text, kind):
    return [body for found, body in _BLOCK.findall(text) if found == kind]


def commands(text):
    """Return what is to be typed: words, and what the remark behind it says."""
    return [each for block in blocks(text, "sh") for each in _typed(block)]


def _typed(block):
    lines = [line for line in block.splitlines() if line.startswith("a7sim ")]
    return [(shlex.split(line, comments=True)[1:], line.partition(" # ")[2]) for line in lines]


@dataclass
class Step:
    """A block to be typed, the files that stand before it, and what is shown behind it."""

    commands: list
    files: dict
    shown: list = field(default_factory=list)


def steps(text):
    """Return the steps of a page; a block of a file is named last of all files in the words before it."""
    found, files, end = [], {}, 0
    for block in _BLOCK.finditer(text):
        kind, body = block.groups()
        if kind == "sh":
            found.append(Step(_typed(body), files))
            files = {}
        elif kind == "text":
            found[-1].shown += body.splitlines()
        elif names := _FILE.findall(text[end : block.start()]):
            files[names[-1]] = body
        end = block.end()
    return found


def not_shown(lines, printed):
    """Return the lines of a page that were not printed; blanks do not count, `...` stands for anything."""
    flat = " ".join(printed.split())
    return [line for line in lines if not _found(" ".join(line.split()), flat)]


def _found(line, flat):
    return re.search(".*".join(re.escape(part.strip()) for part in line.split("...")), flat) is not None


def type_in(room, words, remark):
    """Type a command, see that it ends as its remark says, and return what it prints."""
    code, out, err = room(*words)
    assert "Traceback" not in err
    if "opens the console" in remark:
        assert (code, err[-90:].count("expected a terminal to sit at")) == (2, 1), (words, err)
        return out
    expected = int(found.group(1)) if (found := re.search(r"\(exit code (\d)", remark)) else 0
    assert code == expected, (words, out, err)
    return out
