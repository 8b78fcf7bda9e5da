"""Fixtures that several test files share."""

import gc
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import settings

from a7sim.cli import main
from tests.support.hypothesis_profile import PROFILE

settings.load_profile(PROFILE)


def _let_processes_keep_bytecode() -> None:
    """Let no process that a test starts compile the whole package anew, as it would on many a container."""
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    sys.dont_write_bytecode = False


_let_processes_keep_bytecode()


def pytest_configure(config: pytest.Config) -> None:
    """Keep the order of the groups when xdist distributes them; it would sort them by their number of tests."""
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Make each file a group of `--dist loadgroup`, unless a test is marked with a group.

    Groups with slow tests and marked groups come first, so that no worker begins with one at the end.
    A worker runs all tests of a group, so that fixtures of module scope are made once.
    """
    early = set()
    for item in items:
        is_marked = item.get_closest_marker("xdist_group") is not None
        if not is_marked:
            item.add_marker(pytest.mark.xdist_group(item.path.stem))
        if is_marked or item.get_closest_marker("slow") is not None:
            early.add(_group_of(item))
    items.sort(key=lambda item: _group_of(item) not in early)


def _group_of(item: pytest.Item) -> str:
    mark = item.get_closest_marker("xdist_group")
    assert mark is not None, item.nodeid
    return str(mark.args[0])


def pytest_collection_finish() -> None:
    """Let the garbage collector pass over what stays to the end anyway, modules and tests, and come less often."""
    gc.freeze()
    gc.set_threshold(200_000, 20, 50)


BESIDE_THE_PROJECT = Path(__file__).parents[2] / "shared" / "reference"


@pytest.fixture(scope="session")
def reference() -> Path:
    """The folder of measurements and results that nobody of this project made up."""
    named = os.environ.get("A7SIM_REFERENCE")
    folder = Path(named) if named else BESIDE_THE_PROJECT
    if not named and not folder.is_dir():
        pytest.skip("no reference data: A7SIM_REFERENCE is not set and ../shared/reference is not there")
    assert folder.is_dir(), f"A7SIM_REFERENCE names {folder}, which is no folder"
    return folder


def _session_of(out: Path, *words: str) -> int:
    command = [sys.executable, "-m", "a7sim", "run", "akwanga", *words, "--quiet", "--out", out]
    return subprocess.run(command, check=False).returncode


@pytest.fixture(scope="session")
def akwanga_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of Akwanga's session with seed 7, as `a7sim run` leaves it."""
    out = tmp_path_factory.mktemp("shared") / "akwanga"
    assert _session_of(out, "--seed", "7") == 0
    return out


@pytest.fixture(scope="session")
def short_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a novice who finds that a picture lies upside down."""
    out = tmp_path_factory.mktemp("shared") / "upside-down"
    assert _session_of(out, "--set", "photos.1.laid=upside down", "--skill", "novice") == 1
    return out


Typed = Callable[..., tuple[int | str | None, str, str]]


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Typed:
    """Type a command and return its exit code, what it prints, and what it complains of."""

    def at_the_door(*words: object) -> tuple[int | str | None, str, str]:
        monkeypatch.setattr(sys, "argv", ["a7sim", *map(str, words)])
        with pytest.raises(SystemExit) as left:
            main()
        printed = capsys.readouterr()
        return left.value.code, printed.out, printed.err

    return at_the_door
