"""The layout of the console, compared with checked snapshots (`pytest --snapshot-update` draws them again).

The eyepieces show a test card; test_console_drawings.py compares the drawing of photographs with arrays.
"""

from collections.abc import Awaitable, Callable
from typing import Any

import numpy as np
import pytest
from textual.pilot import Pilot
from textual.widgets import Input

from a7sim.console.app import Console
from a7sim.console.drawing.rasterize import DrawingMode, Greys
from a7sim.console.instrument_thread import ConnectionLost, InstrumentThread
from a7sim.console.keymap import default_keymap
from a7sim.console.widgets.drum_panels import CounterPanel
from a7sim.instrument import build_autograph
from a7sim.instrument.language import SharedInstrument
from a7sim.scenario import load_scenario
from tests.support.engine_client import EngineClient, with_model
from tests.support.interactive import Person, at

Comparison = Callable[..., bool]
Actions = Callable[[Person], Awaitable[None]]

USUAL = (100, 30)


@pytest.fixture(autouse=True)
def _a_terminal_with_colours_and_utf8(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "C.UTF-8")
    monkeypatch.delenv("NO_COLOR", raising=False)


@pytest.fixture(autouse=True)
def _a_test_card_in_the_eyepieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(InstrumentThread, "_picture", lambda _, client, look, eye: card(look.rows, look.columns))


def card(rows: int, columns: int) -> Greys:
    """Return a test card: a light vertical line on a dark ground."""
    greys = np.zeros((rows, columns), dtype=np.uint8)
    greys[:, columns // 4] = 240
    return greys


def equals_snapshot(compare: Comparison, console: Console, size: tuple[int, int], play: Actions | None = None) -> bool:
    """Return whether a console equals its snapshot after `play` and after all drums have stopped."""

    async def prepare(pilot: Pilot[None]) -> None:
        person = Person(pilot)
        await person.look_on()
        if play is not None:
            await play(person)
        await person.until(lambda: all(counter._frame >= 3 for counter in console.main.query(CounterPanel)))
        for field in console.screen.query(Input):
            field.cursor_blink = False

    return compare(console, terminal_size=size, run_before=prepare)


async def two_readings(person: Person) -> None:
    await person.press("enter")
    await person.type_in("1011")
    await person.press("y", "+", "enter", "x")


@pytest.mark.parametrize("size", [(80, 24), USUAL, (160, 48)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_at_every_size(snap_compare: Comparison, size: tuple[int, int]) -> None:
    assert equals_snapshot(snap_compare, at(with_model()), size, two_readings)


@pytest.mark.parametrize("theme", ["dark", "light", "contrast"])
def test_in_every_theme(snap_compare: Comparison, theme: str) -> None:
    assert equals_snapshot(snap_compare, at(with_model(), theme=theme), USUAL)


def test_an_a8(snap_compare: Comparison) -> None:
    console = at(EngineClient(SharedInstrument(build_autograph(load_scenario("akwanga-a8").instrument, {}, 7))))
    assert equals_snapshot(snap_compare, console, USUAL)


def test_the_next_panel_on_a_narrow_screen(snap_compare: Comparison) -> None:
    async def next_panel(person: Person) -> None:
        await person.press("tab")

    assert equals_snapshot(snap_compare, at(with_model()), (80, 24), next_panel)


def test_help_with_custom_keys(snap_compare: Comparison) -> None:
    keymap = {**default_keymap(), "record": ("space", "f5"), "help": ("?", "f1")}

    async def ask(person: Person) -> None:
        await person.press("f1", "end")

    assert equals_snapshot(snap_compare, at(with_model(), keymap=keymap), USUAL, ask)


def test_the_bench(snap_compare: Comparison) -> None:
    async def ask(person: Person) -> None:
        await person.press("l")

    assert equals_snapshot(snap_compare, at(with_model()), USUAL, ask)


def test_a_reading_to_be_typed_in(snap_compare: Comparison) -> None:
    async def ask(person: Person) -> None:
        await person.press("w", '"', "s")
        await person.press("9", "9")

    assert equals_snapshot(snap_compare, at(with_model()), (80, 24), ask)


def test_a_first_visit_and_a_dead_link(snap_compare: Comparison) -> None:
    async def lose_connection(person: Person) -> None:
        person.console._lose(ConnectionLost("the line is broken"))

    assert equals_snapshot(snap_compare, at(with_model(), welcome=True), USUAL, lose_connection)


def test_in_words(snap_compare: Comparison) -> None:
    console = at(with_model(), drawing=DrawingMode.WORDS, theme="contrast")

    async def go(person: Person) -> None:
        await person.press("g")
        await person.choose("1011  ")

    assert equals_snapshot(snap_compare, console, USUAL, go)


def test_without_utf8(snap_compare: Comparison, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "C")
    ascii_only: dict[str, Any] = {"drawing": DrawingMode.ASCII}
    assert equals_snapshot(snap_compare, at(with_model(), **ascii_only), (80, 24))
