"""The console: keys in, the screen out, and only the command language on the link."""

import asyncio
import threading
from collections.abc import Coroutine
from typing import Any

import pytest

from a7sim.console.actions.view import MAGNIFICATIONS
from a7sim.console.app import Console
from a7sim.console.config import ConsoleConfig
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.console.keymap import actions_for
from a7sim.console.widgets.drum_panels import DrumScrolled, ElementsPanel
from a7sim.console.widgets.eyepiece_widget import EyepieceWidget
from a7sim.console.widgets.panels import BookPanel
from a7sim.console.widgets.sketch_panel import PointClicked
from a7sim.instrument import build_autograph
from a7sim.instrument.language import LinkEvent, SharedInstrument
from a7sim.link.client.client import Client
from a7sim.link.inprocess import InProcessSerial
from a7sim.link.server.addresses import Address
from a7sim.link.server.serving import Endpoints
from a7sim.scenario import load_scenario
from tests.support.engine_client import EngineClient, with_model, with_photographs
from tests.support.interactive import Person, at, at_akwanga
from tests.support.server_thread import ServerThread

POINTS = ("1021", "1011", "1023", "1013", "1025", "1015")


def run_actions(actions: Coroutine[Any, Any, None]) -> None:
    asyncio.run(actions)


@pytest.mark.slow
def test_an_orientation_by_eye_is_recorded_as_by_the_same_lines_over_a_link() -> None:
    events: list[LinkEvent] = []
    engine = with_photographs(events.append)
    console = at(engine)
    eye = Client(InProcessSerial(instrument=engine.instrument, clock=engine.clock, timeout=5.0))

    def parallaxes(point: str) -> tuple[float, float]:
        px, py = eye.numbers(f'EYEP:STER? "{point}"')
        return px, py

    async def perform() -> None:
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
            shown = str(console.query_one(BookPanel).render())
            assert all(point in shown for point in POINTS)
            await pilot.press("q")
        assert console.return_code == 0

    run_actions(perform())
    _assert_same_over_a_link(events)


def _assert_same_over_a_link(events: list[LinkEvent]) -> None:
    """Every line that the console sent gets the same reply from another instrument over TCP."""
    mine = next(event.client for event in events if event.direction == ">")
    exchanged = [event for event in events if event.client == mine and "PICT" not in event.text]
    pictures = sum(event.direction == ">" and "PICT" in event.text for event in events)
    assert pictures > 20
    replayed = 0
    with ServerThread(with_photographs().instrument) as served:
        line = served.line()
        replies = iter([event.text for event in exchanged if event.direction == "<" and not event.text.startswith("#")])
        for event in exchanged:
            if event.direction == ">" and "?" in event.text:
                assert line.ask(event.text) == next(replies)
                replayed += "REC:LAST?" in event.text
            elif event.direction == ">":
                line.send(event.text.encode() + b"\n")
    assert replayed == len(POINTS)


def test_each_press_of_a_key_is_one_step() -> None:
    console = at_akwanga()

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            await person.press("right", "right", "]", "right", "up", "down", "pageup")
            assert dict(console.dials.counters) == {"X": "12.00", "Y": "0.00", "Z": "-290.00"}
            await person.press("[", "[", "[", "[", "w", '"', "+", "+", "-")
            assert console.dials.elements["omega2"] == "100.01"
            await person.press("[", "+")
            assert console.dials.elements["omega2"] == "100.01", "a drum stands between two counts"

    run_actions(perform())


