"""The console at its door: keys in, the screen out, and nothing said but the command language."""

import asyncio
from collections.abc import Coroutine
from typing import Any

import pytest

from a7sim.console.panels import Book, Eyepiece
from a7sim.instrument.language import LinkEvent
from a7sim.link.client import Client
from a7sim.link.inprocess import InProcessSerial
from tests.door import with_model, with_photographs
from tests.served import Served
from tests.sitting_down import Person, at, at_akwanga

POINTS = ("1021", "1011", "1023", "1013", "1025", "1015")


def played(sitting: Coroutine[Any, Any, None]) -> None:
    asyncio.run(sitting)


def test_a_person_orients_by_eye_and_what_is_recorded_is_what_the_same_lines_give_over_a_link() -> None:
    heard: list[LinkEvent] = []
    door = with_photographs(heard.append)
    console = at(door)
    eye = Client(InProcessSerial(desk=door.desk, clock=door.clock, timeout=5.0))

    def parallaxes(point: str) -> tuple[float, float]:
        px, py = eye.numbers(f'EYEP:STER? "{point}"')
        return px, py

    async def sit_down() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            for side, picture in (("left", "101"), ("right", "102")):
                await person.press("l")
                await person.choose(f"{side} projector: lay")
                await person.choose(picture)
                await person.press("l")
                await person.choose(f"{side} projector: centre")
                assert "with the film's shrinkage c is 152." in person.message()
            for c in ("c'", 'c"'):
                await person.press("l")
                await person.choose(f"{c} to 152.")
            await person.press("b", "s")
            await person.type_in("194.99")
            await person.press("d")
            await person.type_in("Z -317.5")
            await person.press("y", "'")
            for point in POINTS:
                await person.press("g")
                await person.choose(f"{point}  ")
                assert person.message() == f"near point {point}"
                px, _ = parallaxes(point)
                await person.turn(round(px * 1e-3 * 3.55, 1), "pageup", "pagedown", finest=0.1)
                _, before = parallaxes(point)
                await person.turn(round(before * 1e-3 * 2.08, 2), "+", "-")
                _, left = parallaxes(point)
                assert abs(left) < 0.05 * abs(before) + 12.0
                await person.press("enter")
            entries = console.entries
            assert [entry.point for entry in entries] == list(POINTS)
            assert all(name == "by'" for entry in entries for name, _ in entry.elements)
            shown = str(console.query_one(Book).render())
            assert all(point in shown for point in POINTS)
            await pilot.press("q")
        assert console.return_code == 0

    played(sit_down())
    _same_over_a_link(heard)


def _same_over_a_link(heard: list[LinkEvent]) -> None:
    """Every line that the console said gets the same reply from another instrument over TCP."""
    mine = next(event.client for event in heard)
    said = [event for event in heard if event.client == mine and "PICT" not in event.text]
    pictures = sum(event.direction == ">" and "PICT" in event.text for event in heard)
    assert pictures > 20
    replayed = 0
    with Served(with_photographs().desk) as served:
        line = served.line()
        replies = iter([event.text for event in said if event.direction == "<" and not event.text.startswith("#")])
        for event in said:
            if event.direction == ">" and "?" in event.text:
                assert line.ask(event.text) == next(replies)
                replayed += "REC:LAST?" in event.text
            elif event.direction == ">":
                line.send(event.text.encode() + b"\n")
    assert replayed == len(POINTS)
