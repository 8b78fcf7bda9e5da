"""The command line: one thin click command a verb."""

import io
import sys

import click

import a7sim
from a7sim.cli.verbs import Verbs
from a7sim.mistakes import Mistake

EXIT_DOES_NOT_FIT, EXIT_MISTAKE, EXIT_DIFFERS, EXIT_INTERRUPTED = 1, 2, 3, 130

_VERBS = {
    "run": "a7sim.cli.run:command",
    "operate": "a7sim.cli.operate:command",
    "send": "a7sim.cli.send:command",
    "compile": "a7sim.cli.compile:command",
    "calibrate": "a7sim.cli.calibrate:command",
    "reduce": "a7sim.cli.reduce:command",
    "scenario": "a7sim.cli.scenario:command",
    "prepare": "a7sim.cli.prepare:command",
    "bridge": "a7sim.cli.bridge:command",
    "serve": "a7sim.cli.serve:command",
    "replay": "a7sim.cli.replay:command",
    "record": "a7sim.cli.record:command",
    "report": "a7sim.cli.report:command",
    "export": "a7sim.cli.export:command",
    "compare": "a7sim.cli.compare:command",
    "console": "a7sim.cli.console:command",
    "train": "a7sim.cli.train:command",
    "study": "a7sim.cli.study:command",
}


@click.group(cls=Verbs, verbs=_VERBS, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(a7sim.__version__, prog_name="a7sim")
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
def cli(debug: bool) -> None:
    """A simulated Wild A7 stereoplotter and the operator who works it.

    Example: a7sim run akwanga
    """


def main() -> None:
    """Run the command line; bad input gets one sentence and exit code 2."""
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    debug = len(arguments) < len(sys.argv) - 1
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code = cli.main(arguments, prog_name="a7sim", standalone_mode=False)
    except click.ClickException as error:
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        if debug:
            raise
        click.echo("a7sim: interrupted", err=True)
        code = EXIT_INTERRUPTED
    except Mistake as mistake:
        if debug:
            raise
        for line in str(mistake).splitlines():
            click.echo(f"a7sim: {line}", err=True)
        code = EXIT_MISTAKE
    except OSError as error:
        if debug:
            raise
        code = _told(error)
    sys.exit(code if isinstance(code, int) else 0)


def _told(error: OSError) -> int:
    """Say what the operating system refused; a reader who went away needs to be told nothing."""
    if isinstance(error, BrokenPipeError):
        sys.stdout = None
        return 1
    place = error.filename or "standard output"
    click.echo(f"a7sim: {place}: expected to be able to write and read: {error.strerror}", err=True)
    return EXIT_MISTAKE
