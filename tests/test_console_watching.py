"""Watching at the console: playback of a recording or a view of a live instrument, without moving anything."""

import asyncio
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from textual.widgets import Static

from a7sim.cli.console_setup import is_url, playback_console, remote_console
from a7sim.console.app import Console
from a7sim.console.drawing.job_sheet import JobSheet
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.console.state.readouts import parse_readouts, readouts_query
from a7sim.console.widgets.drum_panels import DrumScrolled
from a7sim.console.widgets.eyepiece_widget import EyepieceWidget
from a7sim.errors import A7SimError
from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.journal import recording as recording_module
from a7sim.journal import writer as journal_module
from a7sim.journal.format import read_journal
from a7sim.journal.recording import Recording, open_recording
from a7sim.journal.writer import Journal, make_header
from a7sim.link.client.client import Client
from a7sim.link.inprocess import InProcessSerial
from a7sim.plotters import VARIANTS
from a7sim.scenario import load_scenario
from a7sim.scene import build_scene
from tests.support.engine_client import with_model
from tests.support.interactive import Person
from tests.support.server_thread import ServerThread

WORK = [
    'PHOT1:LOAD "101";:PHOT2:LOAD "102"',
    "PROJ1:PDIS 152.68;:PROJ2:PDIS 152.68;:BASE:BX 194.99;:DRIV:Z -325.71",
    "COUN:X:PRES 5000;:COUN:Z:PRES 4967",
    *(f'WHE:X 1;:EYEP1? "1011";:REC "P{number}",BY1' for number in range(1, 9)),
    'REC:STR 3,"a slip"',
    'NOTE "after the slip"',
    *(f'PROJ1:BY:TURN 0.5;:REC "Q{number}"' for number in range(1, 5)),
]


