"""`a7sim study`: a Monte Carlo study of a scenario."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import click
from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from a7sim.cli import EXIT_DIFFERS, options
from a7sim.cli.completers import study_argument
from a7sim.errors import A7SimError
from a7sim.result_documents import Document, as_json
from a7sim.study.auditing import audit_study
from a7sim.study.checkpoint import checkpoint_path
from a7sim.study.executors import KINDS, Kind, open_executor
from a7sim.study.findings import findings_document
from a7sim.study.folder import open_tally, write_page, write_results
from a7sim.study.loading import LoadedStudy, load_study
from a7sim.study.running import run_study
from a7sim.study.tables import study_tables
from a7sim.study.tally import Tally
from a7sim.text import pluralize


@click.command("study")
@click.argument("study", shell_complete=study_argument)
@click.option("--replicates", type=int, metavar="N", help="Sessions per cell, instead of the number in STUDY.")
@click.option(
    "--executor",
    type=click.Choice(KINDS),
    default="pool",
    show_default=True,
    help="Where the work runs: in this process, a pool of processes, dask, or MPI.",
)
@click.option(
    "--workers",
    type=options.COUNT,
    metavar="N",
    help="Processes of the pool or of local dask; by default the number of cores.",
)
@click.option("--scheduler", metavar="URL", help="Scheduler of dask, such as tcp://HOST:8786; by default a local one.")
@click.option("--audit", type=options.COUNT, metavar="N", help="Run N selected sessions again over the link.")
@options.new_folder("checkpoint, tables, page and results; an interrupted study continues there")
@options.as_document
@options.quiet()
def command(
    study: str,
    replicates: int | None,
    executor: Kind,
    workers: int | None,
    scheduler: str | None,
    audit: int | None,
    out: Path | None,
    force: bool,
    as_document: bool,
    quiet: bool,
) -> None:
    """Run the cells of STUDY, a file or the name of one that comes with a7sim, and print the results.

    The same command continues an interrupted study, and with more --replicates a finished one. With --audit, exit code
    3 if a session over the link differs in any digit from the batch.

    With --executor mpi, start it as `mpiexec -n 5 a7sim study STUDY --executor mpi`: one process distributes, four run.

    Example: a7sim study levels --replicates 50 --out runs/levels --audit 4
    """
    loaded = load_study(study, replicates)
    with open_executor(executor, workers, scheduler) as (others, at_once):
        tally = open_tally(loaded, out, force)
        with _progress_bar(loaded, tally, as_document or quiet) as (progress, task):
            checkpoint = checkpoint_path(out) if out is not None else None
            run_study(loaded, tally, others, at_once, checkpoint, lambda done: progress.advance(task, done))
    document = findings_document(loaded, tally)
    if out is not None:
        write_results(out, loaded, tally, document)
        _write_page(out, document)
    if as_document:
        click.echo(as_json(document), nl=False)
    elif not quiet:
        Console().print(study_tables(document))
    if audit is not None:
        _audit(loaded, tally, audit, as_document or quiet)


def _write_page(out: Path, document: Document) -> None:
    """Write the page; without matplotlib only a message is printed."""
    try:
        write_page(out, document)
    except A7SimError as missing:
        click.echo(f"a7sim: {missing}", err=True)


def _audit(loaded: LoadedStudy, tally: Tally, picks: int, silent: bool) -> None:
    differences = audit_study(loaded, tally, picks)
    sessions = pluralize(min(picks, sum(tally.sample(i).shape[1] for i in range(len(loaded.cells)))), "session")
    if differences:
        click.echo(f"a7sim: {len(differences)} of {sessions} differ over the link; {differences[0]}", err=True)
        raise click.exceptions.Exit(EXIT_DIFFERS)
    if not silent:
        click.echo(f"{sessions} run again over the link: same digits.")


class _Rate(ProgressColumn):
    """Sessions per second."""

    def render(self, task: Task) -> Text:
        """Return the rate, once it is known."""
        return Text(f"{task.speed:.1f} a second" if task.speed else "")


@contextmanager
def _progress_bar(loaded: LoadedStudy, tally: Tally, silent: bool) -> Iterator[tuple[Progress, TaskID]]:
    """Show the progress of the sessions on a terminal, with rate and remaining time."""
    title = TextColumn(loaded.study.title, markup=False)
    columns = (title, BarColumn(), MofNCompleteColumn(), _Rate(), TimeRemainingColumn())
    hidden = silent or not sys.stderr.isatty()
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=hidden) as progress:
        total = loaded.replicates * len(loaded.cells)
        yield progress, progress.add_task("", total=total, completed=int(tally.done.sum()))
