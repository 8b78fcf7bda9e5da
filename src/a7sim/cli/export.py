"""`a7sim export`: a session in other formats."""

from collections.abc import Callable
from pathlib import Path

import click

from a7sim.cli import options
from a7sim.cli.renamed import command_with_renamed_options
from a7sim.errors import A7SimError
from a7sim.journal.session_files import BOOK, write_atomic
from a7sim.report.asciicast import make_cast
from a7sim.report.card_decks import strip_deck
from a7sim.report.forms import forms_text
from a7sim.report.session_folder import SessionFolder, read_session

_KIND_OF_OPTION = {"speed": "asciicast", "method": "cards"}


@click.command("export", cls=command_with_renamed_options({"--way": "--method"}))
@click.argument("folder", type=options.PLACE, metavar="DIR")
@click.option(
    "--to",
    "kind",
    required=True,
    type=click.Choice(["asciicast", "book", "forms", "cards"]),
    help="A terminal recording, the observation book as CSV or on printed forms, or N.R.C. cards.",
)
@options.out_file("the export", "standard output")
@click.option(
    "--speed",
    type=options.greater_than(0.0),
    help="asciicast: multiple of the original speed  [default: 120]",
)
@click.option("--method", metavar="METHOD", help="cards: comparator or A8, for a strip measured by this method.")
def command(folder: Path, kind: str, out: Path | None, speed: float | None, method: str | None) -> None:
    """Export the session in DIR to another format.

    Example: a7sim export runs/akwanga --to asciicast --out akwanga.cast
    """
    for name, value in (("speed", speed), ("method", method)):
        if value is not None and kind != _KIND_OF_OPTION[name]:
            raise A7SimError(f"--{name}: expected only with --to {_KIND_OF_OPTION[name]}, got it with --to {kind}")
    session = read_session(folder)
    makers: dict[str, Callable[[], str]] = {
        "asciicast": lambda: make_cast(session, speed or 120.0),
        "book": lambda: _book(session),
        "forms": lambda: forms_text(session),
        "cards": lambda: strip_deck(session, method),
    }
    text = makers[kind]()
    if out is None:
        click.echo(text, nl=False)
    else:
        write_atomic(out, text)
        click.echo(str(out))


def _book(session: SessionFolder) -> str:
    if not session.book:
        raise A7SimError(f"{session.folder / BOOK}: expected an observation book with entries, got none")
    return session.text(BOOK)
