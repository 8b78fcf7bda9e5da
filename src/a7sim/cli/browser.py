"""`a7sim console --browser`: the console served to browsers of this machine."""

import os
import sys
from collections.abc import Callable
from typing import Any

import click
from click.core import ParameterSource

from a7sim.cli.options import NumberType
from a7sim.errors import A7SimError

PORT, IDLE_MIN = 8515, 30.0

_OPTIONS = (
    click.option("--browser", is_flag=True, help="Serve the console to browsers on this machine."),
    click.option(
        "--port",
        type=click.IntRange(0, 65535),
        metavar="N",
        default=PORT,
        show_default=True,
        help="Port for browsers; 0 for any free port.",
    ),
    click.option(
        "--idle-exit",
        type=NumberType(min=0.0, min_open=True, max=1e5),
        default=IDLE_MIN,
        show_default=True,
        metavar="MIN",
        help="End after this many minutes without a browser.",
    ),
)
_BROWSER_PARAMETERS = ("browser", "port", "idle_exit")


def browser_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add the options of a console that is served to browsers."""
    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def is_browser_child() -> bool:
    """Return whether this process draws for a browser, as set by its server."""
    return "TEXTUAL_DRIVER" in os.environ


def serve_in_browser(context: click.Context) -> bool:
    """Serve the command of a context without its browser option until it ends or is idle; False if not requested."""
    if not context.params["browser"]:
        _check_without_browser(context)
        return False
    try:
        from a7sim.console.browser import serve  # only a browser's console needs the server
    except ImportError as error:
        raise A7SimError("--browser: expected textual-serve to be installed: pip install 'a7sim[browser]'") from error
    minutes = f"{context.params['idle_exit']:g} min"

    def announce(url: str) -> None:
        click.echo(f"{url}  (Ctrl+C ends it, and so do {minutes} without a browser)")
        sys.stdout.flush()

    os.environ["LC_ALL"] = "C.UTF-8"
    if serve(_command_without_browser(context), context.params["port"], 60.0 * context.params["idle_exit"], announce):
        click.echo(f"no browser for {minutes}: ended")
    return True


def _check_without_browser(context: click.Context) -> None:
    given = [name for name in _BROWSER_PARAMETERS if _is_given(context, name)]
    if given:
        raise A7SimError(f"--{given[0].replace('_', '-')}: expected --browser beside it")


def _is_given(context: click.Context, name: str) -> bool:
    return context.get_parameter_source(name) is not ParameterSource.DEFAULT


def _command_without_browser(context: click.Context) -> list[str]:
    """Return the words that start the same command without its browser."""
    words = [sys.executable, "-m", "a7sim", "console"]
    for parameter in context.command.params:
        name, value = str(parameter.name), context.params.get(str(parameter.name))
        if name not in _BROWSER_PARAMETERS and value is not None and _is_given(context, name):
            words += _arguments(parameter, value)
    return words


def _arguments(parameter: click.Parameter, value: Any) -> list[str]:
    if isinstance(parameter, click.Argument):
        return [str(value)]
    if isinstance(parameter, click.Option) and parameter.is_flag:
        return parameter.opts[:1] if value else parameter.secondary_opts[:1]
    return [parameter.opts[0], str(value)]
