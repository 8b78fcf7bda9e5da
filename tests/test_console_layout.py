"""The console's layout, held against pictures that somebody has looked at (`pytest --snapshot-update` draws them anew).

The eyepieces show a test card; what they make of photographs is held by arrays in test_console_drawings.py.
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

Compared = Callable[..., bool]
Played = Callable[[Person], Awaitable[None]]

USUAL = (100, 30)


@pytest.fixture(autouse=True)
def _a_terminal_with_colours_and_utf8(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "C.UTF-8")
    monkeypatch.delenv("NO_COLOR", raising=False)


@pytest.fixture(autouse=True)
def _a_test_card_in_the_eyepieces(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(InstrumentThread, "_picture", lambda _, client, look, eye: card(look.rows, look.columns))


def card(rows: int, columns: int) -> Greys:
    """Return a test card: a light upright in the dark."""
    greys = np.zeros((rows, columns), dtype=np.uint8)
    greys[:, columns // 4] = 240
    return greys


def shown_as_before(compare: Compared, console: Console, size: tuple[int, int], play: Played | None = None) -> bool:
    """Whether a console looks as it did, once somebody has done something at it and all drums stand."""

    async def before(pilot: Pilot[None]) -> None:
        person = Person(pilot)
        await person.look_on()
        if play is not None:
            await play(person)
        await person.until(lambda: all(counter._frame >= 3 for counter in console.main.query(CounterPanel)))
        for asked in console.screen.query(Input):
            asked.cursor_blink = False

    return compare(console, terminal_size=size, run_before=before)


async def two_readings(person: Person) -> None:
    await person.press("enter")
    await person.type_in("1011")
    await person.press("y", "+", "enter", "x")


@pytest.mark.parametrize("size", [(80, 24), USUAL, (160, 48)], ids=lambda size: f"{size[0]}x{size[1]}")
def test_at_every_size(snap_compare: Compared, size: tuple[int, int]) -> None:
    assert shown_as_before(snap_compare, at(with_model()), size, two_readings)


@pytest.mark.parametrize("theme", ["dark", "light", "contrast"])
def test_in_every_theme(snap_compare: Compared, theme: str) -> None:
    assert shown_as_before(snap_compare, at(with_model(), theme=theme), USUAL)


def test_an_a8(snap_compare: Compared) -> None:
    console = at(EngineClient(SharedInstrument(build_autograph(load_scenario("akwanga-a8").instrument, {}, 7))))
    assert shown_as_before(snap_compare, console, USUAL)


def test_the_next_panel_on_a_narrow_screen(snap_compare: Compared) -> None:
    async def next_panel(person: Person) -> None:
        await person.press("tab")

    assert shown_as_before(snap_compare, at(with_model()), (80, 24), next_panel)


def test_help_with_keys_of_ones_own(snap_compare: Compared) -> None:
    keymap = {**default_keymap(), "record": ("space", "f5"), "help": ("?", "f1")}

    async def ask(person: Person) -> None:
        await person.press("f1", "end")

    assert shown_as_before(snap_compare, at(with_model(), keymap=keymap), USUAL, ask)


def test_the_bench(snap_compare: Compared) -> None:
    async def ask(person: Person) -> None:
        await person.press("l")

    assert shown_as_before(snap_compare, at(with_model()), USUAL, ask)


def test_a_reading_to_be_typed_in(snap_compare: Compared) -> None:
    async def ask(person: Person) -> None:
        await person.press("w", '"', "s")
        await person.press("9", "9")

    assert shown_as_before(snap_compare, at(with_model()), (80, 24), ask)


def test_a_first_visit_and_a_dead_link(snap_compare: Compared) -> None:
    async def fall_silent(person: Person) -> None:
        person.console._lose(ConnectionLost("the line is broken"))

    assert shown_as_before(snap_compare, at(with_model(), welcome=True), USUAL, fall_silent)


def test_in_words(snap_compare: Compared) -> None:
    console = at(with_model(), drawing=DrawingMode.WORDS, theme="contrast")

    async def go(person: Person) -> None:
        await person.press("g")
        await person.choose("1011  ")

    assert shown_as_before(snap_compare, console, USUAL, go)


def test_without_utf8(snap_compare: Compared, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("LC_ALL", "C")
    ascii_only: dict[str, Any] = {"drawing": DrawingMode.ASCII}
    assert shown_as_before(snap_compare, at(with_model(), **ascii_only), (80, 24))
