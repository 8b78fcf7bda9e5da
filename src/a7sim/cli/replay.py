"""`a7sim replay`: a session replayed on a fresh instrument."""

import time
from contextlib import nullcontext
from pathlib import Path

import click

from a7sim.cli import EXIT_DIFFERS, options
from a7sim.cli.completers import session_argument
from a7sim.errors import A7SimError
from a7sim.journal.checkpoints import StateDifference
from a7sim.journal.find_line import find_line
from a7sim.journal.format import JournalFile, read_journal
from a7sim.journal.replay import Replay, ReplayDifference, knows_scenario, replay_lines
from a7sim.journal.script_runner import ScriptRunner
from a7sim.journal.scripts import SUFFIX, find_script, read_script
from a7sim.journal.session_files import JOURNAL, prepare_folder
from a7sim.journal.transcript import TranscriptListener, format_event
from a7sim.journal.writer import Journal, make_header
from a7sim.result_documents import as_json, document_header
from a7sim.scenario import load_scenario
from a7sim.text import pluralize

_MAX_PARTS = 20


@click.command("replay")
@click.argument("session", shell_complete=session_argument)
@click.option("--verify", is_flag=True, help="Stop at the first difference, with exit code 3.")
@click.option(
    "--speed",
    type=click.Choice(["1", "10", "max"]),
    default="max",
    show_default=True,
    help="Speed relative to the recorded session.",
)
@click.option(
    "--from",
    "begin",
    metavar="T|@LINE|TEXT",
    help="Start output at a time (s, h:mm:ss), @LINE or the first note that contains a text, such as a form.",
)
@options.instrument_of
@options.new_folder("the journal of a script")
@options.as_document
@options.quiet(but="the result, with --verify")
def command(
    session: str,
    verify: bool,
    speed: str,
    begin: str | None,
    scenario: str | None,
    out: Path | None,
    force: bool,
    as_document: bool,
    quiet: bool,
) -> None:
    """Replay a SESSION on a fresh instrument: a folder, a journal, or a script (.a7s).

    Example: a7sim replay runs/akwanga --verify --quiet
    """
    playback = PlaybackClock(float("inf") if speed == "max" else float(speed))
    silent = quiet or as_document
    if _is_script(session):
        if begin is not None:
            raise A7SimError("--from: expected a journal to seek in, got a script")
        if scenario is not None:
            raise A7SimError("--scenario: expected a journal, got a script, which names its own")
        play_script(session, playback, out, force, silent, as_document)
        return
    if out is not None:
        raise A7SimError("--out: expected a script, got a session, which already has a journal")
    path = Path(session)
    journalled = read_journal(path / JOURNAL if path.is_dir() else path)
    first = 2 if begin is None else _first_line(journalled, begin)
    if not (knows_scenario(journalled) or verify):
        _print_recording(journalled, first, playback, silent, as_document)
    else:
        replay = Replay(journalled, load_scenario(scenario) if scenario is not None else None)
        _print_replay(replay, first, verify, playback, silent, as_document)


class PlaybackClock:
    """Clock of the playback: output waits for its time in the session."""

    def __init__(self, speed: float) -> None:
        self._speed = speed
        self._begun: tuple[float, float] | None = None

    def until(self, now: float) -> None:
        """Wait until a time in the session, counted from the first call."""
        if self._begun is None:
            self._begun = time.monotonic(), now
        wall, session = self._begun
        due = wall + (now - session) / self._speed
        time.sleep(max(0.0, due - time.monotonic()))


def _is_script(session: str) -> bool:
    return session.endswith(SUFFIX) or ("/" not in session and not Path(session).exists())


def _first_line(journalled: JournalFile, begin: str) -> int:
    """Return the first line to be printed. Raises A7SimError if there is none."""
    found = find_line(journalled, begin)
    if found is None:
        raise A7SimError(f"--from {begin}: expected a time, @LINE or the text of a note within {journalled.path}")
    return found


def _print_recording(
    journalled: JournalFile, first: int, playback: PlaybackClock, silent: bool, as_document: bool
) -> None:
    """Print the traffic of a journal whose instrument cannot be rebuilt."""
    for number in range(first, len(journalled) + 1):
        event = journalled.event(number)
        playback.until(event.t)
        if not silent:
            click.echo(format_event(event))
    _print_summary(journalled, 0, None, 0, as_document, silent)


