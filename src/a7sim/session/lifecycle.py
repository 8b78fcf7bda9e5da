"""Lifecycle of a recorded session: start, end, and its files."""

import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Protocol

from a7sim.errors import A7SimError
from a7sim.instrument.language import SharedInstrument
from a7sim.journal.session_files import BOOK, RESULTS, write_atomic
from a7sim.journal.writer import Header, Journal
from a7sim.operator import OperatorGaveUp, Person
from a7sim.reduction import Undetermined
from a7sim.result_documents import Document, as_json
from a7sim.session.results import operator_document, slips_document


class SeatedOperator(Protocol):
    """Operator at a shared instrument."""

    person: Person
    instrument: SharedInstrument


@contextmanager
def recorded_session(
    document: Document,
    seated: SeatedOperator,
    journal: Journal,
    header: Header,
    out: Path | None = None,
    leaves: Callable[[], Mapping[str, str]] = dict,
    called: str = "session",
) -> Iterator[None]:
    """Record the session of an operator in the body, and write its end and its acts into the document.

    `status` becomes 'complete', 'does not fit' with the operator's `message`, 'interrupted', or 'failed' for any other
    exception of the body; only OperatorGaveUp is not raised again. However it ends, with `out` the journal, the book,
    the files returned by `leaves`, and the results are written completely.
    """
    document |= {"status": "failed", "message": ""}
    person = seated.person
    with journal.recording(out, header, seated.instrument):
        person.book.listener = lambda entry: journal.on_book_entry(entry, person.clock.now)
        try:
            yield
            document["status"] = "complete"
        except (OperatorGaveUp, Undetermined) as error:
            document |= {"status": "does not fit", "message": str(error)}
        except A7SimError as error:
            document["message"] = str(error)
            raise
        except KeyboardInterrupt:
            document |= {"status": "interrupted", "message": f"the {called} was interrupted"}
            raise
        finally:
            document |= {
                "operator": operator_document(person, journal.lines_over_the_link),
                "truth": {"slips": slips_document(person)},
            }
            if out is not None:
                _leave(out, {BOOK: person.book.as_csv(), **leaves(), RESULTS: as_json(document)})


def _leave(out: Path, files: Mapping[str, str]) -> None:
    """Write files into a folder; if that fails after an earlier error, the earlier error is raised."""
    wrong_before = sys.exception()
    try:
        for name, text in files.items():
            write_atomic(out / name, text)
    except OSError:
        if wrong_before is None:
            raise