def test_keys_pressed_before_the_connection_are_executed_after_it() -> None:
    engine = with_photographs()
    reachable = threading.Event()

    def connect() -> Client:
        assert reachable.wait(20.0)
        return Client(InProcessSerial(instrument=engine.instrument, clock=engine.clock, timeout=5.0))

    console = Console(ConsoleConfig(connect, lambda: 0.0, drawing=DrawingMode.HALVES))

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            person.strike("right", "right", "y", "s", *"12.5", "enter", "up", "]", "right")
            await pilot.pause()
            assert console.dials is None
            reachable.set()
            await person.until(lambda: console.dials is not None and console.dials.counters["X"] == "12.00")
            await person.settle()
            assert console.dials.counters == {"X": "12.00", "Y": "1.00", "Z": "-300.00"}
            assert console.dials.elements["by1"] == "12.50"
            await person.press("left")
            assert console.dials.counters["X"] == "2.00"

    run_actions(perform())


def test_free_hand_ignores_the_collars() -> None:
    console = at_akwanga()

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            console.thread.send("FITT:XCOL OUT")
            await person.press("right")
            assert console.dials.counters["X"] == "-1.00"
            await person.press("h", "right", "right")
            assert console.dials.counters["X"] == "1.00"
            await person.press("h", "right")
            assert console.dials.counters["X"] == "0.00"

    run_actions(perform())


def test_the_drum_under_the_mouse_turns_and_is_selected() -> None:
    """Scrolling turns a counter, or turns and selects an element of the projector under the mouse."""
    console = at_akwanga()

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()

            async def scroll(drum: str, steps: int) -> None:
                console.post_message(DrumScrolled(drum, steps))
                await person.settle()

            for drum, name, side in (("by2", "by", 2), ("kappa1", "kappa", 1), ("bx", "bx", 1)):
                before = float(console.dials.elements[drum])
                await scroll(drum, 0)
                assert float(console.dials.elements[drum]) == before
                await scroll(drum, 1)
                assert float(console.dials.elements[drum]) == pytest.approx(before + console.selection.step)
                assert (console.selection.name, console.selection.side) == (name, side)
            before = float(console.dials.counters["X"])
            await scroll("X", -1)
            assert float(console.dials.counters["X"]) == pytest.approx(before - console.selection.step)
            assert console.selection.name == "bx"

    run_actions(perform())


def test_in_free_hand_a_click_in_the_left_picture_moves_the_mark_to_that_place() -> None:
    """Right and up in the picture is right and up in the model. With handwheels a click moves nothing."""
    console = at_akwanga()

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.look_on()
            await person.press("down")
            at_wheels = dict(console.dials.counters)
            console.post_message(EyepieceWidget.Clicked(4, 2))
            await person.settle()
            assert console.dials.counters == at_wheels
            await person.press("h")
            await person.look_on()
            console.post_message(EyepieceWidget.Clicked(4, 2))
            await person.settle()
            moved = {axis: float(console.dials.counters[axis]) - float(at_wheels[axis]) for axis in "XYZ"}
            assert moved["X"] > 0.0 and moved["Z"] == 0.0
            assert abs(moved["Y"]) == pytest.approx(moved["X"], abs=0.02), "half-blocks are square: 4 across, 2 x 2 up"

    run_actions(perform())


def test_each_key_of_the_view_cycles_through_its_settings() -> None:
    """Eyes, merging and drawing repeat in a cycle; magnification stops at its ends."""
    console = at_akwanga()

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.look_on()
            for key, setting in (
                ("e", lambda view: view.eyes),
                ("a", lambda view: view.merged),
                ("v", lambda view: view.drawing),
            ):
                first, settings = setting(console.view), []
                while not settings or settings[-1] != first:
                    await person.press(key)
                    settings.append(setting(console.view))
                assert len(set(settings)) == len(settings) > 2
            for key, end in (("m", MAGNIFICATIONS[-1]), ("M", MAGNIFICATIONS[0])):
                await person.press(*[key] * (len(MAGNIFICATIONS) + 1))
                assert console.view.magnification == end

    run_actions(perform())


