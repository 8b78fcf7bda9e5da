"""Each action at the console is recorded in the journal at once; the next console offers to resume the session."""

import asyncio
import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from textual.widgets import OptionList

from a7sim.cli import main
from a7sim.cli.console_setup import LocalConsole
from a7sim.console.app import Console
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.errors import A7SimError
from a7sim.journal.format import read_journal
from a7sim.journal.replay import Replay, replay_lines
from a7sim.journal.session_files import JOURNAL
from a7sim.scenario import load_scenario
from tests.support.interactive import TIMEOUT_S, Person

SEED = 7


@pytest.fixture(autouse=True)
def data(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    return tmp_path / "data" / "a7sim"


def local_console(out: Path | None = None, resume: bool | None = None, seed: int = SEED) -> LocalConsole:
    return LocalConsole("akwanga", load_scenario("akwanga"), seed, out, resume)


def folder_after(local: LocalConsole, actions: Callable[[Person], Coroutine[Any, Any, None]]) -> Path:
    """Run actions at a console and end it by its key; return the folder of the session."""
    console = Console(replace(local.config, drawing=DrawingMode.HALVES))

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await actions(person)
            await pilot.press("q")

    asyncio.run(perform())
    folder = local.close()
    assert folder is not None
    return folder


async def first_actions(person: Person) -> None:
    """Lay a picture, preset the counters, change the height gear, turn, record, strike out."""
    await person.settle()
    await person.press("l")
    await person.choose("left projector: lay")
    await person.choose("101")
    await person.press("l")
    await person.choose("preset counters")
    await person.type_in("X 5000 Y 5000")
    await person.press("l")
    await person.choose("height gear")
    await person.type_in("Dc")
    assert set(person.console.presets.units) == {"Z"} and set(person.console.presets.origins) == set("XYZ")
    await person.press("right", "right", "y", "+", "enter")
    await person.type_in("P1")
    await person.press("up", "enter", "x")


def state_of(console: Console) -> tuple[Any, ...]:
    assert console.dials is not None
    return console.dials, console.entries, console.presets


def replay_differences(folder: Path) -> list[object]:
    replay = Replay(read_journal(folder / JOURNAL))
    return [difference for _, _, difference in replay_lines(replay) if difference is not None]


def test_a_resumed_session_continues_from_its_last_state(data: Path) -> None:
    states: list[tuple[Any, ...]] = []

    async def first(person: Person) -> None:
        await first_actions(person)
        states.append(state_of(person.console))

    async def second(person: Person) -> None:
        await person.until(lambda: person.console.screen.query(OptionList))
        assert "at the instrument, left 20" in "\n".join(await person.frame())
        await person.choose("resume the session")
        await person.until(lambda: len(person.console.entries) == 2)
        await person.settle()
        assert state_of(person.console) == states[0]
        assert [entry.struck for entry in person.console.entries] == [False, True]
        await person.press("right")
        assert person.console.dials.counters["X"] == "5003.00"

    folder = folder_after(local_console(), first)
    assert folder == data / "sessions" / "akwanga"
    assert folder_after(local_console(), second) == folder
    assert replay_differences(folder) == []


def test_a_new_session_keeps_the_old_session(data: Path) -> None:
    old = folder_after(local_console(), first_actions)
    bytes_of_old = (old / JOURNAL).read_bytes()

    async def start_new(person: Person) -> None:
        await person.choose("start a new session")
        await person.settle()
        assert person.console.entries == () and person.console.dials.pictures == ("", "")
        await person.press("right")

    async def resume_last(person: Person) -> None:
        await person.settle()
        assert person.console.dials.counters["X"] == "1.00", "the last session is the one resumed"

    new = folder_after(local_console(), start_new)
    assert new == data / "sessions" / "akwanga-2"
    assert (old / JOURNAL).read_bytes() == bytes_of_old
    assert folder_after(local_console(resume=True), resume_last) == new
    assert folder_after(local_console(resume=False), expect_new_session) == data / "sessions" / "akwanga-3"


async def expect_new_session(person: Person) -> None:
    await person.settle()
    assert person.console.dials.counters["X"] == "0.00"


def test_only_a_session_of_the_same_scenario_and_seed_is_offered() -> None:
    first = folder_after(local_console(), first_actions)
    other = folder_after(local_console(seed=8), expect_new_session)
    assert other != first
    assert folder_after(local_console(seed=8), expect_new_session) == other, "a session without actions is reused"


def test_a_damaged_session_is_kept_and_the_message_reports_it(tmp_path: Path) -> None:
    out = tmp_path / "mine"
    assert folder_after(local_console(out), first_actions) == out
    journal = out / JOURNAL
    journal.write_bytes(journal.read_bytes().replace(b"PRES 5000", b"PRES 5001", 1))

    async def check_message(person: Person) -> None:
        await person.settle()
        assert "new session: the last one cannot be resumed" in person.message()
        assert "the journal is damaged" in person.message()

    with pytest.raises(A7SimError, match=r"--resume: expected a session of akwanga .* damaged"):
        local_console(out, resume=True)
    assert folder_after(local_console(out), check_message) == tmp_path / "mine-2"


def test_a_folder_without_a_session_is_not_changed(tmp_path: Path) -> None:
    (tmp_path / "letters").mkdir()
    with pytest.raises(A7SimError, match="expected a folder that does not exist yet"):
        local_console(tmp_path / "letters")
    with pytest.raises(A7SimError, match=r"--resume: expected a session of akwanga at seed 7 .* found none"):
        local_console(resume=True)
    assert list((tmp_path / "letters").iterdir()) == []


def test_a_session_in_use_cannot_be_resumed() -> None:
    folders: list[Path | None] = []

    async def first(person: Person) -> None:
        await person.settle()
        await person.press("right")
        second = local_console()
        assert second.config.resumable() is None
        assert "the session is in use" in second.config.greeting()
        second.config.connect().close()
        folders.append(second.close())

    folder = folder_after(local_console(), first)
    assert folders == [folder.with_name("akwanga-2")]


def test_escape_from_the_question_ends_the_console_without_a_session(data: Path) -> None:
    folder = folder_after(local_console(), first_actions)
    before = (folder / JOURNAL).read_bytes()
    local = local_console()
    console = Console(local.config)

    async def perform() -> None:
        async with console.run_test(size=(80, 24)) as pilot:
            person = Person(pilot)
            await person.until(lambda: console.screen.query(OptionList))
            await pilot.press("escape")

    asyncio.run(perform())
    assert local.close() is None
    assert (folder / JOURNAL).read_bytes() == before
    assert [each.name for each in (data / "sessions").iterdir()] == ["akwanga"]


class Terminal:
    """A console on a pseudo-terminal."""

    def __init__(self, *options: str) -> None:
        self.shown = b""
        self._end, far_end = pty.openpty()
        fcntl.ioctl(far_end, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
        environment = {**os.environ, "TERM": "xterm-256color", "LC_ALL": "C.UTF-8"}
        command = [sys.executable, "-m", "a7sim", "console", *options]
        self.process = subprocess.Popen(
            command, stdin=far_end, stdout=far_end, stderr=far_end, env=environment, start_new_session=True
        )
        os.close(far_end)

    def until(self, holds: Callable[[], object]) -> None:
        end = time.monotonic() + TIMEOUT_S
        while not holds():
            assert time.monotonic() < end and self.process.poll() is None
            if select.select([self._end], [], [], 0.02)[0]:
                self.shown += os.read(self._end, 1 << 16)

    def press(self, keys: bytes, shows: bytes = b"") -> None:
        """Press keys and wait until the terminal has received `shows`."""
        self.shown = b""
        os.write(self._end, keys)
        self.until(lambda: shows in self.shown)

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        os.close(self._end)


def test_sigkill_loses_no_recorded_reading(data: Path) -> None:
    journal = data / "sessions" / "akwanga" / JOURNAL

    def journal_bytes() -> bytes:
        return journal.read_bytes() if journal.exists() else b""

    terminal = Terminal("akwanga", "--seed", str(SEED))
    try:
        terminal.press(b"\x1b[C\x1b[C")
        terminal.until(lambda: journal_bytes().count(b"WHE:X 1") == 2)
        terminal.press(b":", shows=b"a line of the command language")
        terminal.press(b"SYST:LOCK:REQ?\r")
        terminal.until(lambda: b"LOCK" in journal_bytes())
        terminal.press(b"\r", shows=b"name of the point")
        terminal.press(b"P1\r")
        terminal.until(lambda: b"REC:LAST?" in journal_bytes())
        terminal.press(b"\x1b[A\r")
        terminal.until(lambda: journal_bytes().count(b"REC:LAST?") == 2)
    finally:
        terminal.kill()

    async def check_resumed(person: Person) -> None:
        await person.until(lambda: len(person.console.entries) == 2)
        await person.settle()
        assert [(entry.point, entry.counters) for entry in person.console.entries] == [
            ("P1", ("2.00", "0.00", "-300.00")),
            ("P1", ("2.00", "1.00", "-300.00")),
        ]
        assert person.console.dials.counters == {"X": "2.00", "Y": "1.00", "Z": "-300.00"}
        assert local._interactive._instrument.lock_holder == "client2", "the lock is restored"

    local = local_console(resume=True)
    assert folder_after(local, check_resumed) == journal.parent
    assert replay_differences(journal.parent) == []


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["akwanga", "--variant", "A8"], "models[1].base: expected 'inside', all that an A8 has, got 'outside'"),
        (["--connect", "tcp://127.0.0.1:1", "--resume"], "--connect tcp://127.0.0.1:1: expected no --resume beside it"),
        (["--watch", "clearing", "--seed", "7", "--new"], "expected no --seed and no --new beside it"),
        (["akwanga", "--watch", "clearing"], "expected no SCENARIO beside it"),
        (["--watch", "nowhere"], "nowhere: expected the folder of a session, its journal, or a script"),
        (["--watch", "tcp://127.0.0.1:1"], "expected an instrument to answer there"),
        (["akwanga", "--resume"], "--resume: expected a session of akwanga at seed"),
    ],
)
def test_wrong_options_of_the_console_are_one_sentence_and_exit_code_2(
    arguments: list[str], words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["a7sim", "console", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    message = capsys.readouterr().err
    assert ended.value.code == 2
    assert words in message and message.count("\n") == 1
