"""Command line: one click command per subcommand."""

import io
import sys

import click
from click.exceptions import NoArgsIsHelpError

import a7sim
from a7sim.cli.lazy_group import LazyCommand, LazyGroup
from a7sim.cli.usage_errors import format_usage_error
from a7sim.errors import A7SimError

EXIT_DOES_NOT_FIT, EXIT_USAGE, EXIT_DIFFERS, EXIT_INTERRUPTED = 1, 2, 3, 130

_COMMANDS = {
    "run": LazyCommand("a7sim.cli.run:command", "Run the virtual operator on a scenario, through to the strip."),
    "operate": LazyCommand("a7sim.cli.operate:command", "Run the virtual operator on a served instrument."),
    "compile": LazyCommand("a7sim.cli.compile:command", "Draw contours and lines of a model."),
    "calibrate": LazyCommand("a7sim.cli.calibrate:command", "Test both projectors with a grid plate."),
    "bridge": LazyCommand("a7sim.cli.bridge:command", "Bridge a strip at the instrument (aeropolygon)."),
    "prepare": LazyCommand("a7sim.cli.prepare:command", "Choose scales, gears, projection height and bx for a flight."),
    "reduce": LazyCommand("a7sim.cli.reduce:command", "Compute orientations, strips and blocks from files."),
    "scenario": LazyCommand("a7sim.cli.scenario:command", "Check scenario files and describe them."),
    "serve": LazyCommand("a7sim.cli.serve:command", "Serve an instrument on TCP, RFC 2217 and ptys."),
    "send": LazyCommand("a7sim.cli.send:command", "Send command lines to an instrument and print its replies."),
    "console": LazyCommand("a7sim.cli.console:command", "Operate the instrument yourself in a terminal."),
    "record": LazyCommand("a7sim.cli.record:command", "Record the traffic between a client and an instrument."),
    "replay": LazyCommand("a7sim.cli.replay:command", "Replay a session or a script on a fresh instrument."),
    "report": LazyCommand("a7sim.cli.report:command", "Write the report of a session as one page."),
    "export": LazyCommand("a7sim.cli.export:command", "Export a session as asciicast, book, forms or cards."),
    "compare": LazyCommand("a7sim.cli.compare:command", "Compare the results of sessions."),
    "train": LazyCommand("a7sim.cli.train:command", "Train on the plotter: exercises with hints and grades."),
    "study": LazyCommand("a7sim.cli.study:command", "Run a Monte Carlo study of a scenario."),
    "doctor": LazyCommand("a7sim.cli.doctor:command", "Report what is installed and what is missing."),
    "completion": LazyCommand("a7sim.cli.completion:command", "Print a shell completion script."),
}


@click.group(cls=LazyGroup, commands=_COMMANDS, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(a7sim.__version__, prog_name="a7sim")
@click.option("--debug", is_flag=True, help="Show the traceback of an error.")
def cli(debug: bool) -> None:
    """A simulated Wild A7 stereoplotter and its virtual operator.

    Example: a7sim run akwanga
    """


def main() -> None:
    """Run the command line; bad input gives one sentence and exit code 2."""
    arguments = [argument for argument in sys.argv[1:] if argument != "--debug"]
    debug = len(arguments) < len(sys.argv) - 1
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    try:
        code = cli.main(arguments, prog_name="a7sim", standalone_mode=False)
    except NoArgsIsHelpError as error:
        error.show()
        code = EXIT_USAGE
    except click.ClickException as error:
        if debug:
            raise
        click.echo(f"a7sim: {format_usage_error(error)}", err=True)
        code = EXIT_USAGE
    except (click.Abort, KeyboardInterrupt):
        if debug:
            raise
        click.echo("a7sim: interrupted", err=True)
        code = EXIT_INTERRUPTED
    except A7SimError as bad_input:
        if debug:
            raise
        for line in str(bad_input).splitlines():
            click.echo(f"a7sim: {line}", err=True)
        code = EXIT_USAGE
    except OSError as error:
        if debug:
            raise
        code = _report_os_error(error)
    sys.exit(code if isinstance(code, int) else 0)


def _report_os_error(error: OSError) -> int:
    """Print an error of the operating system; a closed output pipe is silent."""
    if isinstance(error, BrokenPipeError):
        sys.stdout = None
        return 1
    path = error.filename or "standard output"
    click.echo(f"a7sim: {path}: expected to be able to write and read: {error.strerror}", err=True)
    return EXIT_USAGE