def test_a_refused_value_is_one_sentence_and_moves_nothing() -> None:
    console = at_akwanga()

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            await person.press("y", "s")
            await person.type_in("60")
            assert person.message() == "expected -50.00 to 50.00, got 60"
            assert console.dials.elements["by1"] == "0.00"
            await person.press("s")
            await person.type_in("sixty")
            assert person.message() == "set by' to: expected a number, got 'sixty'"

    run_actions(perform())


def test_a_refused_query_does_not_break_the_connection() -> None:
    engine = with_photographs()
    port = InProcessSerial(instrument=engine.instrument, clock=engine.clock, timeout=0.1)
    console = Console(ConsoleConfig(lambda: Client(port), lambda: 0.0))

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            answers: list[object] = []
            console.ask(lambda client: client.fields("PHOT1:FID?"), answers.append)
            await person.press("right")
            assert answers == [] and console.silent is None
            assert person.message() == "there is no picture in projector 1"
            assert console.dials.counters["X"] == "1.00"

    run_actions(perform())


def test_entries_of_the_book_are_struck_out_and_never_deleted() -> None:
    engine = with_model()
    console = at(engine)

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            await person.press("enter")
            await person.type_in("P1")
            await person.press("enter", "x", "x", "x")
            assert [entry.struck for entry in console.entries] == [True, True]
            assert person.message() == "there is nothing in the book to strike out"
            assert str(console.query_one(BookPanel).render()).startswith("x  1 P1")

    run_actions(perform())
    assert engine.query("REC:COUN?;:REC:LAST?").endswith('"struck: struck out at the console"')


def test_an_a8_has_the_same_controls_and_the_message_names_a_missing_element() -> None:
    akwanga = load_scenario("akwanga-a8")
    instrument = SharedInstrument(build_autograph(akwanga.instrument, {}, 7))
    console = at(EngineClient(instrument))

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            assert console.selection.element == "kappa1", "an A8 has no by"
            await person.press("y")
            assert person.message() == "an A8 has no by"
            await person.press("p", "+")
            assert console.dials.elements["common_phi"] == "101.00"

    run_actions(perform())


@pytest.mark.parametrize("size", [(80, 24), (100, 30), (160, 48)])
def test_eyepieces_and_counters_are_on_every_screen(size: tuple[int, int]) -> None:
    console = at(with_model())

    async def perform() -> None:
        async with console.run_test(size=size) as pilot:
            person = Person(pilot)
            await person.settle()
            frame = "\n".join(await person.frame())
            for words in ("left eye", "right eye", " X ", " Y ", " Z ", "elements", "book", "kappa", "? help"):
                assert words in frame
            assert ("sketch 101" in frame) == (size[0] >= 100), "sketches go first"
            assert ("fittings" in frame) == (size[0] >= 100), "then the fittings"
            assert all(eye.cells[0] % 2 and eye.cells[1] % 2 for eye in console.query(EyepieceWidget))
            await person.press("tab", "tab")
            assert size[0] >= 100 or "sketch 101" in "\n".join(await person.frame())

    run_actions(perform())


def test_a_resize_between_key_presses_only_changes_the_size() -> None:
    console = at(with_model())

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            person.strike("right", "right")
            await pilot.resize_terminal(80, 24)
            person.strike("right")
            await pilot.resize_terminal(160, 48)
            await person.settle()
            assert console.dials.counters["X"] == "3.00"
            assert console.sight.look.columns == console.query(EyepieceWidget).first().cells[0]

    run_actions(perform())


def test_without_a_change_no_widget_is_drawn() -> None:
    console = at(with_model())

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            await asyncio.sleep(0.3)
            drawn: list[object] = []
            for widget in console.screen.walk_children():
                widget.refresh = lambda *_, widget=widget, **__: drawn.append(widget)
            console.refresh_panels()
            console.draw()
            assert drawn == []

    run_actions(perform())


def test_drawing_in_words_describes_the_view() -> None:
    console = at(with_model(), drawing=DrawingMode.WORDS)

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            await person.press("g")
            await person.choose("1011  ")
            frame = "\n".join(await person.frame())
            assert "1011: image is about" in frame
            assert "1011: left image is about" in person.message()
            assert "▀" not in frame

    run_actions(perform())


