"""Make the pictures of docs/student-guide.md: exercise 4 at the console, by its keys.

Run `python -m docs.make_guide_pictures` at the top of the repository. The observer has no errors.
"""

import asyncio
import re
import tempfile
from pathlib import Path

from tests.support.interactive import Person

from a7sim.console.app import Console
from a7sim.console.config import ConsoleConfig
from a7sim.console.drawing.job_sheet import JobSheet
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.link.client.client import Client
from a7sim.link.inprocess import InProcessSerial
from a7sim.training.attempts import start_attempt
from a7sim.training.catalogue import find_exercise
from a7sim.training.checklist import Checklist
from a7sim.training.progress import Progress

FIGURES = Path(__file__).parent / "figures"
SIZE = (104, 35)
LOOKS = 4
FIRST, *OTHERS = ("1011", "1013", "1015", "1021", "1023", "1025")


class Student:
    """Student without errors of sight at the console, whose screen is exported."""

    def __init__(self, person, room):
        self.person, self.room, self.point = person, room, FIRST
        self.looker = Client(InProcessSerial(instrument=room.instrument, clock=room.clock, timeout=5.0))
        plan, camera = room.scenario.plan, room.scenario.camera
        self.scale = 1e-3 * plan.projection_height / camera.c

    def seen(self):
        return self.looker.numbers(f'EYEP1? "{self.point}";:EYEP2? "{self.point}"')

    async def set_down(self):
        """Set the mark on the point and on the ground."""
        for _ in range(LOOKS):
            lx, _, rx, _ = self.seen()
            z, bx = self.looker.numbers("COUN:Z?;:BASE:BX?")
            await self.person.turn((lx - rx) * self.scale * -z / bx, "pageup", "pagedown")
            lx, ly, rx, ry = self.seen()
            await self.person.turn((lx + rx) / 2 * self.scale, "right", "left")
            await self.person.turn((ly + ry) / 2 * self.scale, "up", "down")

    async def clear(self, sense):
        """Turn the selected by until the images agree in height."""
        for _ in range(LOOKS):
            _, ly, _, ry = self.seen()
            await self.person.turn(-(ly - ry) * self.scale / sense, "+", "-")
            await self.set_down()

    async def register(self):
        await self.person.press("enter")

    async def twice(self):
        """Register, turn away and back, and register again."""
        await self.register()
        await self.person.turn(0.05, "+", "-")
        await self.person.turn(-0.05, "+", "-")
        await self.register()

    async def at_rest(self):
        """Set the selected by to zero."""
        await self.person.press("s")
        await self.person.type_in("0")

    async def measure(self, point):
        """Measure a point: by', then by"."""
        await self.at_rest()
        self.point = point
        await self.person.press("g")
        await self.person.choose(point)
        await self.set_down()
        for side, sense in (("'", -1.0), ('"', 1.0)):
            await self.person.press("y", side)
            await self.clear(sense)
            await self.twice()
            if side == "'":
                await self.at_rest()

    async def photograph(self, name):
        await self.person.look_on()
        await self.person.pilot.pause(1.2)
        FIGURES.joinpath(f"guide-{name}.svg").write_text(
            bare(self.person.console.export_screenshot()), encoding="utf-8"
        )


def bare(svg):
    """Return a picture without external resources, in a generic monospace font, without clip paths."""
    svg = re.sub(r"@font-face \{.*?\}\s*", "", svg, flags=re.DOTALL)
    svg = re.sub(r"font-family: ?[^;]*;", "font-family: monospace;", svg)
    svg = re.sub(r'<clipPath id="[^"]*-line-\d+">.*?</clipPath>\s*', "", svg, flags=re.DOTALL)
    svg = re.sub(r' clip-path="url\(#[^)]*-line-\d+\)"| shape-rendering="crispEdges"', "", svg)
    svg = re.sub(r"terminal-\d+-", "", svg).replace("<style>", "<style>rect { shape-rendering: crispEdges }", 1)
    return re.sub(r"(?<=[0-9])\.0(?=\")|\s+(?=\n)", "", svg)


async def work(console, room):
    async with console.run_test(size=SIZE) as pilot:
        student = Student(Person(pilot), room)
        person = student.person
        await person.settle()
        await person.press("g")
        await person.choose(FIRST)
        await person.step_of(1.0)
        await student.photograph("1-sat-down")
        await student.set_down()
        await student.photograph("2-on-the-ground")
        await person.press("y")
        await student.clear(-1.0)
        await student.photograph("3-cleared")
        await student.twice()
        await student.photograph("4-registered")
        await student.at_rest()
        await person.press('"')
        await student.clear(1.0)
        await student.twice()
        await student.photograph("5-other-eye")
        for point in OTHERS:
            await student.measure(point)
        await student.photograph("6-done")


def main():
    with tempfile.TemporaryDirectory() as place, Progress(Path(place)) as progress:
        exercise_folder = find_exercise("4")
        attempt = progress.begin("ada", exercise_folder)
        with start_attempt(exercise_folder, attempt.seed, attempt.folder, "ada", attempt.mode) as environment:
            port = InProcessSerial(instrument=environment.instrument, clock=environment.clock, timeout=5.0)
            config = ConsoleConfig(
                lambda: Client(port),
                lambda: environment.clock.now,
                where="exercise 4",
                sheet=JobSheet("exercise 4", environment.scenario.camera),
                drawing=DrawingMode.HALVES,
                tasks=Checklist(environment, attempt).lines,
            )
            asyncio.run(work(Console(config), environment))


if __name__ == "__main__":
    main()
