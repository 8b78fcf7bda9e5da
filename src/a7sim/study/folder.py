"""Folder of a study: results, tables, page and checkpoint, from which an interrupted study continues."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryFile

from a7sim.errors import A7SimError
from a7sim.journal.session_files import RESULTS, write_atomic
from a7sim.result_documents import Document, as_json
from a7sim.study import checkpoint
from a7sim.study.loading import LoadedStudy
from a7sim.study.page import study_page
from a7sim.study.simulating import replicate_seed
from a7sim.study.tally import Tally
from a7sim.table_files import to_csv

CELLS, COMPARISONS, REPLICATES, PAGE = (
    "cells.csv",
    "comparisons.csv",
    "replicates.csv",
    "study.html",
)
FILES = (*checkpoint.KINDS, CELLS, COMPARISONS, REPLICATES, PAGE, RESULTS)


def open_tally(loaded: LoadedStudy, out: Path | None, force: bool) -> Tally:
    """Create the folder and return the tally stored in it, or an empty tally.

    Raises A7SimError if the folder contains something else, unless `force` discards it.
    """
    empty = Tally.empty(len(loaded.cells), len(loaded.responses))
    if out is None:
        return empty
    try:
        if out.exists() and not out.is_dir():
            raise A7SimError(f"{out}: expected a folder, got a file")
        if out.is_dir() and not force:
            left = checkpoint.newest_checkpoint(out)
            if left is not None:
                _see_that_it_can_be_written(out)
                return _not_beyond(checkpoint.load(left, loaded.identity), loaded, left)
            if any(out.iterdir()):
                raise A7SimError(
                    f"{out}: expected an empty folder or that of a study, got another (--force writes there)"
                )
        out.mkdir(parents=True, exist_ok=True)
        _see_that_it_can_be_written(out)
        for name in FILES:
            (out / name).unlink(missing_ok=True)
    except OSError as error:
        raise A7SimError(f"{str(out)[:200]}: expected a folder that can be written: {error.strerror}") from error
    return empty


def _see_that_it_can_be_written(folder: Path) -> None:
    TemporaryFile(dir=folder).close()


def _not_beyond(tally: Tally, loaded: LoadedStudy, path: Path) -> Tally:
    done = int(tally.done.max())
    if done > loaded.replicates:
        raise A7SimError(f"{path}: expected at least the {done} replicates already done, got {loaded.replicates}")
    return tally


def write_results(out: Path, loaded: LoadedStudy, tally: Tally, document: Document) -> None:
    """Write results and tables into a folder."""
    write_atomic(out / CELLS, _cells_csv(document))
    write_atomic(out / COMPARISONS, _comparisons_csv(document))
    write_atomic(out / REPLICATES, _replicates_csv(loaded, tally))
    write_atomic(out / RESULTS, as_json(document))


def write_page(out: Path, document: Document) -> None:
    """Write the page into a folder. Raises A7SimError if matplotlib is not installed."""
    write_atomic(out / PAGE, study_page(document))


def _cells_csv(document: Document) -> str:
    factors = document["factors"]
    measured = ("count", "mean", "mean_low", "mean_high", "sd", "sd_low", "sd_high", "least", "largest")
    quantiles = list(next(_spreads(document), {"quantiles": {}})["quantiles"])
    header = ("cell", *factors, "response", "unit", *measured, *(f"quantile_{share}" for share in quantiles))
    rows = [
        (str(cell["cell"]), *cell["levels"].values(), response["name"], response["unit"], *_numbers(spread, quantiles))
        for cell in document["cells"]
        for response in document["responses"]
        if (spread := cell["responses"][response["name"]])["count"]
    ]
    return to_csv(header, rows)


def _spreads(document: Document) -> Iterator[Document]:
    yield from (each for cell in document["cells"] for each in cell["responses"].values() if each["count"])


def _numbers(spread: Document, quantiles: list[str]) -> tuple[str, ...]:
    values = (
        *(spread["mean"], *spread["mean_interval"]),
        *(spread["sd"], *spread["sd_interval"]),
        *(spread["least"], spread["largest"]),
        *(spread["quantiles"][share]["value"] for share in quantiles),
    )
    return str(spread["count"]), *(f"{value:.10g}" for value in values)


def _comparisons_csv(document: Document) -> str:
    header = ("response", "cell", "against", "pairs", "difference", "low", "high", "sd", "effect", "p", "p_adjusted")
    rows = []
    for each in document["comparisons"]:
        values = (each["difference"], *each["interval"], each["sd"], each["effect"], each["p"], each["p_adjusted"])
        whole = (each["response"], str(each["cell"]), str(each["against"]), str(each["pairs"]))
        rows.append((*whole, *(f"{value:.10g}" for value in values)))
    return to_csv(header, rows)


def _replicates_csv(loaded: LoadedStudy, tally: Tally) -> str:
    """Return the sample as CSV, one replicate per line; nan marks a session that gave up."""
    rows = (
        (
            str(cell.number),
            str(number),
            str(replicate_seed(loaded.study.seed, number - 1)),
            *(f"{each:.10g}" for each in values),
        )
        for i, cell in enumerate(loaded.cells)
        for number, values in enumerate(tally.sample(i).T.tolist(), start=1)
    )
    return to_csv(("cell", "replicate", "seed", *loaded.study.responses), rows)