def test_a_lost_connection_shows_a_banner_and_a_new_connection_is_used() -> None:
    first = ServerThread(with_photographs().instrument)
    first.__enter__()
    second = ServerThread(with_photographs().instrument, endpoints=Endpoints(tcp=[Address("127.0.0.1", first.port)]))
    url = f"tcp://127.0.0.1:{first.port}"
    console = Console(ConsoleConfig(lambda: Client.open(url, timeout=1.0), lambda: 0.0, alone=False))

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            await asyncio.to_thread(first.__exit__, None, None, None)
            person.strike("right")
            await person.until(lambda: console.silent is not None)
            assert "The instrument does not answer" in "\n".join(await person.frame())
            await asyncio.to_thread(second.__enter__)
            await person.until(lambda: console.silent is None)
            await person.press("up")
            assert console.dials.counters == {"X": "0.00", "Y": "1.00", "Z": "-300.00"}, "nothing is turned twice"
            assert "does not answer" not in "\n".join(await person.frame())
        await asyncio.to_thread(second.__exit__, None, None, None)

    run_actions(perform())


def test_a_change_of_theme_repaints_drums_and_mark() -> None:
    console = at(with_model())

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.look_on()
            elements, eye = console.query_one(ElementsPanel), console.query(EyepieceWidget).first()

            def colours() -> tuple[str, str]:
                strip = eye.render_line(eye.cells[1] // 2)
                mark = next(segment.style for segment in strip if segment.text == "•")
                return elements.like("drum").bgcolor.name, mark.color.name

            assert colours() == ("#16181a", "#ffd23f")
            console.theme = "contrast"
            await pilot.pause()
            assert colours() == ("#000000", "#ffff00")

    run_actions(perform())


def test_a_cancelled_question_sends_and_changes_nothing() -> None:
    """Escape cancels each question; a later answer is executed as usual."""
    events: list[LinkEvent] = []
    console = at_akwanga(events.append)

    def commands() -> list[str]:
        lines = [event.text for event in events if event.direction == ">"]
        return [line for line in lines if "?" not in line]

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            before, earlier = console.dials, commands()
            for key in "lrnd":
                await person.press(key)
                assert console.screen is not console.main
                await person.press("escape")
                assert console.screen is console.main
            for choice in ("left projector: lay", "height gear", "plan gear"):
                await person.press("l")
                await person.choose(choice)
                await person.press("escape")
                assert console.screen is console.main
            assert (console.dials, commands()) == (before, earlier)
            await person.press("l")
            await person.choose("plan gear")
            await person.type_in("1-2-1")
            await person.press("n")
            await person.type_in("all is well")
            assert commands()[len(earlier) :] == ['GEAR:PLAN "1-2-1"', 'NOTE "all is well"']
            assert person.message() == "noted: all is well"

    run_actions(perform())


def test_every_action_is_in_the_palette_with_its_group() -> None:
    console = at_akwanga()

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.settle()
            listed = {each.title: each for each in console.get_system_commands(console.screen)}
            for action in actions_for(watching=False):
                assert listed[action.description].help.startswith(f"{action.group}, ")
            listed["a smaller step"].callback()
            finer = console.selection.step
            listed["a larger step"].callback()
            assert console.selection.step > finer

    run_actions(perform())


def test_a_click_on_a_point_of_a_sketch_drives_to_it() -> None:
    console = at(with_model())

    async def perform() -> None:
        async with console.run_test(size=(100, 30)) as pilot:
            person = Person(pilot)
            await person.look_on()
            before = dict(console.dials.counters)
            console.post_message(PointClicked(1, "1013"))
            await person.settle()
            assert person.message() == "near point 1013"
            assert dict(console.dials.counters) != before

    run_actions(perform())
