"""The checklist of an exercise on the screen of the console is ticked by actions there (issue 8)."""

import asyncio
from pathlib import Path

from a7sim.console.app import Console
from a7sim.console.config import ConsoleConfig
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.link.client.client import Client
from a7sim.link.inprocess import InProcessSerial
from a7sim.training.attempts import start_attempt
from a7sim.training.catalogue import find_exercise
from a7sim.training.checklist import Checklist
from a7sim.training.progress import Progress
from tests.support.interactive import Person


def test_the_checklist_on_the_screen_is_ticked_by_keys(tmp_path: Path) -> None:
    exercise_folder = find_exercise("4")
    with Progress(tmp_path) as progress:
        attempt = progress.begin("ada", exercise_folder)

    async def operate(console: Console) -> None:
        async with console.run_test(size=(110, 34)) as pilot:
            person = Person(pilot)
            await person.settle()
            await person.until(lambda: "[ ] Register two readings of by' at point 1" in shown(console))
            await person.press("enter")
            await person.type_in("1011")
            await person.press("enter")
            await person.until(lambda: "[x] Register two readings of by' at point 1" in shown(console))
            assert "[ ] Do the same at points 2 to 6" in shown(console)
            await person.press("r")
            await person.type_in("A")
            assert person.message() == "recorded 3: A"

    with start_attempt(exercise_folder, attempt.seed, attempt.folder, "ada", attempt.mode) as environment:
        port = InProcessSerial(instrument=environment.instrument, clock=environment.clock, timeout=5.0)
        tasks = Checklist(environment, attempt).lines
        asyncio.run(
            operate(Console(ConsoleConfig(lambda: Client(port), lambda: 0.0, drawing=DrawingMode.HALVES, tasks=tasks)))
        )
        readings = environment.record().readings
        assert [(each.point, each.elements) for each in readings] == [("1011", ("by1",))] * 2 + [("A", ("by1",))]


def shown(console: Console) -> str:
    return str(console.main.query_one("#tasks").content)


def test_the_console_drives_to_points_with_a_gear_engaged_and_counters_preset(tmp_path: Path) -> None:
    """Exercise 9: its opening engages the gear, and its text gives COUN:X:PRES."""
    exercise_folder = find_exercise("9")

    async def operate(console: Console) -> None:
        async with console.run_test(size=(110, 34)) as pilot:
            person = Person(pilot)
            await person.settle()
            preset = "COUN:X:PRES 5000;:COUN:Y:PRES 5000"
            for point, line in (("1011", preset), ("1013", "COUN:Z:PRES 5000"), ("1025", "")):
                await person.press("g")
                await person.choose(point)
                assert person.message() == f"near point {point}"
                if line:
                    await person.press(":")
                    await person.type_in(line)

    with start_attempt(exercise_folder, 9, tmp_path, "ada", "practice") as environment:
        port = InProcessSerial(instrument=environment.instrument, clock=environment.clock, timeout=5.0)
        asyncio.run(operate(Console(ConsoleConfig(lambda: Client(port), lambda: 0.0, drawing=DrawingMode.HALVES))))
        assert abs(environment.autograph.counter("X") - 5000.0 - 194.99) < 15.0
