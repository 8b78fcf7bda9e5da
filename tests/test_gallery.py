"""The gallery of finished sessions: each is made once and returned unchanged."""

import multiprocessing
import os
import time
from pathlib import Path

import pytest

from tests.support import gallery as gallery_module
from tests.support.gallery import KINDS, Gallery


@pytest.fixture
def gallery_commands(monkeypatch: pytest.MonkeyPatch) -> list[tuple[object, ...]]:
    """Return the commands that a gallery runs; each writes a file and no session."""
    commands: list[tuple[object, ...]] = []

    def command(*words: object) -> gallery_module.CommandResult:
        commands.append(words)
        folder = Path(str(words[-1]))
        folder.mkdir()
        (folder / "results.json").write_text("{}")
        return gallery_module.CommandResult(0, "printed", "")

    monkeypatch.setattr(gallery_module, "a7sim_in_process", command)
    return commands


def test_a_session_is_made_once_for_all_callers(tmp_path: Path, gallery_commands: list[tuple[object, ...]]) -> None:
    sessions = [Gallery(tmp_path / "gallery").finished("dewitt-pair", seed) for seed in (7, 7, 8)]
    assert [words[:-1] for words in gallery_commands] == [
        (*KINDS["dewitt-pair"].words, "--seed", n, "--out") for n in (7, 8)
    ]
    assert sessions[0] == sessions[1] != sessions[2]
    assert sessions[0].result.stdout == "printed"


def test_another_process_waits_for_a_session_that_is_being_made(
    tmp_path: Path, gallery_commands: list[tuple[object, ...]]
) -> None:
    gallery = Gallery(tmp_path / "gallery")
    lock = tmp_path / "gallery" / "dewitt-pair-7.lock"
    lock.write_text(str(os.getpid()))
    waiting = multiprocessing.get_context("fork").Process(target=gallery.finished, args=("dewitt-pair", 7))
    waiting.start()
    time.sleep(0.2)
    assert waiting.is_alive() and not (tmp_path / "gallery" / "dewitt-pair-7").exists()
    lock.unlink()
    waiting.join(10.0)
    assert (waiting.exitcode, lock.exists()) == (0, False)
    assert gallery.finished("dewitt-pair", 7).folder.is_dir() and gallery_commands == []


def test_the_lock_of_a_process_that_has_ended_is_removed(
    tmp_path: Path, gallery_commands: list[tuple[object, ...]]
) -> None:
    ended = multiprocessing.get_context("fork").Process(target=time.time)
    ended.start()
    ended.join()
    gallery = Gallery(tmp_path / "gallery")
    (tmp_path / "gallery" / "dewitt-pair-7.lock").write_text(str(ended.pid))
    assert gallery.finished("dewitt-pair", 7).folder.is_dir()


def test_a_changed_session_is_detected_and_a_copy_may_change(
    tmp_path: Path, gallery_commands: list[tuple[object, ...]]
) -> None:
    gallery = Gallery(tmp_path / "gallery")
    session = gallery.finished("dewitt-pair", 7)
    (session.copy_to(tmp_path / "copy") / "results.json").write_text("changed")
    gallery.require_unchanged()
    (session.folder / "report.html").write_text("left by a test")
    with pytest.raises(AssertionError, match="a test has changed dewitt-pair-7: copy it first"):
        gallery.finished("dewitt-pair", 7)


def test_a_session_with_another_exit_code_is_not_kept(
    tmp_path: Path, gallery_commands: list[tuple[object, ...]]
) -> None:
    for _ in range(2):
        with pytest.raises(AssertionError):
            Gallery(tmp_path / "gallery").finished("novice gives up", 7)
    assert len(gallery_commands) == 2