@pytest.fixture(scope="module")
def session(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a session of 17 lines, ten seconds apart, with a checkpoint every ten events."""
    folder = tmp_path_factory.mktemp("session")
    scenario = load_scenario("akwanga")
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(journal_module, "LINES_PER_CHECKPOINT", 10)
        journal = Journal()
        instrument = SharedInstrument(
            build_autograph(scenario.instrument, build_scene(scenario, 7).mountable, 7), journal.on_link_event
        )
        with journal.recording(folder, make_header("serve", scenario, 7), instrument):
            port = InProcessSerial(instrument=instrument, timeout=1.0)
            for line in WORK:
                port.clock.advance(10.0)
                port.write(line.encode() + b"\n")
            port.close()
    return folder


def recording_of(session: Path) -> Recording:
    return open_recording(str(session))


def dials_of(recording: Recording) -> Any:
    with recording.open_client() as client:
        client.send(readouts_query(VARIANTS["A7"]))
        return parse_readouts(VARIANTS["A7"], client.reply())


def watch(session: str, actions: Any, size: tuple[int, int] = (100, 30), **others: Any) -> None:
    console = Console(replace(playback_console(session), **{"drawing": DrawingMode.HALVES, **others}))

    async def perform() -> None:
        async with console.run_test(size=size) as pilot:
            person = Person(pilot)
            await person.settle()
            await actions(person)

    asyncio.run(perform())


def progress(person: Person) -> str:
    return str(person.console.main.query_one("#progress", Static).content)


def message_of_eye(person: Person) -> str:
    return " ".join(run.text for row in person.console.query_one("#eye1", EyepieceWidget)._rows for run in row)


# --- the recording ------------------------------------------------------------------------------------


def test_a_step_of_a_recording_does_not_depend_on_the_jumps_before_it(
    session: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    straight = recording_of(session)
    assert straight.steps == len(WORK)
    states = []
    for step in range(straight.steps + 1):
        frame = straight.seek(step)
        states.append((frame, dials_of(straight)))
    assert straight.journalled.header["command"] == "serve" and frame.error == ""
    jumping = recording_of(session)
    monkeypatch.setattr(recording_module, "MAX_REPLAYED_LINES", 5)
    for step in (17, 3, 9, 8, 0, 15, 1, 17):
        assert (jumping.seek(step), dials_of(jumping)) == states[step]
    assert states[11][1].struck == 0 and states[12][1].struck == 1
    assert [each.records for _, each in states] == [0] * 4 + [*range(1, 9), 8, 8, *range(9, 13)]


def test_checkpoints_limit_the_replayed_lines_of_a_jump(session: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recording_module, "MAX_REPLAYED_LINES", 5)
    jumping = recording_of(session)
    replayed: list[int] = []
    apply = jumping._replay.__class__.apply
    monkeypatch.setattr(
        jumping._replay.__class__,
        "apply",
        lambda replay, number, event: replayed.append(number) or apply(replay, number, event),
    )
    jumping.seek(jumping.steps)
    jumping.seek(jumping.steps - 1)
    assert len(replayed) <= 2 * 14 < len(jumping.journalled)


def test_a_recording_finds_steps_records_and_notes(session: Path) -> None:
    recording = recording_of(session)
    assert [recording.next_record(step, 1) for step in (0, 4, 11, 17)] == [4, 5, 12, None]
    assert [recording.next_record(step, -1) for step in (17, 5, 4)] == [16, 4, None]
    assert recording.seek(6).point == "P3" and recording.seek(2).point is None
    assert (recording.frame.line, recording.frame.time) == (f"client1: {WORK[1]}", 20.0)
    assert recording.seek(4).origins["X"] == 5000.0
    assert [recording.find_step(words) for words in ("7", "70s", "0:01:10", "after the slip", "@2")] == [7, 7, 7, 13, 1]
    for words in ("18", "never noted", "@999", "1:00:00"):
        with pytest.raises(A7SimError, match=f"jump to {words}: expected a step up to 17, a time up to 170s"):
            recording.find_step(words)


def test_a_reply_that_differs_in_playback_is_reported(session: Path) -> None:
    journal = read_journal(session / "session.jsonl")
    reply = next(number for number in range(2, len(journal)) if journal.event(number).dir == "<")
    journal.lines[reply - 1] = journal.lines[reply - 1].replace(b'"text":"', b'"text":"9')
    recording = Recording(journal)
    assert recording.seek(3).error == ""
    assert f"line {reply}: expected again client1 < 9" in recording.seek(4).error


@pytest.mark.parametrize(
    ("address", "expected"), [("tcp://127.0.0.1:5025", True), ("clearing", False), ("runs/akwanga", False)]
)
def test_an_address_is_distinguished_from_a_session(address: str, expected: bool) -> None:
    assert is_url(address) is expected


def test_a_session_without_lines_is_refused_in_one_sentence(tmp_path: Path) -> None:
    scenario = load_scenario("akwanga")
    with Journal().recording(tmp_path, make_header("serve", scenario, 7), None):
        pass
    with pytest.raises(A7SimError, match="expected a session with lines on the link, got none"):
        open_recording(str(tmp_path))


# --- at the console -----------------------------------------------------------------------------------


def test_keys_step_through_a_recording_and_the_book_follows(session: Path) -> None:
    async def actions(person: Person) -> None:
        console = person.console
        assert progress(person) == f"paused (1x)  step 0 of {len(WORK)}  0:00:00"
        await person.press(".", ".", ".", ".")
        assert progress(person) == f"paused (1x)  step 4 of {len(WORK)}  0:00:40  client1: {WORK[3]}"
        assert [entry.point for entry in console.entries] == ["P1"] and console.point == "P1"
        assert console.dials.counters["X"] == "5001.00"
        await person.until(lambda: any(each.any() for each in console.sight.pictures.values()))
        await person.press(">", ">", ",")
        assert console.playback.frame.step == 5
        await person.press("g")
        await person.type_in("after the slip")
        assert [entry.point for entry in console.entries if entry.struck] == ["P3"]
        await person.press("<", "<")
        assert console.playback.frame.step == 11 and not any(entry.struck for entry in console.entries)
        await person.press("g")
        await person.type_in("99")
        assert person.message().startswith("jump to 99: expected a step up to 17")
        frame = "\n".join(await person.frame())
        assert "space play" in frame and "hands off" in frame and "P7" in frame

    watch(str(session), actions)


def test_in_playback_controls_are_disabled_with_one_sentence(session: Path) -> None:
    async def actions(person: Person) -> None:
        console = person.console
        await person.press(".", ".")
        before = console.dials
        for key in ("right", "+", "enter", "x", "l", ":", "s", "h", "f", "pageup"):
            console.say("")
            await person.press(key)
            assert person.message() == "hands are off: what you watch has been done; space plays and pauses", key
        console.post_message(DrumScrolled("X", 1))
        await person.settle()
        await person.press("m", "tab")
        assert console.dials == before and console.view.magnification == 12.0

    watch(str(session), actions)


def test_a_recording_plays_at_its_pace_to_its_end_and_again(session: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wall = [100.0]
    monkeypatch.setattr("a7sim.console.widgets.playback.monotonic", lambda: wall[0])

    async def actions(person: Person) -> None:
        playback = person.console.playback

        async def after(seconds: float) -> int:
            wall[0] += seconds
            playback.tick()
            await person.settle()
            return playback.frame.step

        await person.press("space")
        assert playback.playing and await after(0.0) == 0
        assert [await after(9.0), await after(2.0), await after(10.0)] == [0, 1, 2]
        await person.press("]")
        assert playback.speed == 10.0 and await after(0.0) == 2
        assert await after(3.1) == 5
        assert "playing 10x" in progress(person)
        await person.press("space")
        assert await after(100.0) == 5
        monkeypatch.setattr("a7sim.console.widgets.playback.RUN_S", -1.0)
        before = playback.frame.step
        await person.press("]", "]", "]", "space")
        assert math.isinf(playback.speed)
        await person.until(lambda: playback.frame.step > before)
        await person.until(lambda: not playback.playing)
        assert playback.frame.step == len(WORK) and person.message() == "the end of the session"
        await person.press("[", "[", "[", "space")
        assert playback.frame.step == 0 and playback.playing

    watch(str(session), actions)


def test_a_script_can_be_watched_in_words(session: Path) -> None:
    async def actions(person: Person) -> None:
        await person.press(">")
        assert "REC" in progress(person)
        await person.until(lambda: "1011: image is on the mark" in message_of_eye(person))
        assert person.message() == "1011: no y-parallax, no x-parallax"

    watch("clearing", actions, size=(80, 24), drawing=DrawingMode.WORDS)


def test_a_watching_console_shows_a_live_instrument_and_moves_nothing() -> None:
    with ServerThread(with_model().instrument) as served:
        url = f"tcp://127.0.0.1:{served.port}"
        console = Console(
            replace(remote_console(url, JobSheet("Akwanga"), None, watching=True), drawing=DrawingMode.HALVES)
        )

        async def perform() -> None:
            async with console.run_test(size=(100, 30)) as pilot:
                person = Person(pilot)
                await person.settle()
                with Client.open(url) as operator, operator.lock():
                    operator.send('WHE:X 3;:REC "P1";:REC "P2";:REC:STR 1,"a slip"')
                    await person.until(lambda: [entry.struck for entry in console.entries] == [True, False])
                    assert console.dials.counters["X"] == "3.00"
                    await person.press("right", "+", "enter", "x")
                    assert person.message() == f"hands are off: this console only watches {url}"
                    await person.press("space")
                    assert person.message() == f"there is nothing to play: this console only watches {url}"
                    assert operator.ask("COUN:X?;:REC:COUN?;:PROJ1:BY?") == "3.00;2;0.00"
                assert "m x8" in "\n".join(await person.frame())

        asyncio.run(perform())
