"""Commands in processes of their own."""

import json
import os
import subprocess
import sys
import time
from contextlib import chdir, redirect_stderr, redirect_stdout
from io import BytesIO, TextIOWrapper
from typing import NamedTuple

from a7sim.cli import main
from tests.served import PATIENCE, Line

COMMAND = [sys.executable, "-c", "from a7sim.cli import main; main()"]
SERVE = [*COMMAND, "serve"]
ANYWHERE = ("--tcp", "127.0.0.1:0")


def a7sim(*arguments, **popen):
    """Return what a command ended with and said."""
    command = [*COMMAND, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=120, **popen)


def a7sim_here(*arguments, cwd="."):
    """Return what a command ended with and said in a folder, without a process of its own."""
    printed, complained = (TextIOWrapper(BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    before, sys.argv = sys.argv, ["a7sim", *map(str, arguments)]
    try:
        with chdir(cwd), redirect_stdout(printed), redirect_stderr(complained):
            main()
    except SystemExit as ended:
        return Said(ended.code or 0, *(each.buffer.getvalue().decode("utf-8") for each in (printed, complained)))
    finally:
        sys.argv = before


class Said(NamedTuple):
    """What a command ended with and said."""

    returncode: int
    stdout: str
    stderr: str


def said_here(capsys, *arguments):
    """Return what a command ended with and said, without a process of its own."""
    before, sys.argv = sys.argv, ["a7sim", *map(str, arguments)]
    capsys.readouterr()
    try:
        main()
    except SystemExit as ended:
        return Said(ended.code, *capsys.readouterr())
    finally:
        sys.argv = before


class Running:
    """`a7sim serve`, of akwanga unless something else is said, from ready to its end."""

    def __init__(self, *arguments, of=("akwanga",), preexec_fn=None, **environment):
        self.process = subprocess.Popen(
            [*SERVE, *of, "--json", *arguments],
            preexec_fn=preexec_fn,  # noqa: PLW1509 # it only sets limits
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env={**os.environ, **environment},
            text=True,
        )
        text = ""
        while not text.endswith("\n}\n"):
            line = self.process.stdout.readline()
            assert line, self.process.stderr.read()
            text += line
        self.document = json.loads(text)
        self.doors = self.document["listening"]

    @classmethod
    def resuming(cls, folder, **environment):
        """Return a server that goes on with the session in a folder."""
        return cls(*ANYWHERE, of=("--resume", str(folder)), **environment)

    def line(self):
        return Line(next(door["port"] for door in self.doors if door["kind"] == "tcp"))

    def stopped_by(self, number):
        """Return exit code, s it took, and what was said on standard error."""
        began = time.monotonic()
        self.process.send_signal(number)
        _, errors = self.process.communicate(timeout=PATIENCE)
        return self.process.returncode, time.monotonic() - began, errors

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()
