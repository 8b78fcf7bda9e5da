"""Make the pictures of docs/tutorial.md and its book of six points, key by key.

Run `python -m docs.make_tutorial_pictures` at the top of the repository. The observer has no errors.
"""

import asyncio
import re
from pathlib import Path
from types import SimpleNamespace

from docs.make_guide_pictures import FIGURES, SIZE, Student, bare
from tests.support.engine_client import with_photographs
from tests.support.interactive import Person, at

from a7sim.scenario import load_scenario

PAGE = Path(__file__).parent / "tutorial.md"
POINTS = ("1021", "1011", "1023", "1013", "1025", "1015")
BEGIN, END = "<!-- book: written by make_tutorial_pictures.py -->", "<!-- end of book -->"


class Newcomer(Student):
    """Student who mounts two photographs, centres them and clears six points."""

    def __init__(self, person, door, photographed):
        super().__init__(
            person, SimpleNamespace(instrument=door.instrument, clock=door.clock, scenario=load_scenario("akwanga"))
        )
        self.photographed = photographed

    async def at_the_bench(self, *choices):
        await self.person.press("l")
        for words in choices:
            await self.person.choose(words)

    async def photograph(self, name):
        if self.photographed is None:
            return
        await self.person.look_on()
        await self.person.pilot.pause(1.2)
        self.photographed(name, bare(self.person.console.export_screenshot()))

    async def orient_the_interior(self):
        for side, picture, c in (("left", "101", "c' to 152."), ("right", "102", 'c" to 152.')):
            await self.at_the_bench(f"{side} projector: lay", picture)
            await self.at_the_bench(f"{side} projector: centre")
            await self.at_the_bench(c)

    async def set_the_base(self):
        await self.person.press("b", "s")
        await self.person.type_in("194.99")
        await self.person.press("d")
        await self.person.type_in("Z -317.5")

    async def clear_six_points(self):
        await self.person.press("y")
        for self.point in POINTS:
            await self.person.press("g")
            await self.person.choose(self.point)
            await self.set_down()
            if self.point == POINTS[0]:
                await self.photograph("2-parallax")
            await self.clear(-1.0)
            if self.point == POINTS[0]:
                await self.photograph("3-cleared")
            await self.register()

    def book(self):
        """Return the registrations: point, X, Y, Z, by'."""
        count = int(self.looker.ask("REC:COUN?"))
        replies = [self.looker.ask(f"REC? {number}").split(",") for number in range(1, count + 1)]
        return [(point.strip('"'), x, y, z, by) for _, point, x, y, z, _, by in replies]


async def afternoon(photographed=None):
    """Run the tutorial and return the book; `photographed`, if given, is called with name and SVG of each picture."""
    door = with_photographs()
    async with at(door).run_test(size=SIZE) as pilot:
        newcomer = Newcomer(Person(pilot), door, photographed)
        await newcomer.person.settle()
        await newcomer.orient_the_interior()
        await newcomer.photograph("1-laid")
        await newcomer.set_the_base()
        await newcomer.clear_six_points()
        await newcomer.photograph("4-six-points")
        return newcomer.book()


def with_book(text, book):
    """Return the page with the book of the six points made anew."""
    rows = ["| point | X | Y | Z | by' |", "| --- | --: | --: | --: | --: |"]
    rows += [f"| {' | '.join(each)} |" for each in book]
    return re.sub(f"(?<={BEGIN}\n).*?(?={END})", "\n".join(rows) + "\n", text, flags=re.DOTALL)


def main():
    def kept(name, svg):
        FIGURES.joinpath(f"tutorial-{name}.svg").write_text(svg, encoding="utf-8")

    book = asyncio.run(afternoon(kept))
    PAGE.write_text(with_book(PAGE.read_text(encoding="utf-8"), book), encoding="utf-8")


if __name__ == "__main__":
    main()
