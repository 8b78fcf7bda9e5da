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
from a7sim.cli.renamed import command_with_renamed_options
from a7sim.console.drawing.descriptions import ACUITY_UM
from a7sim.console.drawing.rasterize import DrawingMode
from a7sim.errors import A7SimError
from a7sim.scenario import load_scenario

DEFAULT_SCENARIO = "akwanga"
"""Default scenario."""

THEMES = ("enamel", "dark", "light", "contrast")
KEYMAP, VISITED = "console-keys.toml", "console-visited"


@click.command("console", cls=command_with_renamed_options({"--go-on": "--resume", "--anew": "--new"}))
@click.argument("scenario", required=False, shell_complete=scenario_argument)
@click.option("--connect", metavar="URL", help="Connect to a served instrument; SCENARIO is then the job sheet.")
@options.seed()
@options.variant()
@click.option("--theme", type=click.Choice(THEMES), help="Colours  [default: enamel]")
@click.option(
    "--drawing",
    type=click.Choice([each.value for each in DrawingMode]),
    help="Drawing mode of pictures  [default: the best of the terminal]",
)
@options.plain
@click.option(
    "--acuity",
    type=options.NumberType(min=0.0, min_open=True, max=1e4),
    default=ACUITY_UM,
    show_default=True,
    metavar="UM",
    help="Acuity of the eye for descriptions, at photo scale.",
)
@click.option("--keymap", type=options.FILE, help="Keymap file.")
@click.option("--write-keymap", is_flag=True, help="Write all keys to --keymap, or to the default file, and exit.")
@options.out_folder("the session", "in your data folder")
@click.option(
    "--resume/--new",
    "resume",
    default=None,
    help="Resume the last session, or start another and keep it  [default: ask]",
)
@click.option(
    "--watch",
    metavar="SESSION|URL",
    help="Watch a session (folder, .jsonl, .a7s), or a served instrument in use.",
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
    resume: bool | None,
    watch: str | None,
    token_file: Path | None,
    **_browser: Any,
) -> None:
    """Operate the instrument of SCENARIO, or a served one, in a terminal.

    All actions are journalled, and the next console with the same scenario, seed and variant offers to resume.

    Example: a7sim console akwanga
    """
    _require_textual()
    from a7sim.cli.console_setup import LocalConsole, is_url, playback_console, remote_console
    from a7sim.console.app import Console
    from a7sim.console.drawing.job_sheet import JobSheet
    from a7sim.console.keymap import default_keymap, load_keymap, sample

    _check_not_combined("--watch", watch, connect=connect, seed=seed, variant=variant, out=out, resume=resume)
    _check_not_combined("--connect", connect, seed=seed, variant=variant, out=out, resume=resume)
    default_file = data_folder() / KEYMAP
    if write_keymap:
        _write_keymap(keymap or default_file, sample())
        return
    keys = load_keymap(keymap or default_file) if keymap or default_file.exists() else default_keymap()
    local: LocalConsole | None = None
    if watch is not None and not is_url(watch):
        _check_not_combined("--watch", watch, scenario=scenario)
        config = playback_console(watch)
    elif url := watch or connect:
        loaded = load_scenario(scenario) if scenario else None
        sheet = JobSheet(loaded.title, loaded.camera) if loaded else JobSheet()
        config = remote_console(url, sheet, token_file, watching=watch is not None)
    else:
        name = scenario or DEFAULT_SCENARIO
        overrides = {"instrument.variant": f'"{variant.upper()}"'} if variant else {}
        local = LocalConsole(name, load_scenario(name, overrides), seed, out, resume)
        config = local.config
    if serve_in_browser(context):
        return
    if not (is_browser_child() or (sys.stdin.isatty() and sys.stderr.isatty())):
        raise A7SimError("console: expected a terminal, got a file or a pipe (a7sim send takes lines from one)")
    Console(
        replace(
            config,
            keymap=keys,
            drawing=DrawingMode.WORDS if plain else DrawingMode(drawing) if drawing else None,
            acuity_um=acuity,
            theme=theme or ("contrast" if plain else "enamel"),
            welcome=watch is None and _is_first_use(),
        )
    ).run()
    saved = local.close() if local else None
    if saved is not None:
        click.echo(f"session saved in {saved}")


def _check_not_combined(option: str, given: str | None, **others: object) -> None:
    """Raise A7SimError if an option is combined with options of an instrument in this process."""
    if given is not None:
        labels = {"scenario": "SCENARIO", "resume": "--resume" if others.get("resume") else "--new"}
        conflicts = [labels.get(name, f"--{name}") for name, value in others.items() if value is not None]
        if conflicts:
            raise A7SimError(f"{option} {given}: expected no {' and no '.join(conflicts)} beside it")


def _require_textual() -> None:
    if find_spec("textual") is None:
        raise A7SimError("console: expected textual to be installed: pip install 'a7sim[console]'")


def _is_first_use() -> bool:
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


def _write_keymap(path: Path, keys: str) -> None:
    if path.exists():
        raise A7SimError(f"{path}: expected to write a new file, found one that exists")
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(keys, encoding="utf-8")
    click.echo(path)
