"""Make docs/studies/<name>.md, with figures in docs/figures/studies, of folders that `a7sim study --out` left.

Run `python -m docs.make_studies FOLDER...` at the top of the repository; a folder's name is that of its study.
"""

import sys
from pathlib import Path

import msgspec

from a7sim.study.page import study_markdown

DOCS = Path(__file__).parent
FIGURES = DOCS / "figures" / "studies"


def make(folder: Path) -> None:
    document = known(msgspec.json.decode((folder / "results.json").read_bytes()))
    name = folder.resolve().name
    text, figures = study_markdown(document, f"../figures/studies/{name}-")
    for old in FIGURES.glob(f"{name}-*.svg"):
        old.unlink()
    FIGURES.mkdir(parents=True, exist_ok=True)
    for figure, svg in figures.items():
        (FIGURES / f"{name}-{figure}").write_text(svg, encoding="utf-8")
    page = DOCS / "studies" / f"{name}.md"
    page.parent.mkdir(exist_ok=True)
    page.write_text(text, encoding="utf-8")
    sys.stdout.write(f"{page.relative_to(DOCS.parent)}: {document['in_a_sentence']}\n")


def known(value: object) -> object:
    """Return a document with nan where JSON says that there is no number."""
    if isinstance(value, dict):
        return {key: known(each) for key, each in value.items()}
    if isinstance(value, list):
        return [known(each) for each in value]
    return float("nan") if value is None else value


if __name__ == "__main__":
    for each in sys.argv[1:]:
        make(Path(each))
