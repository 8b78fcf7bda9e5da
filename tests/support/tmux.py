"""A command in a real terminal, by tmux: keys pressed, and the screen read."""

import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import TypeVar

import pytest

Read = TypeVar("Read")

TIMEOUT_S = 20.0
POLL_INTERVAL_S = 0.02
needs_tmux = pytest.mark.skipif(shutil.which("tmux") is None, reason="there is no tmux")


class Terminal:
    """A command in a terminal of its own tmux server; the terminal shows `left CODE` when the command ends."""

    def __init__(self, folder: Path, *words: str, size: tuple[int, int] = (100, 30)) -> None:
        self._name = f"a7sim-{os.getpid()}-{time.monotonic_ns()}"
        environment = f"env -u COLUMNS -u LINES XDG_DATA_HOME={folder} LC_ALL=C.UTF-8"
        command = f"{environment} {sys.executable} -m a7sim {' '.join(words)}; echo left $?; cat"
        columns, rows = map(str, size)
        self._tmux("-f", "/dev/null", "new-session", "-d", "-s", "main", "-x", columns, "-y", rows, command)

    def _tmux(self, *words: str) -> str:
        done = subprocess.run(["tmux", "-L", self._name, *words], capture_output=True, text=True, check=True)
        return done.stdout

    def press(self, *keys: str) -> None:
        """Press keys by their tmux names, or characters."""
        self._tmux("send-keys", "-t", "main", *keys)

    def type_in(self, text: str) -> None:
        """Type a text and Enter."""
        self._tmux("send-keys", "-t", "main", "-l", text)
        self.press("Enter")

    def resize(self, columns: int, rows: int) -> None:
        """Change the size of the terminal."""
        self._tmux("resize-window", "-t", "main", "-x", str(columns), "-y", str(rows))

    def screen(self) -> str:
        """Return the text of the screen."""
        return self._tmux("capture-pane", "-p", "-t", "main")

    def sees(self, read: Callable[[str], Read | None], what: str) -> Read:
        """Wait until `read` returns something else than None for the screen, and return it; `what` names it."""
        end = time.monotonic() + TIMEOUT_S
        while (result := read(screen := self.screen())) is None:
            assert time.monotonic() < end, f"expected {what} on the screen, got\n{screen}"
            time.sleep(POLL_INTERVAL_S)
        return result

    def shows(self, words: str) -> str:
        """Wait until the screen shows words; return the screen."""
        return self.sees(lambda screen: screen if words in screen else None, repr(words))

    def choose(self, title: str, words: str) -> None:
        """Choose the option that begins with `words` from the list with a title, by arrow keys."""

        def number(screen: str) -> int | None:
            dialog = re.search(rf"┌─ {title} ─(.*?)└─", screen, re.DOTALL)
            options = re.findall(r"│ (\S.*?) *│", dialog[1]) if dialog else []
            return next((i for i, option in enumerate(options) if option.startswith(words)), None)

        self.press(*["Down"] * self.sees(number, f"{words!r} in the list {title!r}"), "Enter")
        self.sees(lambda screen: None if f"┌─ {title} ─" in screen else screen, f"no list {title!r} any more")

    def __enter__(self) -> "Terminal":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        subprocess.run(["tmux", "-L", self._name, "kill-server"], capture_output=True, check=False)
