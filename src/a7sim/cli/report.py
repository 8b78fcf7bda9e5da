"""`a7sim report`: a session on one page of HTML."""

import webbrowser
from pathlib import Path

import click

from a7sim.cli import options


@click.command("report")
@click.argument("folder", type=options.PLACE, metavar="DIR")
@options.out_file("the page", "DIR/report.html")
@click.option("--open", "opens_browser", is_flag=True, help="Open the page in the browser.")
def command(folder: Path, out: Path | None, opens_browser: bool) -> None:
    """Write the report of the session in DIR: figures, tables and settings on one self-contained page.

    Example: a7sim report runs/akwanga --open
    """
    from a7sim.journal.session_files import REPORT, write_atomic
    from a7sim.report.render import render_report
    from a7sim.report.session_folder import read_session

    out = out or folder / REPORT
    write_atomic(out, render_report(read_session(folder)))
    click.echo(str(out))
    if opens_browser:
        webbrowser.open(out.resolve().as_uri())
