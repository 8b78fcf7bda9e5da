"""The checklist of an exercise on the console's screen: it ticks itself by what is done there (issue 8)."""

import asyncio
from pathlib import Path

from a7sim.console.app import Console
from a7sim.console.eyepiece import Drawing
from a7sim.console.seat import Seat
from a7sim.link.client import Client
from a7sim.link.inprocess import InProcessSerial
from a7sim.training.attempts import begun
from a7sim.training.checklist import Checklist
from a7sim.training.progress import Progress
from a7sim.training.shelf import find_exercise
from tests.sitting_down import Person


def test_the_checklist_on_the_screen_ticks_itself_as_keys_are_pressed(tmp_path: Path) -> None:
    shelved = find_exercise("4")
    with Progress(tmp_path) as progress:
        attempt = progress.begin("ada", shelved)

    async def sit_down(console: Console) -> None:
        async with console.run_test(size=(110, 34)) as pilot:
            person = Person(pilot)
            await person.settle()
            await person.until(lambda: "[ ] Register two readings of by' at point 1" in shown(console))
            await person.press("enter")
            await person.type_in("1011")
            await person.press("enter")
            await person.until(lambda: "[x] Register two readings of by' at point 1" in shown(console))
            assert "[ ] Do the same at points 2 to 6" in shown(console)

    with begun(shelved, attempt.seed, attempt.folder, "ada", attempt.mode) as room:
        port = InProcessSerial(desk=room.desk, clock=room.clock, timeout=5.0)
        tasks = Checklist(room, attempt).lines
        asyncio.run(sit_down(Console(Seat(lambda: Client(port), lambda: 0.0, drawing=Drawing.HALVES, tasks=tasks))))
        assert [each.named for each in room.account().readings] == [("by1",), ("by1",)]


def shown(console: Console) -> str:
    return str(console.main.query_one("#tasks").content)  # type: ignore[attr-defined]
