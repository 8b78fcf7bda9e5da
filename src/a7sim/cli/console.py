"""`a7sim console`: operate the instrument in a terminal."""

import sys
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import click

from a7sim.cli import options
from a7sim.cli.browser import browser_options, is_browser_child, serve_in_browser
from a7sim.cli.completers import scenario_argument
from a7sim.cli.prompt import data_folder
from a7sim.console.drawing.descriptions import ACUITY_UM
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.errors import A7SimError
from a7sim.scenario import load_scenario

USUAL = "akwanga"
"""Default scenario."""

THEMES = ("enamel", "dark", "light", "contrast")
KEYMAP, VISITED = "console-keys.toml", "console-visited"


@click.command("console")
@click.argument("scenario", required=False, shell_complete=scenario_argument)
@click.option("--connect", metavar="URL", help="Sit down at a served instrument; SCENARIO is then the job sheet.")
@options.seed()
@options.variant()
@click.option("--theme", type=click.Choice(THEMES), help="Colours  [default: enamel]")
@click.option(
    "--drawing",
    type=click.Choice([each.value for each in DrawingMode]),
    help="How pictures are drawn  [default: the best there is]",
)
@options.plain
@click.option(
    "--acuity",
    type=options.NumberType(min=0.0, min_open=True, max=1e4),
    default=ACUITY_UM,
    show_default=True,
    metavar="UM",
    help="What the eye tells apart, in words, at photo scale.",
)
@click.option("--keymap", type=options.FILE, help="File with keys of your own.")
@click.option("--write-keymap", is_flag=True, help="Write all keys to --keymap, or to the usual file, and end.")
@options.out_folder("the session", "one among your data")
@click.option(
    "--go-on/--anew",
    "go_on",
    default=None,
    help="Go on with the last session, or begin another and keep it  [default: ask]",
)
@click.option(
    "--watch",
    metavar="SESSION|URL",
    help="Watch a session (folder, .jsonl, .a7s), or a served instrument that somebody works.",
)
@options.token_file
@browser_options
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
    out: Path | None,
    go_on: bool | None,
    watch: str | None,
    token_file: Path | None,
    **_browser: Any,
) -> None:
    """Operate the instrument of SCENARIO, or a served one, in a terminal.

    All actions are journalled, and the next console with the same scenario, seed and variant offers to resume.

    Example: a7sim console akwanga
    """
    _see_that_textual_is_there()
    from a7sim.cli.console_setup import LocalConsole, is_url, playback_console, remote_console  # only who sits down
    from a7sim.console.app import Console
    from a7sim.console.drawing.job_sheet import JobSheet
    from a7sim.console.keymap import default_keymap, load_keymap, sample

    _refuse_beside("--watch", watch, connect=connect, seed=seed, variant=variant, out=out, go_on=go_on)
    _refuse_beside("--connect", connect, seed=seed, variant=variant, out=out, go_on=go_on)
    usual = data_folder() / KEYMAP
    if write_keymap:
        _write(keymap or usual, sample())
        return
    keys = load_keymap(keymap or usual) if keymap or usual.exists() else default_keymap()
    here: LocalConsole | None = None
    if watch is not None and not is_url(watch):
        _refuse_beside("--watch", watch, scenario=scenario)
        config = playback_console(watch)
    elif url := watch or connect:
        loaded = load_scenario(scenario) if scenario else None
        sheet = JobSheet(loaded.title, loaded.camera) if loaded else JobSheet()
        config = remote_console(url, sheet, token_file, watching=watch is not None)
    else:
        name = scenario or USUAL
        overrides = {"instrument.variant": f'"{variant.upper()}"'} if variant else {}
        here = LocalConsole(name, load_scenario(name, overrides), seed, out, go_on)
        config = here.config
    if serve_in_browser(context):
        return
    if not (is_browser_child() or (sys.stdin.isatty() and sys.stderr.isatty())):
        raise A7SimError(
            "console: expected a terminal to sit at, got a file or a pipe (a7sim send takes lines from one)"
        )
    Console(
        replace(
            config,
            keymap=keys,
            drawing=DrawingMode.WORDS if plain else DrawingMode(drawing) if drawing else None,
            acuity_um=acuity,
            theme=theme or ("contrast" if plain else "enamel"),
            welcome=watch is None and _first_visit(),
        )
    ).run()
    kept = here.close() if here else None
    if kept is not None:
        click.echo(f"the session is kept in {kept}")


def _refuse_beside(option: str, given: str | None, **others: object) -> None:
    """Raise A7SimError if an option is combined with options of an instrument in this process."""
    if given is not None:
        words = {"scenario": "SCENARIO", "go_on": "--go-on" if others.get("go_on") else "--anew"}
        beside = [words.get(name, f"--{name}") for name, value in others.items() if value is not None]
        if beside:
            raise A7SimError(f"{option} {given}: expected no {' and no '.join(beside)} beside it")


def _see_that_textual_is_there() -> None:
    if find_spec("textual") is None:
        raise A7SimError("console: expected textual to be installed: pip install 'a7sim[console]'")


def _first_visit() -> bool:
    """Return whether this is the first use, and record it if possible."""
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
        raise A7SimError(f"{path}: expected to write a new file, found one that exists")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(keys, encoding="utf-8")
    click.echo(path)
