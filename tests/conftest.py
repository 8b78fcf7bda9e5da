"""Fixtures that several test files share."""

import gc
import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from a7sim.cli import main
from tests.support.gallery import FinishedSession, Gallery
from tests.support.hypothesis_profile import PROFILE

settings.load_profile(PROFILE)


def _let_processes_keep_bytecode() -> None:
    """Let processes that tests start use the compiled package, also where the environment forbids bytecode."""
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
    """Exclude modules and tests from garbage collection and make it less frequent."""
    gc.freeze()
    gc.set_threshold(200_000, 20, 50)


REFERENCE = Path(__file__).parents[2] / "shared" / "reference"


@pytest.fixture(scope="session")
def reference() -> Path:
    """The folder of measurements and results from sources outside this project."""
    named = os.environ.get("A7SIM_REFERENCE")
    folder = Path(named) if named else REFERENCE
    if not named and not folder.is_dir():
        pytest.skip("no reference data: A7SIM_REFERENCE is not set and ../shared/reference is not there")
    assert folder.is_dir(), f"A7SIM_REFERENCE names {folder}, which is no folder"
    return folder


Finished = Callable[..., FinishedSession]


@pytest.fixture(scope="session")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Finished]:
    """Return a function that returns the finished session of a kind and a seed (`tests.support.gallery`)."""
    folder = tmp_path_factory.getbasetemp()
    common = folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder
    gallery = Gallery(common / "gallery")
    yield gallery.finished
    gallery.require_unchanged()


@pytest.fixture(scope="session")
def akwanga_folder(finished: Finished) -> Path:
    """The folder of a session of Akwanga with seed 7."""
    return finished("akwanga", 7).folder


@pytest.fixture(scope="session")
def gave_up_folder(finished: Finished) -> Path:
    """The folder of a novice's session that ends at a photograph that lies upside down."""
    return finished("novice gives up").folder


Typed = Callable[..., tuple[int | str | None, str, str]]


@pytest.fixture
def typed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Typed:
    """Return a function that runs a command in this process and returns exit code, output and standard error."""

    def run(*words: object) -> tuple[int | str | None, str, str]:
        monkeypatch.setattr(sys, "argv", ["a7sim", *map(str, words)])
        with pytest.raises(SystemExit) as ended:
            main()
        printed = capsys.readouterr()
        return ended.value.code, printed.out, printed.err

    return run
