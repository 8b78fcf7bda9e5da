"""Finished sessions that test files share: each is made once in a test run, for all workers."""

import json
import os
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from tests.support.processes import CommandResult, a7sim_in_process

LOCK_TIMEOUT_S = 300.0
POLL_INTERVAL_S = 0.05

READ_ONCE = ("--set", "plan.parallax_readings=1")
"""For tests that do not depend on repeated readings of a parallax."""


class SessionKind(NamedTuple):
    """A command that leaves a folder, without `--seed` and `--out`, and its exit code."""

    words: tuple[str, ...]
    returncode: int = 0


KINDS = {
    "akwanga": SessionKind(("run", "akwanga")),
    "akwanga read once": SessionKind(("run", "akwanga", *READ_ONCE)),
    "akwanga dependent": SessionKind(("run", "akwanga", "--method", "dependent", *READ_ONCE)),
    "akwanga empirical": SessionKind(("run", "akwanga", "--set", "plan.procedure=empirical", *READ_ONCE)),
    "akwanga case A": SessionKind(("run", "akwanga", "--case", "A", *READ_ONCE)),
    "akwanga case E": SessionKind(("run", "akwanga", "--case", "E", *READ_ONCE)),
    "akwanga-lake": SessionKind(("run", "akwanga-lake", "--set", "plan.procedure=numerical", *READ_ONCE)),
    "akwanga-lake empirical": SessionKind(("run", "akwanga-lake", "--set", "plan.procedure=empirical", *READ_ONCE)),
    "akwanga-a8": SessionKind(("run", "akwanga-a8", *READ_ONCE)),
    "a8-strip": SessionKind(("run", "a8-strip")),
    "all strips": SessionKind(("run", "akwanga", "--strips", "all", *READ_ONCE)),
    "bridge": SessionKind(("bridge", "bridge", *READ_ONCE)),
    "compile": SessionKind(
        ("compile", "akwanga", "--contour", "471", "--line", "road1", "--line", "track1", *READ_ONCE)
    ),
    "dewitt-pair": SessionKind(("run", "dewitt-pair", *READ_ONCE)),
    "grid test": SessionKind(("calibrate", "grid-test", "--points", "9", "--levels", "1")),
    "novice gives up": SessionKind(("run", "akwanga", "--set", "photos.1.laid=upside down", "--skill", "novice"), 1),
    "by hand": SessionKind(("replay", "clearing")),
}
"""All kinds of finished sessions. A script states its seed itself, so that "by hand" has none."""


class FinishedSession(NamedTuple):
    """The folder of a session, which tests must not change, and the output of its command."""

    folder: Path
    result: CommandResult

    def copy_to(self, folder: Path) -> Path:
        """Copy the folder of the session to a new one that a test may change; return the new one."""
        return Path(shutil.copytree(self.folder, folder))


class Gallery:
    """Finished sessions in a folder that the workers of a test run have in common."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(exist_ok=True)
        self._states: dict[Path, str] = {}

    def finished(self, kind: str, seed: int | None = 1985) -> FinishedSession:
        """Return a finished session; the first caller of all workers makes it."""
        name = f"{kind} {seed}".replace(" ", "-")
        place = self._folder / name
        if not place.is_dir():
            with _lock(self._folder / f"{name}.lock"):
                if not place.is_dir():
                    self._make(KINDS[kind], seed, place)
        self._require_unchanged(place)
        return _session_in(place)

    def require_unchanged(self) -> None:
        """Assert that no test of this worker has changed a session."""
        for place in self._states:
            self._require_unchanged(place)

    def _make(self, kind: SessionKind, seed: int | None, place: Path) -> None:
        part = place.with_name(f"{place.name}.part")
        shutil.rmtree(part, ignore_errors=True)
        part.mkdir()
        seed_words = () if seed is None else ("--seed", seed)
        result = a7sim_in_process(*kind.words, *seed_words, "--out", part / "session")
        assert result.returncode == kind.returncode, result
        (part / "result.json").write_text(json.dumps(result), encoding="utf-8")
        (part / "state").write_text(_state_of(part / "session"), encoding="utf-8")
        part.rename(place)

    def _require_unchanged(self, place: Path) -> None:
        if place not in self._states:
            self._states[place] = (place / "state").read_text(encoding="utf-8")
        assert _state_of(place / "session") == self._states[place], f"a test has changed {place.name}: copy it first"


def _session_in(place: Path) -> FinishedSession:
    result = CommandResult(*json.loads((place / "result.json").read_text(encoding="utf-8")))
    return FinishedSession(place / "session", result)


def _state_of(folder: Path) -> str:
    """Return names, sizes and times of change of all files in a folder."""
    files = [(path, path.stat()) for path in sorted(folder.rglob("*")) if path.is_file()]
    return "\n".join(f"{path.relative_to(folder)} {stat.st_size} {stat.st_mtime_ns}" for path, stat in files)


@contextmanager
def _lock(path: Path) -> Iterator[None]:
    """Hold a lock file that one process can have; a lock of a process that has ended is removed."""
    end = time.monotonic() + LOCK_TIMEOUT_S
    while True:
        try:
            handle = os.open(path, os.O_CREAT | os.O_EXCL | os.O_WRONLY)
            break
        except FileExistsError:
            assert time.monotonic() < end, f"{path}: expected the lock to become free within {LOCK_TIMEOUT_S} s"
            _remove_if_abandoned(path)
            time.sleep(POLL_INTERVAL_S)
    try:
        os.write(handle, str(os.getpid()).encode("ascii"))
        os.close(handle)
        yield
    finally:
        path.unlink()


def _remove_if_abandoned(path: Path) -> None:
    try:
        holder = path.read_text(encoding="ascii")
        if holder:
            os.kill(int(holder), 0)
    except ProcessLookupError:
        path.unlink(missing_ok=True)
    except FileNotFoundError:
        pass
