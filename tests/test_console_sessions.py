"""All that is done at the console is journalled, whatever ends it; the next one offers to go on."""

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


def place(out: Path | None = None, go_on: bool | None = None, seed: int = SEED) -> LocalConsole:
    return LocalConsole("akwanga", load_scenario("akwanga"), seed, out, go_on)


def sat_at(here: LocalConsole, sitting: Callable[[Person], Coroutine[Any, Any, None]]) -> Path:
    """Let a person sit at a place, and leave by the key; return the folder of the session."""
    console = Console(replace(here.config, drawing=DrawingMode.HALVES))

    async def sit_down() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await sitting(person)
            await pilot.press("q")

    asyncio.run(sit_down())
    kept = here.close()
    assert kept is not None
    return kept


async def a_beginning(person: Person) -> None:
    """Lay a picture, make counters show what the job has, change the height gear, turn, record, strike out."""
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


def standing(console: Console) -> tuple[Any, ...]:
    assert console.dials is not None
    return console.dials, console.entries, console.presets


def events_differ(folder: Path) -> list[object]:
    replay = Replay(read_journal(folder / JOURNAL))
    return [difference for _, _, difference in replay_lines(replay) if difference is not None]


def test_who_left_is_asked_and_goes_on_where_it_stood(data: Path) -> None:
    left: list[tuple[Any, ...]] = []

    async def first(person: Person) -> None:
        await a_beginning(person)
        left.append(standing(person.console))

    async def second(person: Person) -> None:
        await person.until(lambda: person.console.screen.query(OptionList))
        assert "at the instrument, left 20" in "\n".join(await person.frame())
        await person.choose("resume the session")
        await person.until(lambda: len(person.console.entries) == 2)
        await person.settle()
        assert standing(person.console) == left[0]
        assert [entry.struck for entry in person.console.entries] == [False, True]
        await person.press("right")
        assert person.console.dials.counters["X"] == "5003.00"

    folder = sat_at(place(), first)
    assert folder == data / "sessions" / "akwanga"
    assert sat_at(place(), second) == folder
    assert events_differ(folder) == []


def test_who_begins_anew_keeps_the_old_session(data: Path) -> None:
    old = sat_at(place(), a_beginning)
    bytes_of_old = (old / JOURNAL).read_bytes()

    async def anew(person: Person) -> None:
        await person.choose("start a new session")
        await person.settle()
        assert person.console.entries == () and person.console.dials.pictures == ("", "")
        await person.press("right")

    async def again(person: Person) -> None:
        await person.settle()
        assert person.console.dials.counters["X"] == "1.00", "the last session is the one gone on with"

    new = sat_at(place(), anew)
    assert new == data / "sessions" / "akwanga-2"
    assert (old / JOURNAL).read_bytes() == bytes_of_old
    assert sat_at(place(go_on=True), again) == new
    assert sat_at(place(go_on=False), anew_unasked) == data / "sessions" / "akwanga-3"


async def anew_unasked(person: Person) -> None:
    await person.settle()
    assert person.console.dials.counters["X"] == "0.00"


def test_only_what_was_done_at_the_same_scenario_and_seed_is_offered() -> None:
    first = sat_at(place(), a_beginning)
    other = sat_at(place(seed=8), anew_unasked)
    assert other != first
    assert sat_at(place(seed=8), anew_unasked) == other, "where nothing was done there is nothing to ask"


def test_a_session_that_cannot_be_gone_on_with_is_kept_and_said_so(tmp_path: Path) -> None:
    out = tmp_path / "mine"
    assert sat_at(place(out), a_beginning) == out
    journal = out / JOURNAL
    journal.write_bytes(journal.read_bytes().replace(b"PRES 5000", b"PRES 5001", 1))

    async def told(person: Person) -> None:
        await person.settle()
        assert "new session: the last one cannot be resumed" in person.message()
        assert "the journal is damaged" in person.message()

    with pytest.raises(A7SimError, match=r"--resume: expected a session of akwanga .* damaged"):
        place(out, go_on=True)
    assert sat_at(place(out), told) == tmp_path / "mine-2"


def test_a_folder_of_something_else_is_not_touched(tmp_path: Path) -> None:
    (tmp_path / "letters").mkdir()
    with pytest.raises(A7SimError, match="expected a folder that does not exist yet"):
        place(tmp_path / "letters")
    with pytest.raises(A7SimError, match=r"--resume: expected a session of akwanga at seed 7 .* found none"):
        place(go_on=True)
    assert list((tmp_path / "letters").iterdir()) == []


