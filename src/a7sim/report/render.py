"""Report of a session as one page."""

from a7sim.report.chapters import make_chapters
from a7sim.report.page import Paragraph, Part, page
from a7sim.report.session_folder import SessionFolder
from a7sim.result_documents import Document

_TITLES = {"run": "session", "calibrate": "test of the projectors", "compile": "map", "bridge": "bridging"}

_ENDS = {
    "does not fit": "The session ended before its end: it does not fit",
    "interrupted": "The session was interrupted; what there is until then is shown",
    "failed": "The session broke off; what there is until then is shown",
}


def render_report(kept: SessionFolder) -> str:
    """Return a session's report as a page of HTML. Raises A7SimError for damaged results or files."""
    with kept.reading_results():
        document = kept.document
        title = f"{document['scenario']}: {_TITLES[kept.command]}"
        return page(title, list(_lead(document)), list(make_chapters(kept)))


def _lead(document: Document) -> list[Part]:
    facts = [document.get("software", "a7sim"), f"seed {document['seed']}"]
    facts += [f"Wild {document['variant']}"] if "variant" in document else []
    facts += [f"{document['operator']['hours']:.1f} hours at the instrument"] if "operator" in document else []
    lead: list[Part] = [Paragraph(" · ".join(facts))]
    if document["status"] != "complete":
        words = _ENDS.get(document["status"], document["status"])
        lead.append(Paragraph(f"{words}: {document['message']}", loud=True))
    return lead
