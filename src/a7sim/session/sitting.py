"""A session from sitting down to the files it leaves, whatever is done in it."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from a7sim.documents import Document, as_json
from a7sim.mistakes import Mistake
from a7sim.operator import DoesNotFit, Person
from a7sim.reduction import Undetermined
from a7sim.scenario import Scenario
from a7sim.session.folder import BOOK, JOURNAL, RESULTS, write_whole
from a7sim.session.journal import Journal
from a7sim.session.results import of_operator, of_slips


def journal_header(scenario: Scenario, seed: int) -> dict[str, Any]:
    """Return what a journal says first of a session."""
    return {"scenario": scenario.title, "seed": seed, "variant": scenario.instrument.variant}


@contextmanager
def sitting(
    document: Document,
    person: Person,
    journal: Journal,
    header: Mapping[str, Any],
    out: Path | None = None,
    leaves: Callable[[], Mapping[str, str]] = dict,
    called: str = "session",
) -> Iterator[None]:
    """Let an operator work in the body, and say in the document how it ended and what the operator did.

    `status` becomes 'complete', 'does not fit' with the operator's `message`, 'interrupted', or 'failed' for what else
    the body raises; only that it does not fit goes no further. However it ends, with `out` the journal, the book, what
    `leaves` returns by file name, and the results are left there, whole.
    """
    document |= {"status": "failed", "message": ""}
    with journal.opened(out / JOURNAL if out else None, dict(header)):
        try:
            yield
            document["status"] = "complete"
        except (DoesNotFit, Undetermined) as trouble:
            document |= {"status": "does not fit", "message": str(trouble)}
        except Mistake as mistake:
            document["message"] = str(mistake)
            raise
        except KeyboardInterrupt:
            document |= {"status": "interrupted", "message": f"the {called} was interrupted"}
            raise
        finally:
            document |= {"operator": of_operator(person, journal.events), "truth": {"slips": of_slips(person)}}
            if out is not None:
                for name, text in {BOOK: person.book.as_csv(), **leaves(), RESULTS: as_json(document)}.items():
                    write_whole(out / name, text)