def test_where_somebody_sits_nobody_else_goes_on() -> None:
    taken: list[Path | None] = []

    async def first(person: Person) -> None:
        await person.settle()
        await person.press("right")
        elsewhere = place()
        assert elsewhere.config.resumable() is None
        assert "the session is in use" in elsewhere.config.greeting()
        elsewhere.config.connect().close()
        taken.append(elsewhere.close())

    folder = sat_at(place(), first)
    assert taken == [folder.with_name("akwanga-2")]


def test_escape_from_the_question_leaves_and_begins_nothing(data: Path) -> None:
    folder = sat_at(place(), a_beginning)
    before = (folder / JOURNAL).read_bytes()
    here = place()
    console = Console(here.config)

    async def sit_down() -> None:
        async with console.run_test(size=(80, 24)) as pilot:
            person = Person(pilot)
            await person.until(lambda: console.screen.query(OptionList))
            await pilot.press("escape")

    asyncio.run(sit_down())
    assert here.close() is None
    assert (folder / JOURNAL).read_bytes() == before
    assert [each.name for each in (data / "sessions").iterdir()] == ["akwanga"]


class Terminal:
    """A console on a pseudo-terminal."""

    def __init__(self, *options: str) -> None:
        self.shown = b""
        self._end, far = pty.openpty()
        fcntl.ioctl(far, termios.TIOCSWINSZ, struct.pack("HHHH", 30, 100, 0, 0))
        environment = {**os.environ, "TERM": "xterm-256color", "LC_ALL": "C.UTF-8"}
        command = [sys.executable, "-m", "a7sim", "console", *options]
        self.process = subprocess.Popen(
            command, stdin=far, stdout=far, stderr=far, env=environment, start_new_session=True
        )
        os.close(far)

    def until(self, holds: Callable[[], object]) -> None:
        end = time.monotonic() + TIMEOUT_S
        while not holds():
            assert time.monotonic() < end and self.process.poll() is None
            if select.select([self._end], [], [], 0.02)[0]:
                self.shown += os.read(self._end, 1 << 16)

    def press(self, keys: bytes, shows: bytes = b"") -> None:
        """Press keys, and wait until something is shown of which the screen showed nothing before."""
        self.shown = b""
        os.write(self._end, keys)
        self.until(lambda: shows in self.shown)

    def kill(self) -> None:
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        os.close(self._end)


def test_after_kill_9_nothing_that_was_recorded_is_lost(data: Path) -> None:
    journal = data / "sessions" / "akwanga" / JOURNAL

    def said() -> bytes:
        return journal.read_bytes() if journal.exists() else b""

    terminal = Terminal("akwanga", "--seed", str(SEED))
    try:
        terminal.press(b"\x1b[C\x1b[C")
        terminal.until(lambda: said().count(b"WHE:X 1") == 2)
        terminal.press(b":", shows=b"a line of the command language")
        terminal.press(b"SYST:LOCK:REQ?\r")
        terminal.until(lambda: b"LOCK" in said())
        terminal.press(b"\r", shows=b"name of the point")
        terminal.press(b"P1\r")
        terminal.until(lambda: b"REC:LAST?" in said())
        terminal.press(b"\x1b[A\r")
        terminal.until(lambda: said().count(b"REC:LAST?") == 2)
    finally:
        terminal.kill()

    async def afterwards(person: Person) -> None:
        await person.until(lambda: len(person.console.entries) == 2)
        await person.settle()
        assert [(entry.point, entry.counters) for entry in person.console.entries] == [
            ("P1", ("2.00", "0.00", "-300.00")),
            ("P1", ("2.00", "1.00", "-300.00")),
        ]
        assert person.console.dials.counters == {"X": "2.00", "Y": "1.00", "Z": "-300.00"}
        assert here._interactive._instrument.lock_holder == "client2", "the lock that was held is taken again"

    here = place(go_on=True)
    assert sat_at(here, afterwards) == journal.parent
    assert events_differ(journal.parent) == []


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
def test_what_cannot_be_done_is_one_sentence_and_exit_2(
    arguments: list[str], words: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["a7sim", "console", *arguments])
    with pytest.raises(SystemExit) as ended:
        main()
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert words in said and said.count("\n") == 1
