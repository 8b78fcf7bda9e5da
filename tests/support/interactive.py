"""A console driven by a test: keys pressed, and the screen read when the console is idle."""

import asyncio
from collections.abc import Callable
from typing import Any

from textual.events import Key
from textual.keys import _character_to_key
from textual.pilot import Pilot
from textual.widgets import Input, OptionList, Static

from a7sim.console.app import Console
from a7sim.console.config import ConsoleConfig
from a7sim.console.drawing.job_sheet import JobSheet
from a7sim.console.drawing.rasterize import DrawingMode, picture_size
from a7sim.console.state.selection import STEP_SIZES
from a7sim.console.widgets.eyepiece_widget import EyepieceWidget
from a7sim.instrument.language import Listener
from a7sim.link.client.client import Client
from a7sim.link.inprocess import InProcessSerial
from a7sim.scenario import load_scenario
from tests.support.engine_client import EngineClient, with_photographs

TIMEOUT_S = 20.0


def at(client: EngineClient, **others: Any) -> Console:
    """Return a console at the instrument of a client, pictures in half-blocks."""
    akwanga = load_scenario("akwanga")
    port = InProcessSerial(instrument=client.instrument, clock=client.clock, timeout=5.0)
    drawing = others.pop("drawing", DrawingMode.HALVES)
    sheet = JobSheet(akwanga.title, akwanga.camera)
    return Console(ConsoleConfig(lambda: Client(port), lambda: 0.0, sheet=sheet, drawing=drawing, **others))


def at_akwanga(listener: Listener | None = None, **others: Any) -> Console:
    """Return a console at Akwanga's instrument."""
    return at(with_photographs(listener), **others)


class Person:
    """A user of a console."""

    def __init__(self, pilot: Pilot[None]) -> None:
        self.pilot = pilot
        console = pilot.app
        assert isinstance(console, Console)
        self.console = console

    async def until(self, holds: Callable[[], object]) -> None:
        """Wait until a condition holds."""
        async with asyncio.timeout(TIMEOUT_S):
            while not holds():
                await asyncio.sleep(0.002)

    async def settle(self) -> None:
        """Wait until all actions are executed and shown."""
        await self.until(lambda: self.console.dials is not None and self._quiet() and self.console.thread.is_idle)
        for _ in range(5):
            await asyncio.sleep(0.0)
        await self.until(self._quiet)

    async def look_on(self) -> None:
        """Wait until the pictures of the eyepieces fill their windows."""
        await self.settle()
        await self.until(self._fills_the_windows)
        await self.settle()

    def _fills_the_windows(self) -> bool:
        console = self.console
        sizes = {picture_size(console.view.drawing, *eyepiece.cells) for eyepiece in console.main.query(EyepieceWidget)}
        sight = console.sight
        return sight is not None and sizes == {(sight.look.columns, sight.look.rows)}

    def _quiet(self) -> bool:
        """Return whether no message is waiting."""
        console = self.console
        pumps = [console, *console.screen_stack, *console.screen.walk_children()]
        return all(pump._message_queue.empty() for pump in pumps)

    async def press(self, *keys: str) -> None:
        """Press keys and wait until their effect is shown."""
        self.strike(*keys)
        await self.settle()

    def strike(self, *keys: str) -> None:
        """Press keys without waiting, one event for each."""
        for key in keys:
            name = _character_to_key(key) if len(key) == 1 else key
            self.console.post_message(Key(name, key if len(key) == 1 else None))

    async def choose(self, words: str) -> None:
        """Choose the option that contains `words` from the shown list, by arrow keys."""
        await self.until(lambda: self.console.screen.query(OptionList))
        listed = self.console.screen.query_one(OptionList)
        number = next(i for i in range(listed.option_count) if words in str(listed.get_option_at_index(i).prompt))
        self.strike("home", *["down"] * number, "enter")
        await self.settle()

    async def type_in(self, text: str) -> None:
        """Type a text and Enter."""
        await self.until(lambda: self.console.screen.query(Input))
        self.strike(*text, "enter")
        await self.settle()

    async def turn(self, amount: float, forward: str, back: str, finest: float = 0.01) -> None:
        """Turn by an amount, in the steps of the console from the largest to `finest`."""
        for step in sorted(STEP_SIZES, reverse=True):
            times = int(abs(amount) / step + 1e-6) if step > finest * 1.5 else round(abs(amount) / step)
            if step < finest or not times:
                continue
            await self.step_of(step)
            await self.press(*[forward if amount > 0 else back] * times)
            amount -= times * step * (1 if amount > 0 else -1)

    async def step_of(self, step: float) -> None:
        """Select a step size."""
        away = STEP_SIZES.index(step) - self.console.selection.step_index
        await self.press(*["]" if away > 0 else "["] * abs(away))

    def message(self) -> str:
        """Return the text of the message line."""
        return str(self.console.main.query_one("#message", Static).content)

    async def frame(self) -> list[str]:
        """Return the rows of the screen as text, after the layout."""
        await self.pilot.pause()
        compositor = self.console.screen._compositor
        return ["".join(segment.text for segment in strip) for strip in compositor.render_strips()]
