"""`a7sim compare`: differences between sessions."""

from pathlib import Path

import click

from a7sim.cli import options
from a7sim.errors import A7SimError


@click.command("compare")
@click.argument("folders", nargs=-1, required=True, type=options.PLACE, metavar="DIR DIR...")
@click.option("--all", "includes_equal", is_flag=True, help="Also list equal values.")
@options.as_document
def command(folders: tuple[Path, ...], includes_equal: bool, as_document: bool) -> None:
    """Compare the results of sessions: settings, elements, residuals, centres, strips, times, slips.

    Example: a7sim compare runs/akwanga runs/akwanga-e
    """
    from rich.console import Console

    from a7sim.report.comparison import compare_sessions, comparison_document, comparison_table
    from a7sim.report.session_folder import read_session
    from a7sim.result_documents import as_json

    if len(folders) < 2:
        raise A7SimError(f"compare: expected two folders of sessions or more, got one: {folders[0]}")
    sessions = [read_session(folder) for folder in folders]
    rows = compare_sessions(sessions, includes_equal)
    if as_document:
        click.echo(as_json(comparison_document(sessions, rows)), nl=False)
    else:
        console = Console()
        console.print(comparison_table(sessions, rows, console.width))
