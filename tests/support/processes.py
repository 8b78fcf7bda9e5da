"""Commands of a7sim: in this process, in a process of their own, and a server from its start to its end."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import BytesIO, TextIOWrapper
from pathlib import Path
from typing import Any, NamedTuple, Self

import pytest

from a7sim.cli import main
from tests.support.server_thread import TIMEOUT_S, SocketClient

COMMAND = [sys.executable, "-c", "from a7sim.cli import main; main()"]
SERVE = [*COMMAND, "serve"]
ANY_TCP_PORT = ("--tcp", "127.0.0.1:0")


class CommandResult(NamedTuple):
    """Exit code and output of a command."""

    returncode: int
    stdout: str
    stderr: str


def a7sim(*arguments: object, **popen: Any) -> CommandResult:
    """Run a command in a process of its own."""
    command = [*COMMAND, *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, **popen)
    return CommandResult(done.returncode, done.stdout, done.stderr)


def a7sim_in_process(*arguments: object, cwd: str | Path = ".") -> CommandResult:
    """Run a command in a folder, in this process."""
    out, err = (TextIOWrapper(BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    before, sys.argv = sys.argv, ["a7sim", *map(str, arguments)]
    code = 0
    try:
        with chdir(cwd), redirect_stdout(out), redirect_stderr(err):
            main()
    except SystemExit as ended:
        code = _exit_code(ended)
    finally:
        sys.argv = before
    return CommandResult(code, *(stream.buffer.getvalue().decode("utf-8") for stream in (out, err)))


def a7sim_captured(capsys: pytest.CaptureFixture[str], *arguments: object) -> CommandResult:
    """Run a command in this process, its output captured by pytest."""
    before, sys.argv = sys.argv, ["a7sim", *map(str, arguments)]
    capsys.readouterr()
    code = 0
    try:
        main()
    except SystemExit as ended:
        code = _exit_code(ended)
    finally:
        sys.argv = before
    return CommandResult(code, *capsys.readouterr())


def _exit_code(ended: SystemExit) -> int:
    assert ended.code is None or isinstance(ended.code, int), ended.code
    return ended.code or 0


class RunningServer:
    """`a7sim serve` in a process, of akwanga unless `of` names other things; ready once it has printed its document."""

    def __init__(
        self,
        *arguments: str,
        of: tuple[str, ...] = ("akwanga",),
        preexec_fn: Callable[[], object] | None = None,
        **environment: str,
    ) -> None:
        self.process = subprocess.Popen(
            [*SERVE, *of, "--json", *arguments],
            preexec_fn=preexec_fn,  # noqa: PLW1509 # it only sets limits
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, **environment},
            text=True,
        )
        assert self.process.stdout is not None and self.process.stderr is not None
        text = ""
        while not text.endswith("\n}\n"):
            line = self.process.stdout.readline()
            assert line, self.process.stderr.read()
            text += line
        self.document: dict[str, Any] = json.loads(text)
        self.listening: list[dict[str, Any]] = self.document["listening"]

    @classmethod
    def resuming(cls, folder: str | Path, **environment: str) -> Self:
        """Return a server that resumes the session in a folder."""
        return cls(*ANY_TCP_PORT, of=("--resume", str(folder)), preexec_fn=None, **environment)

    def line(self) -> SocketClient:
        """Connect a client to the first TCP endpoint."""
        return SocketClient(next(endpoint["port"] for endpoint in self.listening if endpoint["kind"] == "tcp"))

    def stop(self, number: int) -> tuple[int, float, str]:
        """Send a signal; return exit code, duration in s, and standard error."""
        began = time.monotonic()
        self.process.send_signal(number)
        _, errors = self.process.communicate(timeout=TIMEOUT_S)
        return self.process.returncode, time.monotonic() - began, errors

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.communicate()