def _print_replay(
    replay: Replay, first: int, verify: bool, playback: PlaybackClock, silent: bool, as_document: bool
) -> None:
    journalled = replay.journalled
    start = replay.seek(first) if first > 2 else 2
    known = len(replay.checkpoints)
    differing = 0
    difference: ReplayDifference | None = None
    for number, event, line_difference in replay_lines(replay, start):
        if number >= first:
            playback.until(event.t)
            if not silent:
                click.echo(format_event(event))
        if line_difference is not None:
            differing += 1
            difference = difference or line_difference
            if verify:
                break
            if not silent:
                click.echo(f"{'differs':>10} {line_difference.replayed or 'nothing'}")
    if difference is None:
        difference = replay.final_difference()
        differing += difference is not None
    parts = () if difference is None else difference.parts or replay.state_differences(difference.line)
    if difference is not None and (verify or not silent):
        _print_difference(journalled, difference, parts)
    _print_summary(
        journalled, differing, difference, len(replay.checkpoints) - known, as_document, silent and not verify
    )
    if difference is not None and verify:
        raise click.exceptions.Exit(EXIT_DIFFERS)


def _print_difference(
    journalled: JournalFile, difference: ReplayDifference, parts: tuple[StateDifference, ...]
) -> None:
    click.echo(f"a7sim: {journalled.location(difference.line)}: the first difference", err=True)
    click.echo(f"a7sim: the journal has      {difference.journalled or 'nothing'}", err=True)
    click.echo(f"a7sim: the instrument says  {difference.replayed or 'nothing'}", err=True)
    for part in parts[:_MAX_PARTS]:
        click.echo(f"a7sim: state, {part.part}: {part.before} in the journal, {part.after} now", err=True)


def _print_summary(
    journalled: JournalFile,
    differing: int,
    difference: ReplayDifference | None,
    checkpoints: int,
    as_document: bool,
    silent: bool,
) -> None:
    lines = len(journalled) - 1
    torn_bytes = len(journalled.truncated_tail)
    if as_document:
        found = None
        if difference is not None:
            found = {"line": difference.line, "journal": difference.journalled, "instrument": difference.replayed}
        document = document_header("replay") | {
            "session": str(journalled.path),
            "status": "differs" if differing else "same",
            "lines": lines,
            "checkpoints": checkpoints,
            "torn_bytes": torn_bytes,
            "difference": found,
        }
        click.echo(as_json(document), nl=False)
    elif not silent:
        outcome = f"{differing} different" if differing else "no difference"
        tail = f"; a torn last line of {pluralize(torn_bytes, 'byte')} is left out" if torn_bytes else ""
        click.echo(f"{pluralize(lines, 'line')}, {pluralize(checkpoints, 'checkpoint')}: {outcome}{tail}")


def play_script(
    session: str, playback: PlaybackClock, out: Path | None, force: bool, silent: bool, as_document: bool
) -> None:
    """Run a script, and end with exit code 3 at a failed expectation."""
    script = read_script(find_script(session))
    journal = Journal()
    listener = TranscriptListener(
        lambda text: None if silent else click.echo(text), playback.until, journal.on_link_event
    )
    runner = ScriptRunner(script, listener.on_link_event)
    if out is not None:
        prepare_folder(out, force)
    header = make_header("replay", script.scenario, script.seed, script=script.file.name)
    with journal.recording(out, header, runner.instrument) if out else nullcontext():
        failed = runner.run()
    if as_document:
        document = document_header("replay") | {
            "session": str(script.file),
            "status": "differs" if failed else "same",
            "lines": len(script.statements),
            "difference": None
            if failed is None
            else {
                "line": failed.place.line,
                "file": str(failed.place.file),
                "expected": failed.expected,
                "got": failed.got,
            },
        }
        click.echo(as_json(document), nl=False)
    if failed is not None:
        click.echo(f"a7sim: {failed}", err=True)
        raise click.exceptions.Exit(EXIT_DIFFERS)
    if not silent:
        click.echo(f"{pluralize(len(script.statements), 'statement')}: all as expected")
