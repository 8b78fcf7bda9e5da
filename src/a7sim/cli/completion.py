"""`a7sim completion`: shell completion of commands, options and names."""

import os
import sys
from pathlib import Path

import click
from click.shell_completion import get_completion_class

from a7sim.errors import A7SimError

SHELLS = ("bash", "zsh", "fish")
VARIABLE = "_A7SIM_COMPLETE"
"""Set by the script when it queries completions."""


@click.command("completion")
@click.argument("shell", type=click.Choice(SHELLS), required=False)
def command(shell: str | None) -> None:
    """Print the script with which SHELL (the current one by default) completes a7sim commands.

    \b
    bash    eval "$(a7sim completion bash)"           in ~/.bashrc
    zsh     eval "$(a7sim completion zsh)"            in ~/.zshrc, after compinit
    fish    a7sim completion fish | source            in ~/.config/fish/config.fish

    Example: a7sim completion bash
    """
    shell = shell or Path(os.environ.get("SHELL", "")).name
    if shell not in SHELLS:
        raise A7SimError(f"completion: expected one of {', '.join(SHELLS)}, got {shell or 'no shell'}")
    script = get_completion_class(shell)
    if script is None:
        raise A7SimError(f"completion: expected a click that knows {shell}, got {sys.modules['click'].__name__}")
    click.echo(script(click.get_current_context().find_root().command, {}, "a7sim", VARIABLE).source())
