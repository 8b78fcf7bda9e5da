"""Write the pages of docs/reference, the list of decisions and the picture of the packages, each from the thing itself.

python docs/make_reference.py            # writes them
python docs/make_reference.py --check    # says whether they are fresh, exit code 1 if not
"""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from makers import commands, files, packages, schemas

DOCS = Path(__file__).parent


def decisions_page():
    """Return the table of decisions with status, date and summary, read from their files."""
    lines = [
        *("# Decisions", "", "The reason for each choice of design, and every assumption without a source.", ""),
        *("| number | title | status | date | summary |", "| ---: | --- | --- | --- | --- |"),
    ]
    for path in sorted((DOCS / "decisions").glob("0*.md")):
        text = path.read_text(encoding="utf-8")
        number, title = text.splitlines()[0].removeprefix("# ").split(". ", 1)
        block = dict(re.findall(r"^- \*\*(\w+):\*\* (.*(?:\n  .*)*)", text, re.M))
        summary = " ".join(block["Summary"].split())
        lines.append(f"| {number} | [{title}]({path.name}) | {block['Status']} | {block['Date']} | {summary} |")
    return "\n".join(lines) + "\n"


def pages(session):
    """Return every page by its path in docs; `session` is the folder of Akwanga's session with seed 7."""
    return {
        "reference/commands.md": commands.page(),
        "reference/scenario.md": schemas.scenario_page(),
        "reference/exercise.md": schemas.exercise_page(),
        "reference/study.md": schemas.study_page(),
        "reference/files.md": files.page(session),
        "decisions/index.md": decisions_page(),
        "figures/packages.svg": packages.picture(),
    }


def stale(session):
    """Return the pages that are not what they would be made."""
    made = pages(session)
    return [
        name for name, text in made.items() if not (DOCS / name).is_file() or (DOCS / name).read_text("utf-8") != text
    ]


def main():
    with tempfile.TemporaryDirectory() as place:
        session = Path(place) / "akwanga"
        run = [sys.executable, "-m", "a7sim", "run", "akwanga", "--seed", "7", "--quiet", "--out", str(session)]
        subprocess.run(run, check=True)
        if "--check" in sys.argv[1:]:
            found = stale(session)
            sys.exit(f"not fresh: {', '.join(found)}: run python docs/make_reference.py" if found else 0)
        for name, text in pages(session).items():
            (DOCS / name).parent.mkdir(exist_ok=True)
            (DOCS / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
