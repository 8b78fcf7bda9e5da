"""`a7sim console`: sit down at the instrument."""

import sys
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from msgspec import structs

from a7sim.cli.browser import drawn_by_a_browser, in_a_browser, served_instead
from a7sim.cli.links import token_from
from a7sim.cli.prompt import data_folder
from a7sim.console.eyepiece import Drawing
from a7sim.console.words import ACUITY_UM
from a7sim.link.client import Client
from a7sim.link.clock import Clock
from a7sim.link.opening import TIMEOUT_S
from a7sim.mistakes import Mistake
from a7sim.scenario import Scenario, load_scenario

if TYPE_CHECKING:
    from a7sim.instrument.language import Desk

USUAL = "akwanga"
"""The scenario when nothing is named."""

THEMES = ("enamel", "dark", "light", "contrast")
KEYMAP, VISITED = "console-keys.toml", "console-visited"


@click.command("console")
@click.argument("scenario", required=False)
@click.option("--connect", metavar="URL", help="Sit down at a served instrument; SCENARIO is then the job sheet.")
@click.option("--seed", type=click.IntRange(min=0), help="Draws film and instrument.")
@click.option("--variant", type=click.Choice(["A7", "A8"], case_sensitive=False), help="Another plotter.")
@click.option("--theme", type=click.Choice(THEMES), help="Colours  [default: enamel]")
@click.option(
    "--drawing",
    type=click.Choice([each.value for each in Drawing]),
    help="How pictures are drawn  [default: the best there is]",
)
@click.option("--plain", is_flag=True, help="Say in words what the eyes see; nothing rolls. For screen readers.")
@click.option(
    "--acuity",
    type=click.FloatRange(min=0.0, min_open=True, max=1e4),
    default=ACUITY_UM,
    show_default=True,
    metavar="UM",
    help="What the eye tells apart, in words, at photo scale.",
)
@click.option("--keymap", type=click.Path(path_type=Path, dir_okay=False), help="File with keys of your own.")
@click.option("--write-keymap", is_flag=True, help="Write all keys to --keymap, or to the usual file, and end.")
@click.option("--token-file", type=click.Path(path_type=Path, dir_okay=False), help="File with a server's token.")
@in_a_browser
@click.pass_context
def command(
    context: click.Context,
    /,
    scenario: str | None,
    connect: str | None,
    seed: int | None,
    variant: str | None,
    theme: str | None,
    drawing: str | None,
    plain: bool,
    acuity: float,
    keymap: Path | None,
    write_keymap: bool,
    token_file: Path | None,
    **_browser: Any,
) -> None:
    """Sit down at the instrument of SCENARIO, or at a served one: the plotter on a terminal, for a person.

    Example: a7sim console akwanga
    """
    _see_that_textual_is_there()
    from a7sim.console.app import Console  # noqa: PLC0415 # only who sits down loads the screen
    from a7sim.console.keymap import default_keymap, load_keymap, sample  # noqa: PLC0415
    from a7sim.console.seat import Seat  # noqa: PLC0415
    from a7sim.console.sheet import JobSheet  # noqa: PLC0415

    if connect and (seed is not None or variant is not None):
        raise Mistake("--connect: expected neither --seed nor --variant, which are the served instrument's own")
    usual = data_folder() / KEYMAP
    if write_keymap:
        _write(keymap or usual, sample())
        return
    keys = load_keymap(keymap or usual) if keymap or usual.exists() else default_keymap()
    loaded = _scenario(scenario or USUAL, variant) if scenario or not connect else None
    began, clock = time.monotonic(), Clock()

    def at_the_instrument() -> float:
        clock.pass_to(time.monotonic() - began)
        return clock.now

    opened = _at_a_line(connect, token_file) if connect else _in_process(loaded, seed, clock)
    if served_instead(context):
        return
    if not (drawn_by_a_browser() or (sys.stdin.isatty() and sys.stderr.isatty())):
        raise Mistake("console: expected a terminal to sit at, got a file or a pipe (a7sim send takes lines from one)")
    sheet = JobSheet(loaded.title, loaded.camera) if loaded else JobSheet()
    Console(
        Seat(
            opened,
            at_the_instrument,
            alone=connect is None,
            where=connect or scenario or USUAL,
            sheet=sheet,
            keymap=keys,
            drawing=Drawing.WORDS if plain else Drawing(drawing) if drawing else None,
            acuity_um=acuity,
            theme=theme or ("contrast" if plain else "enamel"),
            welcome=_first_visit(),
        )
    ).run()


def _scenario(name: str, variant: str | None) -> Scenario:
    """Return a scenario at the plotter that is asked for; nobody works its plan here, so any will do."""
    loaded = load_scenario(name)
    if variant is None:
        return loaded
    return structs.replace(loaded, instrument=structs.replace(loaded.instrument, variant=variant.upper()))


def _see_that_textual_is_there() -> None:
    try:
        import textual  # noqa: F401, PLC0415
    except ImportError as error:
        raise Mistake("console: expected textual to be installed: pip install 'a7sim[console]'") from error


def _at_a_line(url: str, token_file: Path | None) -> Callable[[], Client]:
    token = token_from(token_file)
    Client.open(url, token=token).close()
    return lambda: Client.open(url, token=token)


def _in_process(scenario: Scenario | None, seed: int | None, clock: Clock) -> Callable[[], Client]:
    """Return what builds the instrument when it is first spoken to, while the screen is already there."""
    assert scenario is not None
    drawn_by = scenario.seed if seed is None else seed

    @cache
    def desk() -> "Desk":
        from a7sim.instrument import build_autograph  # noqa: PLC0415 # beside the first paint of the screen
        from a7sim.instrument.language import Desk  # noqa: PLC0415
        from a7sim.scene import build_scene  # noqa: PLC0415

        return Desk(build_autograph(scenario.instrument, build_scene(scenario, drawn_by).drawer, drawn_by))

    def opened() -> Client:
        from a7sim.link.inprocess import InProcessSerial  # noqa: PLC0415

        return Client(InProcessSerial(desk=desk(), clock=clock, timeout=TIMEOUT_S))

    return opened


def _first_visit() -> bool:
    """Return whether nobody has sat here before, and bear the visit in mind where that can be done."""
    visited = data_folder() / VISITED
    if visited.exists():
        return False
    try:
        visited.parent.mkdir(parents=True, exist_ok=True)
        visited.touch()
    except OSError:
        return False
    return True


def _write(path: Path, keys: str) -> None:
    if path.exists():
        raise Mistake(f"{path}: expected to write a new file, found one that exists")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(keys, encoding="utf-8")
    click.echo(path)
